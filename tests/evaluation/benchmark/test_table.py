"""The table of an evaluation: its policies, its rows, its files, and the normalized score in every table."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from motion_cueing.cli.arguments import find_platform, find_policies
from motion_cueing.envs.errors import UnknownNameError
from motion_cueing.evaluation.benchmark import (
    BENCHMARK_POLICIES,
    benchmark,
    benchmark_policies,
    benchmark_table,
    load_benchmark,
    save_benchmark,
)
from motion_cueing.evaluation.metrics import METRICS, Criteria, References
from motion_cueing.evaluation.policies import policy_names
from motion_cueing.evaluation.reporting.tables import maneuver_table, score_table, suite_table
from motion_cueing.evaluation.results import Failure, Results

from ..examples import GAINS, ORIGIN, results_of

BEFORE = Path(__file__).parents[1] / "before"


def test_the_score_of_the_suite_is_that_of_the_means():
    results = results_of(GAINS)
    average = {s.policy: s.cue_error for s in results.scores}
    washout, optimum = average["optimal-washout-tuned"], average["optimum"]
    expected = (washout - average["mpc"]) / (washout - optimum)
    score = next(s for s in results.scores if s.policy == "mpc")
    assert score.normalized_score == pytest.approx(expected)
    alone = {name: part["mpc"].cue_error for name, part in results.normalized_scores.items()}
    assert alone["weave"] != pytest.approx(alone["late"])


def test_a_reference_that_was_not_driven_or_failed_leaves_no_score():
    results = results_of({name: gain for name, gain in GAINS.items() if name != "optimum"})
    assert all(
        s.normalized_score is None and s.perceived_normalized_score is not None for s in results.scores
    )
    table = suite_table(results)
    assert table.rows[0][table.header.index("normalized score")] == "–"
    results = results_of({"no-motion": 0.0, "mpc": 0.9})
    assert "normalized score" not in suite_table(results).header
    assert "normalized score" not in benchmark_table(results).header
    assert score_table(results).rows == ()


def test_the_references_are_a_matter_of_configuration():
    criteria = Criteria(references=References(baseline="no-motion", optimum="mpc"))
    results = results_of(GAINS, criteria)
    scores = {s.policy: s.normalized_score for s in results.scores}
    assert (scores["no-motion"], scores["mpc"]) == (0.0, 1.0)
    assert results.criteria.references.optimum == "mpc"


def test_every_table_has_the_score():
    results = results_of(GAINS)
    for table in (
        maneuver_table("weave", results.maneuvers["weave"], results.normalized_scores["weave"]),
        suite_table(results),
        benchmark_table(results),
    ):
        column = table.header.index("normalized score")
        shown = {row[0]: row[column] for row in table.rows}
        assert (shown["optimal-washout-tuned"], shown["optimum"]) == ("0.00", "1.00")
        assert float(shown["no-motion"]) < 0.0 < float(shown["mpc"]) < 1.0
    assert score_table(results).header == ("maneuver", *results.policies)


def test_every_table_has_the_metrics_that_declare_it():
    results = results_of(GAINS)
    for kind, table in (
        ("drive", maneuver_table("weave", results.maneuvers["weave"])),
        ("benchmark", benchmark_table(results)),
    ):
        for one in METRICS.values():
            assert (one.title in table.header) == (kind in one.tables), one.name


def test_the_benchmark_goes_from_no_motion_to_the_optimum():
    assert BENCHMARK_POLICIES[0] == "no-motion"
    assert BENCHMARK_POLICIES[-1] == "optimum"
    assert len(set(BENCHMARK_POLICIES)) == len(BENCHMARK_POLICIES)
    assert benchmark_policies(["optimum", "mine", "classical", "no-motion"]) == [
        "no-motion",
        "classical",
        "optimum",
    ]


def test_benchmark_stands_for_its_policies_among_others():
    platform = find_platform("paper")
    assert list(find_policies(["benchmark", "brk", "classical"], platform)) == [
        *benchmark_policies(policy_names()),
        "brk",
    ]
    with pytest.raises(UnknownNameError, match="it is called 'benchmark' now"):
        find_policies(["ladder"], platform)


def test_a_row_is_over_the_drives_that_all_finished():
    results = results_of(GAINS)
    cut = {"weave": results.maneuvers["weave"], "late": {"mpc": results.maneuvers["late"]["mpc"]}}
    rows = benchmark(Results.of(cut, [Failure("late", "optimum", "tired")], ORIGIN)).set_index("policy")
    assert list(rows.index) == ["no-motion", "optimal-washout-tuned", "mpc", "optimum-perceived", "optimum"]
    metrics, row = results.maneuvers["weave"]["mpc"], rows.loc["mpc"]
    assert row["maneuvers"] == 1
    assert row["worst_axis"] == metrics.worst_axis
    assert row["worst_axis_part"] == metrics.axes[metrics.worst_axis].cue_error / metrics.cue_error
    assert row["false_cues"] == metrics.false_cues
    assert row["step_time_max"] == pytest.approx(2e-5)


def test_a_row_takes_the_longest_step_and_the_mean_of_means():
    results = results_of(GAINS)
    slow = replace(
        results.maneuvers["late"]["mpc"],
        step_time_mean=4e-5,
        step_time_p99=5e-3,
        step_time_max=9e-3,
        vibration=7.0,
    )
    maneuvers = {**results.maneuvers, "late": {**results.maneuvers["late"], "mpc": slow}}
    row = benchmark(Results.of(maneuvers, [], ORIGIN)).set_index("policy").loc["mpc"]
    times = [row[f"step_time_{name}"] for name in ("mean", "p99", "max")]
    assert times == pytest.approx([3e-5, 5e-3, 9e-3])
    assert row["vibration"] == 7.0


def test_the_benchmark_is_written_and_read(tmp_path):
    results = results_of(GAINS)
    save_benchmark(results, tmp_path)
    rows = list(csv.DictReader((tmp_path / "benchmark.csv").open()))
    assert [row["policy"] for row in rows] == [name for name in BENCHMARK_POLICIES if name in GAINS]
    assert float(rows[-1]["normalized_score"]) == 1.0
    assert float(rows[1]["cue_error"]) == next(
        s.cue_error for s in results.scores if s.policy == "optimal-washout-tuned"
    )
    pd.testing.assert_frame_equal(load_benchmark(tmp_path / "benchmark.csv"), benchmark(results))
    lines = (tmp_path / "benchmark.md").read_text().splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert lines[-1].startswith("| **optimum** |")


def test_the_ladder_of_the_version_before_is_read():
    rows = load_benchmark(BEFORE / "ladder.csv").set_index("policy")
    assert rows.loc["optimum", "normalized_score"] == 1.0
    with (BEFORE / "ladder.csv").open() as file:
        for row in csv.DictReader(file):
            assert rows.loc[row["policy"], "cue_error"] == float(row["cue_error"])
            assert rows.loc[row["policy"], "perceived_normalized_score"] == float(row["perceived_share"])


def test_skipped_policies_stand_below_the_table_and_one_drive_is_no_drives(tmp_path):
    results = results_of(GAINS)
    alone = Results.of({"weave": results.maneuvers["weave"]}, [], ORIGIN, skipped={"nmpc": "needs a solver"})
    save_benchmark(alone, tmp_path)
    text = (tmp_path / "benchmark.md").read_text()
    assert text.endswith("|\n\nSkipped: nmpc: needs a solver\n")
    assert benchmark_table(alone).title == "Benchmark, means over 1 drive"
