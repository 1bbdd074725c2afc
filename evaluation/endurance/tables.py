"""The tables of an endurance."""

from __future__ import annotations

from typing import Final

from ...envs.simulator import TIME_STEP
from ..text_table import NOTHING, TextTable, number, percent
from .options import NOMINAL, SLOWER
from .results import EnduranceResults, EnduranceSummary, by_kind, summarised

_SHARES: Final = ("position", "rate", "acceleration")
_ERRORS: Final = ("J", "J slower", "J ratio", "perceived J", "perceived ratio", "at limit %", "slower %")


def tables(results: EnduranceResults) -> list[TextTable]:
    """Safety, errors, and errors by kind of road, of every policy with a drive."""
    return [_safety(results), _errors(results), _kinds(results)]


def _safety(results: EnduranceResults) -> TextTable:
    header = ("policy", "drives", "hours", "samples beyond a limit", "not finite", *_SHARES, "clearance")
    rows = []
    for name, found in results.summaries.items():
        extremes = list(results.policies[name].extremes.values())
        nearest = [max(getattr(one, what) for one in extremes) for what in _SHARES]
        least = min(one.clearance for one in extremes)
        cells = (f"{found.hours:.2f} × 2", f"{found.beyond}", f"{found.actions_not_finite}")
        shares = tuple(f"{share:.4f}" for share in (*nearest, least))
        rows.append((name, f"{found.drives}", *cells, *shares))
    return TextTable("Limits: samples beyond them, largest use (1 is the limit)", header, tuple(rows))


def _errors(results: EnduranceResults) -> TextTable:
    rows = [
        (name, *_error_cells(found), found.worst, number(found.worst_cue_error))
        for name, found in results.summaries.items()
    ]
    title = "Cue errors, on the machine as it should be and on slower ones"
    return TextTable(title, ("policy", *_ERRORS, "worst drive", "its J slower"), tuple(rows))


def _kinds(results: EnduranceResults) -> TextTable:
    rows = [
        (name, kind, f"{len(drives)}", *_error_cells(summarised(drives, TIME_STEP)))
        for name in results.summaries
        for kind, drives in by_kind(results.policies[name].drives).items()
    ]
    return TextTable("By kind of road", ("policy", "kind", "drives", *_ERRORS), tuple(sorted(rows)))


def _error_cells(found: EnduranceSummary) -> tuple[str, ...]:
    return (
        number(found.cue_error),
        number(found.slower_cue_error),
        _ratio(found.ratio),
        number(found.perceived_cue_error),
        _ratio(found.perceived_ratio),
        percent(found.at_limit[NOMINAL]),
        percent(found.at_limit[SLOWER]),
    )


def _ratio(value: float | None) -> str:
    return NOTHING if value is None else f"×{value:.2f}"
