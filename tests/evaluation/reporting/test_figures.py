"""Figures show the data: lines equal the signals of the trajectories, bars the numbers of the benchmark."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from PIL import Image

from motion_cueing.evaluation.benchmark import benchmark
from motion_cueing.evaluation.comparison import normalized_score
from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.reporting.figures import (
    _spread,  # the rule of the labels beside a panel, for any heights
    benchmark_figure,
    line_styles,
    maneuver_figure,
    save_figure,
    shown_policies,
)
from motion_cueing.evaluation.reporting.signals import PANELS
from motion_cueing.evaluation.reporting.text import fraction, number
from motion_cueing.evaluation.results import Results

from ..examples import GAINS, ORIGIN, results_of
from ..synthetic import drive

DRIVES = {
    "optimal-washout-tuned": drive(policy="optimal-washout-tuned"),
    "no-motion": drive(gain=0.0, policy="no-motion"),
}


def lines(axes, color):
    """Data of the lines of a color that are not level, in the order they were drawn."""
    found = [line for line in axes.lines if to_rgb(line.get_color()) == to_rgb(color)]
    return [line.get_ydata() for line in found if len(line.get_ydata()) > 2]


STYLES = line_styles(list(DRIVES))


@pytest.fixture(scope="module")
def panels():
    """Axes of a figure of every panel, by title."""
    figure = maneuver_figure(DRIVES, panels=[panel.name for panel in PANELS if panel.name != "step_time"])
    return {axes.get_title("left"): axes for axes in figure.axes}


@pytest.mark.parametrize(
    "panel", [panel for panel in PANELS if panel.name != "step_time"], ids=lambda panel: panel.name
)
def test_a_panel_shows_the_signal_of_each_policy_and_of_the_car(panels, panel):
    for name, one in DRIVES.items():
        signal = panel.signal(one, Criteria())
        shown = lines(panels[panel.title], STYLES[name]["color"])
        for line, column in zip(shown, np.atleast_2d(signal.T), strict=True):
            np.testing.assert_array_equal(line, column)
    if panel.car is not None:
        (car,) = lines(panels[panel.title], "#1a1a1a")
        np.testing.assert_array_equal(car, panel.car(DRIVES["no-motion"], Criteria()))


def test_the_tilt_rate_stands_against_its_limit(panels):
    axes = panels["Tilt rate beyond the car's own"]
    assert any(np.allclose(level.get_ydata(), 3.0) for level in axes.lines)


def test_limits_are_drawn_where_the_motion_comes_near_them(panels):
    def levels(title):
        return sorted(
            y
            for axes in [panels[title]]
            for line in axes.lines
            for y in {*line.get_ydata()}
            if len(line.get_ydata()) == 2
        )

    # The carriage uses 7.2 of 13.72 m across, but 1.6 m along.
    assert levels("Carriage y") == [-13.72, 13.72]
    assert levels("Carriage x") == []
    assert panels["Carriage x"].get_title("right") == "limit ±13.7 m"


def test_a_figure_names_its_drive_and_labels_every_line():
    figure = maneuver_figure(DRIVES)
    assert figure.get_suptitle() == "weave (car sedan, motion base base)"
    assert {text.get_text() for text in figure.axes[0].texts} == {*DRIVES, "car"}


def test_a_figure_is_as_wide_as_a_column_and_its_letters_can_be_read():
    figure = maneuver_figure(DRIVES)
    assert figure.get_size_inches()[0] == 3.5
    texts = [text for text in figure.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in texts) >= 6.0


def test_a_figure_leaves_no_global_state_and_its_picture_has_ink_in_every_panel(tmp_path):
    before = dict(mpl.rcParams)
    figure = maneuver_figure(DRIVES)
    save_figure(figure, tmp_path / "weave.2")
    picture = np.asarray(Image.open(tmp_path / "weave.2.png").convert("RGB"), dtype=int)
    assert dict(mpl.rcParams) == before
    height, width, _ = picture.shape
    assert width == 1050
    color = 255.0 * np.array(to_rgb(STYLES["optimal-washout-tuned"]["color"]))
    for axes in figure.axes:
        box = axes.get_position()
        rows = slice(round(height * (1.0 - box.y1)), round(height * (1.0 - box.y0)))
        part = picture[rows, round(width * box.x0) : round(width * box.x1)]
        # Of the policy's color there is at least a line across a tenth of the panel.
        near = (np.abs(part - color).max(axis=2) < 60).sum()
        assert near > 0.1 * part.shape[1], axes.get_title("left")


def test_the_pdf_holds_lines_and_letters_and_no_picture(tmp_path):
    save_figure(maneuver_figure(DRIVES), tmp_path / "weave")
    content = (tmp_path / "weave.pdf").read_bytes()
    assert b"/Subtype /Image" not in content
    # Fonts are embedded as TrueType, which editors can change.
    assert b"/FontFile2" in content


def test_a_figure_of_a_maneuver_shows_the_normalized_score():
    drives = {name: drive(GAINS[name], policy=name) for name in ("optimal-washout-tuned", "optimum", "mpc")}
    axes = maneuver_figure(drives).axes[-1]
    texts = {text.get_text().partition("\n")[0]: text for text in axes.texts}
    errors = {name: measure(one).cue_error for name, one in drives.items()}
    for name, error in errors.items():
        score = normalized_score(error, errors["optimal-washout-tuned"], errors["optimum"])
        assert texts[name].get_text() == f"{name}\n{error:.2f} ({score:.2f})"
    heights = sorted(text.get_position()[1] for text in axes.texts)
    assert min(np.diff(heights)) > 0.39


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_labels_beside_a_panel_lie_apart_and_below_its_title(heights):
    moved = np.array(_spread(heights, 0.075))
    assert moved.max() <= 1.0
    assert np.all(np.diff(np.sort(moved)) > 0.0749)
    order = np.argsort(heights, kind="stable")
    assert np.all(np.diff(moved[order]) > 0.0)


def test_a_figure_shows_four_policies_the_references_and_the_best():
    gains = {f"p{i}": 0.02 * i for i in range(10)} | {"optimal-washout-tuned": 0.0, "optimum": 0.1}
    drives = {name: drive(gain, policy=name) for name, gain in gains.items()}
    assert shown_policies(drives, Criteria()) == ["optimal-washout-tuned", "optimum", "p9", "p8"]
    labels = [line.get_label() for line in maneuver_figure(drives, list(drives)).axes[0].lines]
    assert labels == ["optimal-washout-tuned", "optimum", "p9", "p8", "car"]
    chosen = maneuver_figure(drives, ["p1", "p3"]).axes[0].lines
    assert [line.get_label() for line in chosen] == ["p1", "p3", "car"]


def bars(axes):
    """Widths and vertical places of the bars of each series."""
    return [
        [(bar.get_width(), bar.get_y() + bar.get_height() / 2) for bar in series]
        for series in axes.containers
    ]


def test_the_bars_of_the_benchmark_are_its_numbers():
    results = results_of(GAINS)
    rows = benchmark(results)
    errors, scores = benchmark_figure(results).axes
    for series, column in zip(bars(errors), ("cue_error", "perceived_cue_error"), strict=True):
        np.testing.assert_allclose([width for width, _ in series], np.maximum(rows[column], 0.01))
        np.testing.assert_allclose([place for _, place in series], np.arange(len(rows)), atol=0.2)
    for series, column in zip(bars(scores), ("normalized_score", "perceived_normalized_score"), strict=True):
        np.testing.assert_allclose([width for width, _ in series], np.maximum(rows[column], -1.0))
    assert [label.get_text() for label in errors.get_yticklabels()] == list(rows["policy"])
    texts = [text.get_text().removeprefix("◂ ") for text in errors.texts]
    assert texts == [number(v) for name in ("cue_error", "perceived_cue_error") for v in rows[name]]
    shown = [text.get_text().removeprefix("◂ ") for text in scores.texts]
    assert shown == [fraction(v) for name in rows.columns[2:4] for v in rows[name]]
    assert "means over 2 drives" in benchmark_figure(results).get_suptitle()


def test_a_bar_of_almost_0_ends_at_the_edge_and_says_so():
    results = results_of(GAINS)
    maneuvers = {
        name: {policy: measure(drive(1.0, 0.0)) if policy == "optimum" else m for policy, m in drives.items()}
        for name, drives in results.maneuvers.items()
    }
    errors = benchmark_figure(Results.of(maneuvers, [], ORIGIN)).axes[0]
    assert errors.texts[len(GAINS) - 1].get_text().startswith("◂ ")
    assert errors.get_xlim()[0] >= 0.001


def test_one_policy_makes_no_benchmark():
    assert benchmark_figure(results_of({"mpc": 0.9})) is None


def test_without_references_there_is_one_panel():
    (axes,) = benchmark_figure(results_of({"mpc": 0.9, "no-motion": 0.0})).axes
    assert axes.get_title("left").startswith("Mean J")
