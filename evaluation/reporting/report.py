"""The report: one HTML page with everything. It draws its plots in the browser and needs no network.

The page's template, styles and script are in ``page``; the drives in it are packed by ``packing.py``.

:func:`definitions` makes the tables of the page of metrics from their declarations in ``metrics.py``.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import yaml

from ...envs.settings import to_dict
from ...envs.storage import write_text
from ..benchmark.table import benchmark_table
from ..metrics import METRICS, ActuatorMetrics, AxisMetrics, Criteria, Metrics, References, declared, mean
from ..results import Results
from .html import assets, script_json, template
from .packing import MISSING, PackedDrive
from .signals import PANELS, PHASES, in_order, looks, shown_at_first
from .summary import chart, sentences, summarize
from .tables import (
    axis_table,
    feel_table,
    feel_tables,
    machine_table,
    maneuver_table,
    matrix_table,
    notes_table,
    score_table,
)
from .text import NOTHING, TextTable, fraction, markdown, microseconds, number

_PLOTTING: Final = ("page/uPlot.iife.min.js", "page/unpack.js")
_DARKEST: Final = 0.35
"""Opacity of the best cell of a row."""


def render(results: Results, drives: Mapping[str, PackedDrive] = MappingProxyType({}), view: str = "") -> str:
    """The page.

    Args:
        results: What to report.
        drives: Drives to plot, by maneuver, as far as there are any.
        view: Name of the page with the machine beside the report, to which each drive links; "" for none.
    """
    configuration = {"criteria": to_dict(results.criteria), **results.provenance.configuration}
    packed = {name: drives[name] for name in results.maneuvers if name in drives}
    summaries = summarize(results)
    return template("page/report.html").render(
        results=results,
        view=view,
        definitions={name: METRICS[name].definition for name in ("cue_error", "perceived_cue_error")},
        summaries=summaries,
        sentences=sentences(summaries, max((s.maneuvers for s in results.scores), default=0)),
        sure=any(summary.error.low is not None for summary in summaries),
        scored=any(score.normalized_score is not None for score in results.scores),
        chart=chart(summaries),
        benchmark=benchmark_table(results),
        feel=feel_tables(results),
        matrix=matrix_table(results),
        scores=score_table(results),
        heat=_heat(results),
        parts=[_part(results, name, packed.get(name)) for name in results.maneuvers],
        configuration=yaml.safe_dump(configuration, sort_keys=False, allow_unicode=True),
        number=number,
        fraction=fraction,
        microseconds=microseconds,
        styles=assets("page/uPlot.min.css", "page/report.css"),
        scripts=assets(*(_PLOTTING if packed else ()), "page/report.js"),
        about=script_json(_about(results, packed)),
        packed=[script_json(drive.content) for drive in packed.values()],
    )


def save_report(
    results: Results,
    path: str | Path,
    drives: Mapping[str, PackedDrive] = MappingProxyType({}),
    view: str = "",
) -> None:
    """Write the page, whole or not at all."""
    write_text(path, render(results, drives, view))


def _about(results: Results, packed: Mapping[str, PackedDrive]) -> dict[str, Any]:
    """What the script of the page must know: names, looks and panels."""
    order = in_order(_mean_errors(results), results.criteria)
    return {
        "drives": list(packed),
        "policies": order,
        "shown": shown_at_first(order),
        "styles": {name: {"color": color, "dash": dash} for name, (color, dash) in looks(order).items()},
        "panels": [
            {
                "name": panel.name,
                "group": panel.group,
                "title": panel.title,
                "unit": panel.unit,
                "least": panel.least,
                "from_zero": panel.from_zero,
                "logarithmic": panel.logarithmic,
                "levels": panel.levels,
            }
            for panel in PANELS
        ],
        "phases": [
            {"title": title, "cue": cue, "tilt": tilt, "sign": sign} for title, cue, tilt, sign in PHASES
        ],
        "missing": MISSING,
    }


def _mean_errors(results: Results) -> dict[str, float]:
    """Mean J of each policy over the drives that it finished."""
    errors: dict[str, list[float]] = {}
    for drives in results.maneuvers.values():
        for name, metrics in drives.items():
            errors.setdefault(name, []).append(metrics.cue_error)
    return {name: mean(values) for name, values in errors.items()}


def _part(results: Results, maneuver: str, packed: PackedDrive | None) -> dict[str, Any]:
    drives = results.maneuvers[maneuver]
    policies = packed.about["policies"] if packed else {}
    return {
        "name": maneuver,
        "headline": maneuver_table(maneuver, drives, results.normalized_scores.get(maneuver)),
        "worst": {name: policy["worst"] for name, policy in policies.items()},
        "verdict": next(verdict for verdict in results.verdicts if verdict.maneuver == maneuver),
        "feel": feel_table(maneuver, drives),
        "axes": axis_table(maneuver, drives),
        "machine": machine_table(maneuver, drives),
        "notes": notes_table(maneuver, results.notes.get(maneuver, {})),
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
