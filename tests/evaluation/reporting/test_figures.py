"""Figures show the data: lines equal the signals of the trajectories, bars the numbers of the benchmark."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from PIL import Image

from motion_cueing.evaluation.benchmark import benchmark
from motion_cueing.evaluation.comparison import normalized_score
from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.reporting.figures import (
    _spread,  # the rule of the numbers beside a panel, for any heights
    benchmark_figure,
    line_styles,
    maneuver_figure,
    png,
    shown_policies,
)
from motion_cueing.evaluation.reporting.text import fraction, number
from motion_cueing.evaluation.results import Results

from ..examples import GAINS, ORIGIN, results_of
from ..synthetic import GRAVITY, drive

DRIVES = {
    "classical-tuned": drive(policy="classical-tuned"),
    "no-motion": drive(gain=0.0, policy="no-motion"),
}


def lines(axes, color):
    """Data of the lines of a color that are not level, in the order they were drawn."""
    found = [line for line in axes.lines if to_rgb(line.get_color()) == to_rgb(color)]
    return [line.get_ydata() for line in found if len(line.get_ydata()) > 2]


@pytest.fixture(scope="module")
def panels():
    """Axes of the figure of a maneuver by title."""
    figure = maneuver_figure(DRIVES)
    return {axes.get_title("left"): axes for axes in figure.axes}


STYLES = line_styles(list(DRIVES))
DEGREES = np.degrees(1.0)
REST = np.array([0.0, 0.0, -GRAVITY])


@pytest.mark.parametrize(
    ("title", "column", "axis", "factor"),
    [
        ("Specific force x (surge)", "f", 0, 1.0),
        ("Specific force y (sway)", "f", 1, 1.0),
        ("Specific force z + g (heave)", "f", 2, 1.0),
        ("Roll rate", "w", 0, DEGREES),
        ("Pitch rate", "w", 1, DEGREES),
        ("Yaw rate", "w", 2, DEGREES),
    ],
)
def test_a_panel_shows_the_cues_of_car_and_simulator(panels, title, column, axis, factor):
    offset = REST[axis] if column == "f" else 0.0
    for name, one in DRIVES.items():
        (line,) = lines(panels[title], STYLES[name]["color"])
        np.testing.assert_allclose(line, factor * (getattr(one, f"{column}_simulator")[:, axis] - offset))
    (car,) = lines(panels[title], "#1a1a1a")
    reference = getattr(DRIVES["no-motion"], f"{column}_reference")[:, axis]
    np.testing.assert_allclose(car, factor * (reference - offset))


@pytest.mark.parametrize(
    ("title", "signal", "factor"),
    [
        ("Hexapod roll", lambda d: d.hexapod[:, 3], DEGREES),
        ("Hexapod pitch", lambda d: d.hexapod[:, 4], DEGREES),
        ("Carriage x", lambda d: d.carriage[:, 0], 1.0),
        ("Carriage y", lambda d: d.carriage[:, 1], 1.0),
        ("Turntable", lambda d: d.turntable, DEGREES),
        ("Actuators at a limit", lambda d: (d.limits_active != 0).sum(axis=1), 1.0),
    ],
)
def test_a_panel_shows_the_motion_of_the_machine(panels, title, signal, factor):
    for name, one in DRIVES.items():
        (line,) = lines(panels[title], STYLES[name]["color"])
        np.testing.assert_allclose(line, factor * signal(one))


def test_legs_are_shown_from_shortest_to_longest(panels):
    one = DRIVES["classical-tuned"]
    lowest, highest = lines(
        panels["Legs, shortest to longest of the six"], STYLES["classical-tuned"]["color"]
    )
    np.testing.assert_array_equal(lowest, one.legs.min(axis=1))
    np.testing.assert_array_equal(highest, one.legs.max(axis=1))


def test_the_gathered_cue_error_ends_at_j(panels):
    axes = next(axes for title, axes in panels.items() if title.startswith("Cue error so far"))
    for (name, one), text in zip(DRIVES.items(), axes.texts, strict=True):
        (line,) = lines(axes, STYLES[name]["color"])
        assert line[-1] == pytest.approx(measure(one).cue_error)
        assert text.get_text() == f"{line[-1]:.2f}"


def test_the_tilt_rate_stands_against_its_limit(panels):
    axes = panels["Tilt rate beyond the car's own"]
    one = DRIVES["classical-tuned"]
    (line,) = lines(axes, STYLES["classical-tuned"]["color"])
    assert line.max() == pytest.approx(np.degrees(measure(one).tilt_rate_peak))
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


def test_a_figure_names_its_drive_and_every_policy():
    figure = maneuver_figure(DRIVES)
    assert figure.get_suptitle() == "weave (car sedan, motion base base)"
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == {*DRIVES, "car"}


def test_a_figure_leaves_no_global_state_and_its_picture_has_ink_in_every_panel():
    before = dict(mpl.rcParams)
    figure = maneuver_figure(DRIVES)
    picture = np.asarray(Image.open(io.BytesIO(png(figure))).convert("RGB"), dtype=int)
    assert dict(mpl.rcParams) == before
    assert picture.shape == (1540, 1430, 3)
    color = 255.0 * np.array(to_rgb(STYLES["classical-tuned"]["color"]))
    for axes in figure.axes:
        box = axes.get_window_extent()
        rows = slice(round(1540 - box.y1), round(1540 - box.y0))
        part = picture[rows, round(box.x0) : round(box.x1)]
        # Of the policy's color there is at least a line across a tenth of the panel.
        near = (np.abs(part - color).max(axis=2) < 60).sum()
        assert near > 0.1 * box.width, axes.get_title("left")


def test_a_figure_of_a_maneuver_shows_the_normalized_score():
    drives = {name: drive(gain, policy=name) for name, gain in GAINS.items()}
    axes = next(
        axes
        for axes in maneuver_figure(drives).axes
        if axes.get_title("left") == "Cue error so far, to J (normalized score)"
    )
    texts = dict(zip(GAINS, axes.texts, strict=True))
    errors = {name: measure(one).cue_error for name, one in drives.items()}
    for name, error in errors.items():
        score = normalized_score(error, errors["classical-tuned"], errors["optimum"])
        assert texts[name].get_text() == f"{error:.2f} ({score:.2f})"
    heights = sorted(text.xy[1] for text in axes.texts)
    assert min(np.diff(heights)) > 0.07


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_numbers_beside_a_panel_lie_apart_and_below_its_title(heights):
    moved = np.array(_spread(heights, 0.075))
    assert moved.max() <= 1.0
    assert np.all(np.diff(np.sort(moved)) > 0.0749)
    order = np.argsort(heights, kind="stable")
    assert np.all(np.diff(moved[order]) > 0.0)


def test_a_figure_of_many_policies_shows_the_references_and_the_best():
    gains = {f"p{i}": 0.02 * i for i in range(10)} | {"classical-tuned": 0.0, "optimum": 0.1}
    drives = {name: drive(gain, policy=name) for name, gain in gains.items()}
    shown = shown_policies(drives, Criteria())
    assert shown[:2] == ["classical-tuned", "optimum"]
    assert sorted(shown[2:]) == [f"p{i}" for i in range(4, 10)]
    few = {name: drives[name] for name in list(drives)[:8]}
    assert shown_policies(few, Criteria()) == list(few)
    figure = maneuver_figure(drives, list(drives))
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert labels == [*shown, "car"]
    assert figure.legends[0].get_title().get_text().endswith("p0, p1, p2, p3")


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
