"""Tuning by hand: the page's sliders, what the server answers, and both in a real browser."""

from __future__ import annotations

import re
import threading
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.baselines.tuning.effects import EFFECTS, axis_of, kind_of
from motion_cueing.baselines.washout.families import load_parameters
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import load
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.reporting.view.server import PageServer, Routes
from motion_cueing.evaluation.reporting.view.tuning import NOW, START, HandTuning, figures
from motion_cueing.evaluation.rollout import rollout

from ....browser import chromium, opened
from .test_page import driven, weave

DOCS = Path(__file__).parents[4] / "docs" / "explanation"


@pytest.fixture
def tuning():
    return HandTuning(load_parameters("classical"), [weave()], get_platform("paper"))


def test_the_effects_are_those_of_the_documentation():
    text = " ".join(" ".join(DOCS.joinpath(f"{name}-washout.md").read_text(encoding="utf-8").split())
                    for name in ("classical", "adaptive", "optimal"))  # fmt: skip
    assert [effect for effect in EFFECTS.values() if effect not in text] == []


@pytest.mark.parametrize("name", ["classical", "adaptive", "optimal-washout"])
def test_every_effect_has_its_parameter(name):
    space = HandTuning(load_parameters(name), [weave()], get_platform("paper")).space
    kinds = {kind_of(one.path) for one in space.coordinates}
    assert len(kinds & set(EFFECTS)) >= 8


def test_paths_in_words():
    assert (kind_of("hps.1.frequency"), axis_of("hps.1.frequency")) == ("hps.frequency", "y, lateral")
    assert (kind_of("surge.tilt_rate"), axis_of("surge.tilt_rate")) == ("tilt_rate", "surge")
    assert (kind_of("rate_scale.2"), axis_of("rate_scale.2")) == ("rate_scale", "yaw")
    assert (kind_of("lpc.frequency"), axis_of("lpc.frequency")) == ("lpc.frequency", "")


def test_without_a_change_the_drive_is_that_of_the_start(tuning):
    answer = tuning.replay({"drive": "weave", "places": {}})
    expected = measure(driven(get_platform("paper"))).cue_error
    assert answer["figures"][START]["J"] == pytest.approx(expected, rel=1e-12)
    assert answer["figures"][NOW]["J"] == pytest.approx(expected, rel=1e-3)


def test_a_scale_of_force_at_its_low_end_uses_less_travel(tuning):
    low = tuning.replay({"drive": "weave", "places": {"force_scale.0": 0.0, "force_scale.1": 0.0}})["figures"]
    assert low[NOW]["carriage travel"] < 0.6 * low[START]["carriage travel"]


def test_a_set_is_that_of_its_places(tuning):
    found = tuning.parameters({"force_scale.0": 0.5, "hps.0.frequency": 1.0})
    assert found.force_scale[0] == pytest.approx(0.7)
    assert found.hps[0].frequency == pytest.approx(2.5)
    assert found.force_scale[1] == load_parameters("classical").force_scale[1]


@pytest.mark.parametrize(
    "places", [{"nonsense": 0.5}, {"force_scale.0": "much"}, {"force_scale.0": float("nan")}]
)
def test_wrong_places_are_refused(tuning, places):
    with pytest.raises(ConfigurationError):
        tuning.replay({"drive": "weave", "places": places})


def test_travel_without_an_end_has_no_share():
    platform = get_platform("paper")
    drive = rollout(make_policy("classical", platform), weave(), platform=platform)
    found = figures(drive)
    assert found["turntable travel"] is None
    assert found["leg travel"] == pytest.approx(np.abs(drive.legs).max() / 0.67)


@pytest.fixture
def served(tuning, tmp_path):
    """Its page in a browser, what it complained of, and where it saves."""
    from motion_cueing.envs.settings import save

    out = tmp_path / "hand.yaml"

    def write(request):
        save(tuning.parameters(request["places"]), out)
        return {"saved": out.name}

    server = PageServer(Routes(lambda: tuning.render(out.name), {"/replay": tuning.replay, "/save": write}))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    with chromium() as browser:
        page, troubles = opened(browser, server.url)
        page.wait_for_function("window.ready && motionCueingTune.turn === 1")
        yield page, troubles, out
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.mark.slow
def test_a_slider_changes_j_and_the_set_is_saved(served, tuning):
    page, troubles, out = served
    j = page.locator("#figures tbody tr").first.locator("td").first
    before = j.inner_text()
    slider = page.get_by_role("slider", name="force_scale y, lateral")
    slider.focus()
    page.keyboard.press("Home")
    page.wait_for_function("motionCueingTune.turn > 1")
    assert j.inner_text() != before
    shown = page.evaluate("motionCueingTune.answer.figures['as set'].J")
    places = page.evaluate("motionCueingTune.places")
    policy = make_policy("classical", get_platform("paper"))
    changed = tuning.parameters(places)
    assert changed.force_scale[1] == pytest.approx(0.2)
    expected = rollout(
        type(policy)(changed, get_platform("paper").cab), weave(), platform=get_platform("paper")
    )
    assert shown == pytest.approx(measure(expected).cue_error, rel=1e-9)
    page.get_by_role("button", name=re.compile("Save")).click()
    page.get_by_text("is written").wait_for()
    assert load(type(changed), out) == changed
    page.get_by_role("button", name="Back to the start").click()
    page.wait_for_function(f"document.querySelector('#figures tbody td').textContent === '{before}'")
    assert troubles == []


@pytest.mark.slow
def test_it_passes_the_accessibility_check_at_any_width(served):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page, _, _ = served
    for width in (1400, 420):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(300)
        found = axe.Axe().run(page)
        assert found.violations_count == 0, found.generate_report()
        assert page.evaluate("document.documentElement.scrollWidth") == width
