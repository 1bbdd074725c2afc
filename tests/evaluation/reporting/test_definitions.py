"""The tables of the page of metrics hold every declared metric and threshold."""

from __future__ import annotations

from dataclasses import fields

import pytest

from motion_cueing.evaluation.metrics import ActuatorMetrics, AxisMetrics, Criteria, Metrics, declared
from motion_cueing.evaluation.reporting.report import definitions


def cells(table):
    """Rows of a table in Markdown by their first cell."""
    rows = [line.replace("\\|", "¦").strip("| ").split(" | ") for line in table.splitlines()[2:]]
    return {row[0].strip("`"): [cell.replace("¦", "|") for cell in row[1:]] for row in rows}


@pytest.mark.parametrize(
    ("name", "cls"),
    [("metrics-drive", Metrics), ("metrics-axis", AxisMetrics), ("metrics-actuator", ActuatorMetrics)],
)
def test_every_metric_is_in_its_table_with_its_definition(name, cls):
    rows = cells(definitions()[name])
    assert list(rows) == [one.name for one in declared(cls)]
    for one in declared(cls):
        title, definition, unit, _ = rows[one.name]
        assert definition.startswith(one.definition)
        assert unit == one.unit
        assert title == (one.title if one.header else "–")
        assert f"{one.name}: {one.definition}" in cls.__doc__


def test_every_threshold_has_its_default_and_meaning():
    rows = cells(definitions()["criteria"])
    assert list(rows) == [field.name for field in fields(Criteria)]
    assert rows["indifference_force"][0] == "0.6"
    assert rows["force_threshold"][0] == "0.17, 0.17, 0.28"
    assert rows["references"][0] == "`optimal-washout-tuned`, `optimum`, `optimum-perceived`"
    assert all(meaning for _, meaning in rows.values())
