"""The share of the gap and the ladder of controllers."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.cli.arguments import BENCHMARK, find_platform, find_policies
from motion_cueing.evaluation.benchmark import (
    LADDER,
    ladder_names,
    ladder_table,
    rungs,
    save_ladder,
)
from motion_cueing.evaluation.comparison import Share, gap_share, shares
from motion_cueing.evaluation.metrics import Criteria, References, measure
from motion_cueing.evaluation.policies import policy_names
from motion_cueing.evaluation.reporting.figures import (
    _error,
    _errors,
    _spread,
    ladder_figure,
    line_styles,
    maneuver_figure,
    new_figure,
    shown_policies,
)
from motion_cueing.evaluation.reporting.report import render
from motion_cueing.evaluation.reporting.tables import maneuver_table, share_table, standings_table
from motion_cueing.evaluation.reporting.text import number
from motion_cueing.evaluation.results import Failure, Provenance, Results

from .synthetic import drive

ORIGIN = Provenance("motion-cueing evaluate", "2026-01-01T00:00:00+00:00", {}, "paper", "sedan", {})
J = st.floats(0.0, 1e3)

GAINS = {"no-motion": 0.0, "mpc": 0.85, "classical-tuned": 0.6, "optimum-perceived": 0.93, "optimum": 0.95}
"""Gain of a made-up simulator for each policy."""


def results_of(gains, criteria=None, failures=()):
    maneuvers = {
        name: {policy: measure(drive(gain, lag)) for policy, gain in gains.items()}
        for name, lag in (("weave", 0.0), ("late", 0.1))
    }
    return Results.of(maneuvers, list(failures), ORIGIN, criteria)


@given(J, J, J)
def test_the_share_is_0_at_the_baseline_and_1_at_the_optimum_and_linear_between(value, baseline, optimum):
    share = gap_share(value, baseline, optimum)
    if baseline <= optimum:
        assert share is None
        return
    assert gap_share(baseline, baseline, optimum) == 0.0
    assert gap_share(optimum, baseline, optimum) == 1.0
    assert baseline - share * (baseline - optimum) == pytest.approx(value, abs=1e-9 * max(baseline, value))


@pytest.mark.parametrize(("baseline", "optimum"), [(None, 1.0), (2.0, None), (None, None), (1.0, 1.0)])
def test_without_a_gap_there_is_no_share(baseline, optimum):
    assert gap_share(0.5, baseline, optimum) is None


def test_j_and_the_perceived_j_have_optima_of_their_own():
    found = shares(
        {"classical-tuned": 4.0, "mpc": 2.0, "optimum": 1.0, "optimum-perceived": 1.5},
        {"classical-tuned": 8.0, "mpc": 5.0, "optimum": 3.0, "optimum-perceived": 2.0},
        References(),
    )
    assert found["mpc"] == Share(2.0 / 3.0, 0.5)
    assert found["optimum-perceived"].perceived_cue_error == 1.0
    assert found["optimum-perceived"].cue_error == pytest.approx(2.5 / 3.0)


def test_the_share_of_the_suite_is_that_of_the_means():
    results = results_of(GAINS)
    mean = {s.policy: s.cue_error for s in results.standings}
    expected = (mean["classical-tuned"] - mean["mpc"]) / (mean["classical-tuned"] - mean["optimum"])
    standing = next(s for s in results.standings if s.policy == "mpc")
    assert standing.share == pytest.approx(expected)
    alone = {name: part["mpc"].cue_error for name, part in results.shares.items()}
    assert alone["weave"] != pytest.approx(alone["late"])


def test_a_reference_that_was_not_driven_or_failed_leaves_no_share():
    without = {name: gain for name, gain in GAINS.items() if name != "optimum"}
    results = results_of(without)
    assert all(s.share is None and s.perceived_share is not None for s in results.standings)
    table = standings_table(results)
    assert table.rows[0][table.header.index("share of the gap")] == "–"
    results = results_of({"no-motion": 0.0, "mpc": 0.9})
    assert "share of the gap" not in standings_table(results).header
    assert "share of the gap" not in ladder_table(results).header
    assert share_table(results).rows == ()


def test_the_references_are_a_matter_of_configuration():
    criteria = Criteria(references=References(baseline="no-motion", optimum="mpc"))
    results = results_of(GAINS, criteria)
    found = {s.policy: s.share for s in results.standings}
    assert (found["no-motion"], found["mpc"]) == (0.0, 1.0)
    assert results.criteria.references.optimum == "mpc"


def test_every_table_has_the_share():
    results = results_of(GAINS)
    for table in (
        maneuver_table("weave", results.maneuvers["weave"], results.shares["weave"]),
        standings_table(results),
        ladder_table(results),
    ):
        column = table.header.index("share of the gap")
        shown = {row[0]: row[column] for row in table.rows}
        assert (shown["classical-tuned"], shown["optimum"]) == ("0.00", "1.00")
        assert float(shown["no-motion"]) < 0.0 < float(shown["mpc"]) < 1.0
    assert share_table(results).header == ("maneuver", *results.policies)


def test_results_keep_their_shares(tmp_path):
    results = results_of(GAINS)
    results.save_json(tmp_path / "results.json")
    assert Results.load_json(tmp_path / "results.json") == results
    results.save_csv(tmp_path / "results.csv")
    rows = list(csv.DictReader((tmp_path / "results.csv").open()))
    row = next(row for row in rows if row["maneuver"] == "late" and row["policy"] == "mpc")
    assert float(row["share"]) == results.shares["late"]["mpc"].cue_error


def test_the_ladder_goes_from_no_motion_to_the_optimum():
    assert LADDER[0] == "no-motion"
    assert LADDER[-1] == "optimum"
    assert len(set(LADDER)) == len(LADDER)
    assert ladder_names(["optimum", "mine", "classical", "no-motion"]) == [
        "no-motion",
        "classical",
        "optimum",
    ]


def test_ladder_stands_for_its_policies_among_others():
    platform = find_platform("paper")
    found = find_policies([BENCHMARK, "brk", "classical"], platform)
    assert list(found) == [*ladder_names(policy_names()), "brk"]


def test_a_rung_is_worked_out_over_the_drives_that_all_finished():
    results = results_of(GAINS)
    cut = {"weave": results.maneuvers["weave"], "late": {"mpc": results.maneuvers["late"]["mpc"]}}
    results = Results.of(cut, [Failure("late", "optimum", "tired")], ORIGIN)
    found = {rung.policy: rung for rung in rungs(results)}
    assert list(found) == ["no-motion", "classical-tuned", "mpc", "optimum-perceived", "optimum"]
    metrics = results.maneuvers["weave"]["mpc"]
    assert found["mpc"].standing.maneuvers == 1
    assert found["mpc"].worst_axis == metrics.worst_axis
    assert found["mpc"].false_cues == metrics.false_cues
    assert found["mpc"].step_time_max == pytest.approx(2e-5)


def test_a_rung_takes_the_longest_step_and_the_mean_of_means():
    results = results_of(GAINS)
    slow = replace(
        results.maneuvers["late"]["mpc"],
        step_time_mean=4e-5,
        step_time_p99=5e-3,
        step_time_max=9e-3,
        vibration=7.0,
    )
    maneuvers = {**results.maneuvers, "late": {**results.maneuvers["late"], "mpc": slow}}
    rung = next(rung for rung in rungs(Results.of(maneuvers, [], ORIGIN)) if rung.policy == "mpc")
    assert (rung.step_time_mean, rung.step_time_p99, rung.step_time_max) == pytest.approx((3e-5, 5e-3, 9e-3))
    assert rung.vibration == 7.0


def test_the_ladder_is_written_and_drawn(tmp_path):
    results = results_of(GAINS)
    save_ladder(results, tmp_path)
    rows = list(csv.DictReader((tmp_path / "ladder.csv").open()))
    assert [row["policy"] for row in rows] == [name for name in LADDER if name in GAINS]
    assert float(rows[-1]["share"]) == 1.0
    lines = (tmp_path / "ladder.md").read_text().splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert lines[-1].startswith("| **optimum** |")
    image = ladder_figure(results)
    assert image is not None
    assert image.startswith(b"\x89PNG")
    page = render(results, {}, image)
    assert "The ladder, means over 2 drives" in page
    assert "(J of classical-tuned − J of\noptimum)" in page


def test_one_policy_makes_no_ladder():
    assert ladder_figure(results_of({"mpc": 0.9})) is None


def test_a_figure_of_a_maneuver_shows_the_share():
    drives = {name: drive(gain, policy=name) for name, gain in GAINS.items()}
    axes = new_figure(4.0, 3.0).subplots()
    _error(axes, drives, line_styles(list(drives)), Criteria())
    texts = [text.get_text() for text in axes.texts]
    assert texts[list(GAINS).index("classical-tuned")].endswith("(0.00)")
    assert texts[list(GAINS).index("optimum")].endswith("(1.00)")
    heights = sorted(text.xy[1] for text in axes.texts)
    assert min(np.diff(heights)) > 0.07


def test_what_is_left_out_stands_below_the_table_and_one_drive_is_no_drives(tmp_path):
    results = results_of(GAINS)
    alone = Results.of({"weave": results.maneuvers["weave"]}, [], ORIGIN, left_out={"nmpc": "needs a solver"})
    save_ladder(alone, tmp_path)
    text = (tmp_path / "ladder.md").read_text()
    assert text.endswith("|\n\nLeft out: nmpc: needs a solver\n")
    assert ladder_table(alone).title == "The ladder, means over 1 drive"


def test_bars_are_labeled_as_in_the_table():
    found = rungs(results_of(GAINS))
    small = [replace(r, standing=replace(r.standing, cue_error=3e-6)) for r in found[:1]] + found[1:]
    axes = new_figure(4.0, 3.0).subplots()
    _errors(axes, small)
    texts = [text.get_text() for text in axes.texts]
    assert texts[0] == f"◂ {number(3e-6)}" == "◂ 3.00e-06"
    assert texts[1] == number(small[1].standing.cue_error)
    assert axes.get_xlim()[0] >= 0.001


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
    assert maneuver_figure(drives, list(drives)).startswith(b"\x89PNG")
