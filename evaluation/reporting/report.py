"""The report: one HTML page with everything. It embeds its figures and needs no network.

:func:`definitions` makes the tables of the page of metrics from their declarations in ``metrics.py``.
"""

from __future__ import annotations

import base64
import dataclasses
import inspect
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml
from jinja2 import Environment, StrictUndefined

from ...envs.settings import to_dict
from ...envs.storage import write_text
from ..benchmark.table import benchmark_table
from ..metrics import METRICS, ActuatorMetrics, AxisMetrics, Criteria, Metrics, References, declared
from ..results import Results
from .tables import (
    axis_table,
    feel_table,
    feel_tables,
    machine_table,
    maneuver_table,
    matrix_table,
    notes_table,
    score_table,
    suite_table,
)
from .text import NOTHING, TextTable, markdown

_DARKEST: Final = 0.35
"""Opacity of the best cell of a row."""


def render(results: Results, figures: Mapping[str, bytes], benchmark: bytes | None = None) -> str:
    """The page.

    Args:
        results: What to report.
        figures: PNG by maneuver, as far as there are any.
        benchmark: PNG of the benchmark.
    """
    source = files(__package__).joinpath("report.html").read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    configuration = {"criteria": to_dict(results.criteria), **results.provenance.configuration}
    return environment.from_string(source).render(
        results=results,
        definitions={name: METRICS[name].definition for name in ("cue_error", "perceived_cue_error")},
        suite=suite_table(results),
        benchmark=benchmark_table(results),
        benchmark_image=_embedded(benchmark),
        feel=feel_tables(results),
        matrix=matrix_table(results),
        scores=score_table(results),
        heat=_heat(results),
        parts=[_part(results, name, figures.get(name)) for name in results.maneuvers],
        configuration=yaml.safe_dump(configuration, sort_keys=False, allow_unicode=True),
    )


def save_report(
    results: Results, figures: Mapping[str, bytes], path: str | Path, benchmark: bytes | None = None
) -> None:
    """Write the page, whole or not at all."""
    write_text(path, render(results, figures, benchmark))


def _embedded(image: bytes | None) -> str | None:
    return base64.b64encode(image).decode("ascii") if image else None


def _part(results: Results, maneuver: str, figure: bytes | None) -> dict[str, Any]:
    drives = results.maneuvers[maneuver]
    return {
        "name": maneuver,
        "headline": maneuver_table(maneuver, drives, results.normalized_scores.get(maneuver)),
        "verdict": next(verdict for verdict in results.verdicts if verdict.maneuver == maneuver),
        "feel": feel_table(maneuver, drives),
        "axes": axis_table(maneuver, drives),
        "machine": machine_table(maneuver, drives),
        "notes": notes_table(maneuver, results.notes.get(maneuver, {})),
        "image": _embedded(figure),
    }


def _heat(results: Results) -> list[list[float | None]]:
    """Opacity of each cell of the matrix: best over own J, so that the best is darkest."""
    shades: list[list[float | None]] = []
    for drives in results.maneuvers.values():
        errors = {name: metrics.cue_error for name, metrics in drives.items()}
        best = min(errors.values())
        row = [errors.get(name) for name in results.policies]
        shades.append([None if j is None else round(_DARKEST * (best / j if j else 1.0), 3) for j in row])
    return shades


_BETTER: Final = {"lower": "Lower is better.", "higher": "Higher is better.", "one": "1 is the car.", "": ""}


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
