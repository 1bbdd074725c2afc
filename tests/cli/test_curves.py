"""Curves of trainings."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from motion_cueing.cli.curves import draw_learning, grouped, learning_figure, read_curve
from motion_cueing.cli.main import main


@pytest.fixture
def runs(tmp_path):
    for name, end in (("fast-0", 1.0), ("fast-1", 3.0), ("slow", 5.0)):
        (tmp_path / name).mkdir()
        text = f"steps,classical/J,validation/J\n0,2.3,8\n500000,,6\n1000000,,{end}\n"
        (tmp_path / name / "log.csv").write_text(text, encoding="utf-8")
    return [tmp_path / name for name in ("fast-0", "fast-1", "slow")]


def test_seeds_of_a_training_are_one_line_with_a_band(runs, tmp_path, capsys):
    out = tmp_path / "curves.svg"
    assert main(["curves", *map(str, runs), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert "fast: lowest validation/J 2 (1 to 3)" in told
    assert "slow: lowest validation/J 5 (5 to 5)" in told
    assert out.read_text(encoding="utf-8").lstrip().startswith("<?xml")


def test_a_curve_holds_the_rows_that_have_the_scalar(runs):
    np.testing.assert_array_equal(read_curve(runs[0], "classical/J"), [[0.0], [2.3]])
    curve = read_curve(runs[0], "validation/J")
    np.testing.assert_array_equal(curve, [[0.0, 5e5, 1e6], [8.0, 6.0, 1.0]])
    assert [len(seeds) for seeds in grouped(dict.fromkeys(runs, curve)).values()] == [2, 1]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--out", "x.png"], "--runs must be given"),
        (["RUN", "--out", "x.pdf"], "ends in .png or .svg"),
        (["RUN", "--out", "x.png", "--scalar", "validation/j"], "validation/J"),
        (["nowhere", "--out", "x.png"], "no log of a training"),
    ],
)
def test_what_cannot_be_drawn_is_told(runs, arguments, told, capsys):
    given = [str(runs[0]) if argument == "RUN" else argument for argument in arguments]
    assert main(["curves", *given]) == 2
    assert told in capsys.readouterr().err


def test_what_was_learned_stands_beside_its_references(tmp_path):
    text = (
        "steps,classical/J,no-motion/J,start/J,validation/J,validation/noisy_J\n"
        "0,7.24,8.6,5.43,5.5,6\n500000,,,,3,4\n1000000,,,,1.25,1.26\n"
    )
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    (axes,) = learning_figure(tmp_path).axes
    lines = {tuple(line.get_ydata()) for line in axes.lines}
    assert lines == {(5.5, 3.0, 1.25), (6.0, 4.0, 1.26), (7.24, 7.24), (8.6, 8.6), (5.43, 5.43)}
    labels = {label.get_text(): label.xy[1] for label in axes.texts}
    assert sorted(labels, key=labels.__getitem__) == [
        "agent 1.25", "exploring 1.26", "at the start 5.43", "classical washout 7.24", "standing still 8.6"
    ]  # fmt: skip
    places = sorted(labels.values())
    assert np.diff(places).min() > 0.06
    assert draw_learning(tmp_path) == tmp_path / "learning.png"
    assert plt.imread(tmp_path / "learning.png").std() > 0.0


def test_a_log_of_before_is_drawn_with_what_it_has(runs):
    (axes,) = learning_figure(runs[2]).axes
    assert {label.get_text() for label in axes.texts} == {"agent 5", "classical washout 2.3"}
