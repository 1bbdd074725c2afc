"""Two results side by side, their page and their figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.evaluation.benchmark import BenchmarkResults, PolicyResult, RunResult, SplitResult, compare
from motion_cueing.evaluation.benchmark.compare import comparison_table
from motion_cueing.evaluation.benchmark.figures import PER_PANEL, groups_of, interval_figure, profile_figure
from motion_cueing.evaluation.benchmark.page import main_table, notes, page, paired_table, seeds_table
from motion_cueing.evaluation.metrics import METRICS, References

RANDOM = np.random.default_rng(1)
HARD = RANDOM.lognormal(size=30)
"""How hard each of 30 drives is."""
OTHER = {name: 1e-4 if name.startswith("step_time") else 0.0 for name in METRICS}


def split_of(name: str = "small", hashed: str = "ab" * 32) -> SplitResult:
    return SplitResult(
        name, 1, "drives", hashed, {f"{k}": (100.0, k, k, k, k, k, k) for k in range(len(HARD))}
    )


def run_of(factor: float, drives: int = len(HARD), split: str = "small") -> RunResult:
    values = {
        f"{k}": {**OTHER, "cue_error": factor * HARD[k], "perceived_cue_error": 2.0 * factor * HARD[k]}
        for k in range(drives)
    }
    return RunResult("made-up", {split: values}, {split: {}}, {split: {}})


def results_of(factors, splits=None, **more) -> BenchmarkResults:
    policies = {
        name: PolicyResult("now", tuple(run_of(one) for one in np.atleast_1d(factor)))
        for name, factor in factors.items()
    }
    references = References(baseline="washout", optimum="optimum")
    return BenchmarkResults.of(
        ["test"], splits or [split_of()], {"paper": policies}, {"paper": {}}, references=references, **more
    )


FACTORS = {"washout": 1.0, "mine": 0.5, "optimum": 0.1}


def test_summaries_are_those_of_the_drives():
    mine = results_of(FACTORS).of_split("paper", "small")["mine"]
    assert mine.mean.value == pytest.approx(0.5 * HARD.mean())
    assert mine.median.value == pytest.approx(0.5 * np.median(HARD))
    assert mine.worst_tenth.value == pytest.approx(0.5 * np.sort(HARD)[-3:].mean())
    assert mine.difference.value == pytest.approx(-0.5 * HARD.mean())
    assert mine.difference.high < 0.0
    assert mine.improvement.value == 1.0
    assert mine.normalized_score == pytest.approx(0.5 / 0.9)
    assert (mine.step_time_mean, mine.step_time_p99) == pytest.approx((1e-4, 1e-4))
    washout = results_of(FACTORS).of_split("paper", "small")["washout"]
    assert washout.difference is None
    assert washout.normalized_score == 0.0


def test_a_comparison_has_the_sign_of_the_change():
    found = compare(results_of(FACTORS), results_of({**FACTORS, "mine": 0.4, "new": 1.0}))
    rows = {row.policy: row for row in found.rows}
    assert rows["mine"].change.high < 0.0
    assert rows["mine"].change.value == pytest.approx(-0.1 * HARD.mean())
    assert (rows["washout"].change.low, rows["washout"].change.high) == (0.0, 0.0)
    assert (found.only_first, found.only_second, found.refused) == ([], ["paper, new"], {})
    assert [row[0] for row in comparison_table(found).rows] == ["washout", "mine", "optimum"]


def test_other_drives_are_not_compared():
    first = results_of(FACTORS)
    with pytest.raises(DataError, match="not of the same drives: small: version 1, hash abab"):
        compare(first, results_of(FACTORS, [split_of(hashed="cd" * 32)]))
    other = split_of()
    other.drives["3"] = (100.0, 3.1, 3, 3, 3, 3, 3)
    with pytest.raises(DataError, match="the cues of 1 drives differ, as of 3"):
        compare(first, results_of(FACTORS, [other]))
    both = results_of(FACTORS, [split_of(), split_of("other")])
    found = compare(both, first)
    assert list(found.refused) == ["other"]
    assert len(found.rows) == 3


def test_the_page_has_every_policy_with_its_interval_and_the_hash():
    results = results_of({**FACTORS, "seeds": [0.3, 0.4, 0.5]})
    text = page(results, {"intervals-paper": "benchmark-intervals-paper.png"})
    assert split_of().hash[:12] in text
    assert "](benchmark-intervals-paper.png)" in text
    table = main_table(results, "paper", "small")
    assert [row[0] for row in table.rows] == ["washout", "mine", "optimum", "seeds"]
    assert " to " in table.rows[1][table.header.index("J")]
    assert table.best == (2,)
    assert [row[0] for row in paired_table(results, "paper", "small").rows] == ["mine", "optimum", "seeds"]
    (row,) = seeds_table(results, "paper").rows
    mean = HARD.mean()
    assert [float(cell) for cell in row[3:]] == pytest.approx(
        [0.4 * mean, 0.3 * mean, 0.5 * mean, 0.1 * mean], rel=0.02
    )


def test_what_is_missing_stands_in_the_notes():
    results = results_of(FACTORS, finished=False)
    policies = results.platforms["paper"]
    run = policies["mine"].runs[0]
    failed = replace(
        run,
        failures={"small": {"x": "no fuel"}},
        notes={"small": {"3": {"mpc_failures": "2", "mpc_solves": "9"}}},
    )
    policies["mine"] = replace(policies["mine"], runs=(failed,))
    results.skipped["paper"]["agent"] = "of another machine"
    text = "\n".join(notes(results))
    assert "Interrupted" in text
    assert "agent: of another machine" in text
    assert "mine, small, x: no fuel" in text
    assert "2 of 9 solves without a plan" in text


def test_figures_hold_few_policies_a_panel_and_show_each_of_them():
    many = results_of(
        {"washout": 1.0, **{f"p{k}": 0.9**k for k in range(8)}}, [split_of(), split_of("empty")]
    )
    many.platforms["paper"]["seer"] = PolicyResult("2 s true", (run_of(0.05),))
    groups = groups_of(many, "paper")
    assert [known for known, _ in groups] == ["now", "now", "2 s true"]
    assert max(len(names) for _, names in groups) <= PER_PANEL
    figure = interval_figure(many, "paper")
    shown = [label.get_text() for axes in figure.axes[::2] for label in axes.get_yticklabels()]
    assert sorted(shown) == sorted(many.platforms["paper"])
    figure = profile_figure(many, "paper")
    assert len(figure.axes) == 6
    line = figure.axes[0].get_lines()[0]
    share = np.interp(0.0, np.log10(line.get_xdata()), line.get_ydata())
    first = groups[0][1][0]
    values = np.array(
        [v["cue_error"] for v in many.platforms["paper"][first].runs[0].drives["small"].values()]
    )
    assert share == pytest.approx(np.mean(values <= 1.0), abs=0.05)
