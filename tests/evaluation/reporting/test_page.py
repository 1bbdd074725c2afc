"""The report in a real browser: it opens without network, shows the data, and works without a mouse."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.reporting.packing import pack
from motion_cueing.evaluation.reporting.report import save_report
from motion_cueing.evaluation.reporting.signals import PANELS, worst_second
from motion_cueing.evaluation.results import Results

from ..examples import GAINS, ORIGIN
from ..synthetic import GRAVITY, drive, trajectory

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.slow

MARKUP = "<img src=x onerror=\"document.title='broken'\">"
PEAK_AT = 7001
"""Row of the one sample with a peak."""


def _with_a_peak(policy: str, height: float):
    n = 12_001
    force = np.tile([0.0, 0.0, -GRAVITY], (n, 1))
    force[PEAK_AT, 0] = height
    return trajectory(n, 0.01, policy=policy, maneuver="peak", f_simulator=force)


DRIVES = {
    "weave": {name: drive(gain, policy=name) for name, gain in {**GAINS, MARKUP: 0.5}.items()},
    "peak": {
        name: _with_a_peak(name, 0.01 * i) for i, name in enumerate([*GAINS, MARKUP])
    } | {"optimal-washout-tuned": _with_a_peak("optimal-washout-tuned", 30.0)},
}  # fmt: skip


@pytest.fixture(scope="module")
def browser():
    """Chromium, the one of the system if there is one."""
    with playwright.sync_playwright() as driver:
        path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
        if path is None and not Path(driver.chromium.executable_path).exists():
            pytest.skip("no browser found; install Chromium, or run `playwright install chromium`")
        started = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture(scope="module")
def results():
    measured = {m: {name: measure(one) for name, one in drives.items()} for m, drives in DRIVES.items()}
    return Results.of(measured, [], ORIGIN)


@pytest.fixture(scope="module")
def opened(browser, results, tmp_path_factory):
    """A page of 1400 px with the report, and what it complained of or loaded while it opened."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    save_report(results, path, {m: pack(drives) for m, drives in DRIVES.items()})
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.set_default_timeout(120_000)
    troubles: list[str] = []
    page.on("console", lambda message: troubles.append(message.text))
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: troubles.append(request.url))
    page.goto(path.as_uri())
    _ready(page, 0)
    troubles.remove(path.as_uri())
    return page, troubles


def _ready(page, index):
    page.wait_for_function(f"window.motionCueingReport?.ready === {index}")


@pytest.fixture
def page(opened):
    """The page with the first drive, whole, and the policies it shows at first."""
    page = opened[0]
    page.set_viewport_size({"width": 1400, "height": 900})
    page.evaluate("() => window.motionCueingReport.choose(0)")
    _ready(page, 0)
    page.click("#few")
    return page


def chart(page, name, of):
    """A property of the plot of a panel."""
    return page.evaluate(
        f"(name) => {{ const u = motionCueingReport.state.charts.find((u) => u.panel.name === name);"
        f" return {of}; }}",
        name,
    )


def shown_range(page):
    return page.evaluate("() => [motionCueingReport.state.from, motionCueingReport.state.to]")


def test_it_opens_without_a_complaint_and_loads_nothing(opened):
    page, troubles = opened
    assert [one for one in troubles if not one.startswith(("data:", "blob:"))] == []
    assert page.title() == "Motion cueing evaluation"


def test_a_name_with_markup_stays_text(page):
    assert page.locator("img").count() == 0
    assert MARKUP in page.locator(".policies label").all_text_contents()
    assert page.title() == "Motion cueing evaluation"


def test_the_plots_have_the_data_of_the_results(page, results):
    labels = chart(page, "gathered", "u.found.map((line) => line.policy)")
    last = chart(page, "gathered", "u.data.slice(1).map((values) => values[values.length - 1])")
    for name, value in zip(labels, last, strict=True):
        assert value == pytest.approx(results.maneuvers["weave"][name].cue_error, abs=3e-4)
    for panel in (one for one in PANELS if one.name in ("f_y", "w_z", "pitch", "carriage_y", "step_time")):
        labels = chart(page, panel.name, "u.found.map((line) => line.policy)")
        values = chart(page, panel.name, "u.data.slice(1).map((values) => Array.from(values))")
        for name, found in zip(labels, values, strict=True):
            one = DRIVES["weave"]["mpc" if name is None else name]
            expected = (panel.car if name is None else panel.signal)(one, Criteria())
            found = np.array(found, dtype=float)
            np.testing.assert_allclose(found, expected, atol=1e-3 * panel.least, rtol=0.01)


