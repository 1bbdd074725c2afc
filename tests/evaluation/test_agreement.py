"""Rank correlations with J, against orders made by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from motion_cueing.evaluation.agreement import agreement, compared_metrics
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.reporting.tables import feel_tables

from .examples import results_of
from .synthetic import drive

GOOD, FAIR, POOR = (replace(measure(drive()), cue_error=error) for error in (1.0, 2.0, 3.0))


def row(maneuvers, metric, reading="value"):
    frame = agreement(maneuvers)
    return frame[(frame.metric == metric) & (frame.reading == reading)].iloc[0]


def with_values(metric, *drives):
    """Drives in which good, fair and poor policies have these values of a metric."""
    return {
        f"drive {i}": {
            name: replace(one, **{metric: value})
            for name, one, value in zip("abc", (GOOD, FAIR, POOR), values, strict=True)
        }
        for i, values in enumerate(drives)
    }


def test_correlations_are_means_over_drives():
    found = row(with_values("worst_second", (1.0, 2.0, 3.0), (2.0, 1.0, 3.0)), "worst_second")
    # By hand: rho 1 and 1 - 6 * 2 / (3 * 8) = 0.5; tau 1 and (2 - 1) / 3.
    assert found.spearman == pytest.approx(0.75)
    assert found.kendall == pytest.approx(2.0 / 3.0)
    assert (found.lowest, found.lowest_on, found.drives) == (pytest.approx(0.5), "drive 1", 2)
    # Means over the drives: 1.5, 1.5 and 3, two of them tied.
    assert found.spearman_overall == pytest.approx(3.0**0.5 / 2.0)


def test_a_ratio_is_read_as_a_dose_and_as_a_distance():
    drives = with_values("motion_dose_ratio", (1.02, 0.9, 0.5))
    assert row(drives, "motion_dose_ratio").spearman == pytest.approx(-1.0)
    assert row(drives, "motion_dose_ratio", "distance from 1").spearman == pytest.approx(1.0)


@pytest.mark.parametrize("values", [(1.0, 1.0, 1.0), (1.0, None, 2.0)])
def test_without_an_order_there_is_no_correlation(values):
    found = row(with_values("jerk_max", values, (1.0, 2.0, 3.0)), "jerk_max")
    assert (found.drives, found.spearman) == (1, pytest.approx(1.0))


def test_tables_show_each_metric_where_there_are_enough_policies():
    feel, ranks = feel_tables(results_of({"a": 0.9, "b": 0.5, "c": 0.1}))
    assert [cells[0] for cells in feel.rows] == ["a", "b", "c"]
    names = {cells[0] for cells in ranks.rows}
    assert {one.header for one in compared_metrics().values()} <= names
    assert len(feel_tables(results_of({"a": 0.9, "b": 0.5}))) == 1
    assert feel_tables(results_of({})) == []
