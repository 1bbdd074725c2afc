"""The page of a training: what it draws of a log, and that it follows the folder in a real browser."""

from __future__ import annotations

import os
import threading

import pytest

from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.reporting.view.server import PageServer, Routes
from motion_cueing.evaluation.reporting.view.training import (
    AGENT,
    TrainingPage,
    drive_with,
    lines_of,
    plots_of,
)

from ....browser import chromium, opened
from .test_page import weave

ROWS = [
    {"steps": 0.0, "validation/J": 9.0, "classical/J": 4.0, "terms/cue_error": 1.0},
    {"steps": 1e6, "train/sigma": 0.3, "terms/cue_error": 0.6},
    {"steps": 2e6, "validation/J": 3.0, "validation/leg_travel": 0.5, "terms/cue_error": 0.4},
]


def test_the_plots_are_those_the_log_has_something_for():
    plots = {plot.title: lines_of(plot, ROWS) for plot in plots_of(ROWS)}
    assert list(plots) == ["J on the validation drives", "Terms of the reward", "Noise", "Travel in use"]
    agent, classical = plots["J on the validation drives"]
    assert (agent["label"], agent["time"], agent["values"]) == ("agent", [0.0, 2.0], [9.0, 3.0])
    assert (classical["label"], classical["time"], classical["values"]) == (
        "classical washout",
        [0.0, 2.0],
        [4.0, 4.0],
    )
    assert plots["Terms of the reward"][0]["values"] == [1.0, 0.6, 0.4]


def test_a_log_without_rows_has_no_plots():
    assert plots_of([]) == []


def test_what_has_no_place_on_a_logarithmic_axis_is_left_out():
    rows = [{"steps": 0.0, "validation/J": float("nan")}, {"steps": 1e6, "validation/J": 0.0}, *ROWS]
    assert lines_of(plots_of(rows)[0], rows)[0]["values"] == [9.0, 3.0]


@pytest.mark.slow
def test_it_follows_the_folder(tmp_path):
    platform, cues = get_platform("paper"), weave()
    rows, driven = [*ROWS[:1]], []
    drive = drive_with(make_policy, cues, platform)
    file = tmp_path / "best.safetensors"

    def stand_in(name):
        driven.append(name)
        return drive("no-motion" if name == str(file) else name)

    training = TrainingPage(tmp_path, lambda: rows, file, stand_in, cues, platform)
    routes = Routes(training.render, {"/log": training.log, "/film": training.film})
    server = PageServer(routes)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    with chromium() as browser:
        page, troubles = opened(browser, server.url)
        page.wait_for_function("window.ready")
        assert page.locator(".film").is_hidden()
        rows += ROWS[1:]
        file.write_bytes(b"first")
        page.wait_for_function("window.motionCueingTraining.agent > 0")
        page.get_by_text("agent 3.00").wait_for()
        assert page.locator(".stage .name").all_text_contents() == ["classical", AGENT]
        os.utime(file, (1e9, 1e9))
        page.wait_for_function("window.motionCueingTraining.agent === 1e12")
        assert driven == ["classical", str(file), str(file)]
        axe = pytest.importorskip("axe_playwright_python.sync_playwright")
        for width in (1400, 420):
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(300)
            found = axe.Axe().run(page)
            assert found.violations_count == 0, found.generate_report()
            assert page.evaluate("document.documentElement.scrollWidth") == width
        assert troubles == []
    server.shutdown()
    thread.join()
    server.server_close()
