"""The ladder as a table for people, and as ``ladder.csv`` and ``ladder.md``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from .ladder import Rung, numbers_of, rungs
from .results import Results
from .share import Share
from .spreadsheet import save_rows
from .tables import SHARE_HEADER, has_shares, share_cells
from .text_table import NOTHING, TextTable, degrees, microseconds, number, percent, save_markdown
from .words import how_many

_BEFORE: Final = ("policy", "J", "perceived J")
_AFTER: Final = (
    "worst axis",
    "false cues %",
    "tilt rate peak deg/s",
    "tilt rate above 3 deg/s %",
    "vibration m/s²",
    "at a limit %",
    "step mean µs",
    "p99 µs",
    "max µs",
)


def ladder_table(results: Results) -> TextTable:
    """Every policy over the suite, in the order of the ladder; the best by J is stressed."""
    found = rungs(results)
    gaps = {rung.policy: Share(rung.standing.share, rung.standing.perceived_share) for rung in found}
    shown = has_shares(gaps.values())
    rows = [_row(rung, share_cells(gaps[rung.policy]) if shown else ()) for rung in found]
    best = min(range(len(found)), key=lambda i: found[i].standing.cue_error) if found else None
    count = found[0].standing.maneuvers if found else 0
    return TextTable(
        f"The ladder, means over {how_many(count, 'drive')}",
        (*_BEFORE, *(SHARE_HEADER if shown else ()), *_AFTER),
        tuple(rows),
        () if best is None else (best,),
    )


def _row(rung: Rung, shares: tuple[str, ...]) -> tuple[str, ...]:
    s, part = rung.standing, rung.worst_axis_part
    return (
        s.policy,
        number(s.cue_error),
        number(s.perceived_cue_error),
        *shares,
        NOTHING if part is None else f"{rung.worst_axis} ({part:.0%})",
        percent(rung.false_cues),
        degrees(rung.tilt_rate_peak),
        percent(rung.tilt_rate_share),
        number(rung.vibration),
        percent(rung.at_limit),
        microseconds(rung.step_time_mean),
        microseconds(rung.step_time_p99),
        microseconds(rung.step_time_max),
    )


def save_ladder(results: Results, folder: Path) -> None:
    """Write ``ladder.csv`` (SI units) and ``ladder.md`` (the table, and what was left out) into a folder."""
    save_rows([numbers_of(rung) for rung in rungs(results)], folder / "ladder.csv")
    left_out = [f"Left out: {policy}: {reason}" for policy, reason in results.left_out.items()]
    save_markdown(folder / "ladder.md", ladder_table(results), *left_out)
