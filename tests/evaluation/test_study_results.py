"""study.json and study.csv: metrics as they declare, and the file of the version before."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.evaluation.benchmark.table import OLD_COLUMNS
from motion_cueing.evaluation.metrics import METRICS, measure
from motion_cueing.evaluation.studies.figures import heat_figure, lines_figure
from motion_cueing.evaluation.studies.results import StudyResults, condition_table, summarize

from .synthetic import drive

BEFORE = Path(__file__).parent / "before" / "study-1.json"


def test_a_study_of_the_version_before_is_read(tmp_path):
    old, results = json.loads(BEFORE.read_text()), StudyResults.load_json(BEFORE)
    results.save_csv(tmp_path / "study.csv")
    rows = {(r["condition"], r["policy"]): r for r in csv.DictReader((tmp_path / "study.csv").open())}
    for condition, policies in old["summaries"].items():
        for policy, numbers in policies.items():
            for name, value in numbers.items():
                text = rows[condition, policy][OLD_COLUMNS.get(name, name)]
                assert (None if text == "" else float(text)) == value
    results.save_json(tmp_path / "study.json")
    assert StudyResults.load_json(tmp_path / "study.json") == results


def test_a_condition_has_the_metrics_that_declare_it():
    table = condition_table(StudyResults.load_json(BEFORE), "24-inch")
    assert [row[0] for row in table.rows] == ["optimum", "classical-tuned", "no-motion", "classical"]
    for one in METRICS.values():
        assert (one.title in table.header) == ("study" in one.tables), one.name


def test_drives_combine_as_each_metric_declares():
    drives = {"weave": measure(drive(0.9)), "late": measure(drive(0.5, 0.4))}
    slow = {name: measure(drive(0.3)) for name in drives}
    summaries = summarize({"fast": {"mine": drives}, "slow": {"mine": slow, "gone": {}}})
    fast = summaries["fast"]["mine"]
    assert fast.cue_error == pytest.approx(sum(one.cue_error for one in drives.values()) / 2)
    assert fast.metrics["tilt_rate_peak"] == max(one.tilt_rate_peak for one in drives.values())
    assert fast.most_limited == max(one.at_limit for one in drives.values())
    assert fast.ratio == 1.0
    assert summaries["slow"]["mine"].ratio == pytest.approx(
        summaries["slow"]["mine"].cue_error / fast.cue_error
    )
    assert list(summaries["slow"]) == ["mine"]


def test_lines_show_the_numbers_of_every_policy_and_condition():
    results = StudyResults.load_json(BEFORE)
    names = ("cue_error", "normalized_score", "perceived_cue_error")
    panels = lines_figure(results).axes
    for axes, name, least in zip(panels, names, (0.01, -1.0, 0.01), strict=False):
        lines = {line.get_label(): line.get_ydata() for line in axes.lines}
        for policy in results.policies:
            values = [results.summaries[condition][policy].row[name] for condition in results.conditions]
            np.testing.assert_array_equal(lines[policy], np.maximum(values, least))


def test_cells_show_j_and_its_ratio():
    results = StudyResults.load_json(BEFORE)
    axes = heat_figure(results).axes[0]
    (image,) = axes.images
    ratios = [[results.summaries[c][p].ratio for c in results.conditions] for p in results.policies]
    np.testing.assert_array_equal(image.get_array(), ratios)
    texts = [text.get_text() for text in axes.texts]
    assert texts[:2] == ["1.71\nlimits 0.0%", "1.71\n×1.00, limits 0.0%"]
    assert len(texts) == np.size(ratios)
