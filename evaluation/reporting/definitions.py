"""The tables of the page of metrics, from the declarations in ``evaluation/metrics.py``.

``python -m motion_cueing.evaluation.reporting.definitions`` prints them as Markdown.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any, Final

import numpy as np

from ..metrics import ActuatorMetrics, AxisMetrics, Criteria, Metrics, References, declared
from .text import NOTHING, TextTable, markdown

_BETTER: Final = {"lower": "Lower is better.", "higher": "Higher is better.", "": ""}


def definitions() -> dict[str, str]:
    """Tables in Markdown: the metrics of a drive, of an axis and of an actuator, and the thresholds."""
    return {
        "metrics-drive": _metrics(Metrics),
        "metrics-axis": _metrics(AxisMetrics),
        "metrics-actuator": _metrics(ActuatorMetrics),
        "criteria": _thresholds(),
    }


def _metrics(cls: type[Any]) -> str:
    rows = [
        (
            f"`{one.name}`",
            one.title if one.header else NOTHING,
            " ".join(filter(None, (one.definition, _BETTER[one.better], one.source))),
            one.unit,
            one.over_drives.__name__,
        )
        for one in declared(cls)
    ]
    header = ("metric", "in tables", "definition", "SI unit", "over drives")
    return markdown(TextTable("", header, tuple(rows))) + "\n"


def _thresholds() -> str:
    arguments = (inspect.getdoc(Criteria) or "").partition("Args:\n")[2]
    meanings = dict(re.findall(r"^    (\w+): ((?:.|\n {8})+)", arguments, flags=re.MULTILINE))
    criteria = Criteria()
    rows = []
    for field in dataclasses.fields(Criteria):
        value = getattr(criteria, field.name)
        values = (
            dataclasses.astuple(value) if isinstance(value, References) else np.atleast_1d(value).tolist()
        )
        shown = [f"`{one}`" if isinstance(one, str) else f"{one:.4g}" for one in values]
        rows.append((f"`{field.name}`", ", ".join(shown), " ".join(meanings[field.name].split())))
    return markdown(TextTable("", ("field", "default", "meaning"), tuple(rows))) + "\n"


if __name__ == "__main__":
    print("\n".join(f"**{name}**\n\n{table}" for name, table in definitions().items()))