def test_four_policies_are_shown_at_first_and_a_click_shows_another(page):
    visible = "u.found.filter((line, i) => u.series[i + 1].show).map((line) => line.policy)"
    assert chart(page, "f_y", visible) == [
        None,
        "optimal-washout-tuned",
        "optimum",
        "optimum-perceived",
        "mpc",
    ]
    box = page.get_by_role("checkbox", name="no-motion")
    box.focus()
    page.keyboard.press("Space")
    assert "no-motion" in chart(page, "f_y", visible)
    page.keyboard.press("Space")
    assert "no-motion" not in chart(page, "f_y", visible)


def test_a_peak_of_one_sample_is_seen_at_every_zoom(page):
    page.evaluate("() => motionCueingReport.choose(1)")
    _ready(page, 1)
    # A pixel of the whole drive stands for some thirty samples.
    color = """(() => {
      const x = Math.round(u.valToPos(70.01, "x", true)), y = Math.round(u.valToPos(25, "y", true));
      const { data } = u.ctx.getImageData(x - 2, y, 5, 1);
      let ink = 0;
      for (let i = 0; i < data.length; i += 4) ink = Math.max(ink, data[i + 3] * (255 - data[i]));
      return ink; })()"""
    for begin, end in ((0.0, 120.0), (60.0, 80.0), (69.5, 70.5)):
        page.evaluate("([a, b]) => motionCueingReport.setRange(a, b)", [begin, end])
        page.wait_for_function(
            "motionCueingReport.state.charts.every((u) => u.scales.x.min === motionCueingReport.state.from)"
        )
        assert chart(page, "f_x", "u.scales.y.max") > 30.0
        # The line of this policy has no red in it.
        assert chart(page, "f_x", color) > 100 * 150
    page.evaluate("() => motionCueingReport.setRange(0, 20)")
    page.wait_for_function("motionCueingReport.state.charts[0].scales.y.max < 5")


def test_the_worst_second_is_one_click_away(page):
    worst = worst_second(DRIVES["weave"]["no-motion"], Criteria())
    page.locator(".drive:not([hidden]) button.worst[data-policy='no-motion']").click()
    begin, end = shown_range(page)
    assert begin <= worst.begin < worst.end <= end
    assert end - begin == pytest.approx(min(5.0, end - begin), abs=0.1)
    assert page.get_by_role("checkbox", name="no-motion").is_checked()


def test_the_keyboard_moves_the_moment_and_the_range(page):
    plot = page.get_by_role("group", name="Plot: Specific force y (sway), m/s²")
    plot.focus()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowRight")
    tip = page.locator("#tip")
    # A second and a step of 0.025 s, to two digits.
    assert float(tip.locator("b").inner_text().removesuffix(" s")) == pytest.approx(1.025, abs=0.0051)
    assert "optimum" in tip.inner_text()
    assert "m/s²" in tip.inner_text()
    page.wait_for_function("/^1\\.0[23] s: car /.test(document.getElementById('said').textContent)")
    page.keyboard.press("+")
    begin, end = shown_range(page)
    assert end - begin == pytest.approx(10.0)
    page.keyboard.press("PageDown")
    assert shown_range(page)[0] == pytest.approx(begin + 5.0)
    page.keyboard.press("0")
    assert shown_range(page) == [0.0, 20.0]


def test_a_drag_zooms_all_plots_and_a_double_click_shows_the_whole(page):
    over = page.locator(".plot .u-over").nth(3)
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 60, steps=4)
    page.mouse.up()
    np.testing.assert_allclose(shown_range(page), [5.0, 15.0], atol=0.2)
    page.wait_for_function("motionCueingReport.state.charts.every((u) => u.scales.x.max < 16)")
    page.mouse.dblclick(box["x"] + 50, box["y"] + 40)
    assert shown_range(page) == [0.0, 20.0]


def test_an_address_leads_back_to_drive_policies_and_range(page):
    page.evaluate("() => { location.hash = 'drive=peak&policy=mpc&from=10&to=20' }")
    _ready(page, 1)
    assert shown_range(page) == [10.0, 20.0]
    assert page.get_by_role("checkbox", name="mpc").is_checked()
    assert not page.get_by_role("checkbox", name="optimal-washout-tuned").is_checked()
    assert page.get_by_role("radio", name="peak").is_checked()


def test_a_table_is_sorted_by_a_column(page):
    table = page.locator("#summary table").first
    header = table.get_by_role("columnheader", name="mean J")
    for direction in (1.0, -1.0):
        header.get_by_role("button").press("Enter")
        values = [float(cell) for cell in table.locator("tbody td:nth-child(2)").all_text_contents()]
        assert values == sorted(values, key=lambda value: direction * value)
    assert header.get_attribute("aria-sort") == "descending"


@pytest.mark.parametrize("width", [1400, 420])
def test_it_passes_the_accessibility_check_at_any_width(page, width):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page.set_viewport_size({"width": width, "height": 900})
    for details in page.locator("details").all():
        details.evaluate("(one) => { one.open = true; }")
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth") == width
