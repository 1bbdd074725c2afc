"""The ladder of controllers, from no motion to the optimum, and how each stands over the whole suite."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from .comparison import Share, Standing, common_drives
from .metrics import CUE_AXES, Metrics
from .reporting.tables import SHARE_HEADER, has_shares, share_cells
from .reporting.text import (
    NOTHING,
    TextTable,
    degrees,
    how_many,
    microseconds,
    number,
    percent,
    save_markdown,
)
from .results import Results, save_rows

LADDER: Final = (
    "no-motion",
    "classical",
    "classical-tuned",
    "classical-per-maneuver",
    "optimal-washout",
    "optimal-washout-tuned",
    "adaptive",
    "adaptive-tuned",
    "mpc",
    "nmpc",
    "learned-perceived",
    "learned",
    "mpc-preview",
    "nmpc-preview",
    "mpc-full",
    "learned-ppo",
    "learned-any",
    "learned-preview",
    "optimum-perceived",
    "optimum",
)
"""Policies in order: washouts, controllers that see what is now, those that see ahead, and the optimum."""

ALL_RUNGS: Final = "ladder"
"""Stands for the policies of the ladder where names of policies are given."""


def ladder_names(known: Iterable[str]) -> list[str]:
    """The policies of the ladder that there are, in its order."""
    names = set(known)
    return [name for name in LADDER if name in names]


@dataclass(frozen=True)
class Rung:
    """One policy over the drives that every policy finished.

    Args:
        standing: Means of J, and shares of the gap.
        worst_axis: The axis with the largest mean part of J.
        worst_axis_part: That part, as a share of the mean J; None where J is 0.
        false_cues: Mean share of time with a false cue.
        tilt_rate_peak: Largest of all drives, rad/s.
        tilt_rate_share: Mean share of time above the tilt-coordination limit.
        vibration: Largest of all drives, m/s^2; None where not measured.
        at_limit: Mean share of time with any actuator at any limit.
        step_time_mean: Mean of the drives' means, s; None where not measured.
        step_time_p99: Largest 99th percentile of a drive, s.
        step_time_max: Longest step of all drives, s.
    """

    standing: Standing
    worst_axis: str
    worst_axis_part: float | None
    false_cues: float
    tilt_rate_peak: float
    tilt_rate_share: float
    vibration: float | None
    at_limit: float
    step_time_mean: float | None
    step_time_p99: float | None
    step_time_max: float | None

    @property
    def policy(self) -> str:
        """Name of the policy."""
        return self.standing.policy


def rungs(results: Results) -> list[Rung]:
    """The policies that have a standing: those of the ladder in its order, then the others, best first."""
    common = common_drives(results.maneuvers)
    found = {s.policy: _rung(s, [drives[s.policy] for drives in common.values()]) for s in results.standings}
    ordered = ladder_names(found)
    return [found[name] for name in [*ordered, *(name for name in found if name not in ordered)]]


def _rung(standing: Standing, drives: list[Metrics]) -> Rung:
    parts = {axis: _mean([m.axes[axis].cue_error for m in drives]) for axis in CUE_AXES}
    worst = max(parts, key=parts.__getitem__)
    return Rung(
        standing=standing,
        worst_axis=worst,
        worst_axis_part=parts[worst] / standing.cue_error if standing.cue_error > 0.0 else None,
        false_cues=_mean([m.false_cues for m in drives]),
        tilt_rate_peak=max(m.tilt_rate_peak for m in drives),
        tilt_rate_share=_mean([m.tilt_rate_share for m in drives]),
        vibration=_measured(max, [m.vibration for m in drives]),
        at_limit=_mean([m.at_limit for m in drives]),
        step_time_mean=_measured(_mean, [m.step_time_mean for m in drives]),
        step_time_p99=_measured(max, [m.step_time_p99 for m in drives]),
        step_time_max=_measured(max, [m.step_time_max for m in drives]),
    )


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _measured(of: Callable[[list[float]], float], values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return of(known) if known else None


def numbers_of(rung: Rung) -> Mapping[str, float | str | None]:
    """A row of ``ladder.csv``, in SI units."""
    s = rung.standing
    return {
        "policy": rung.policy,
        "maneuvers": s.maneuvers,
        "cue_error": s.cue_error,
        "perceived_cue_error": s.perceived_cue_error,
        "share": s.share,
        "perceived_share": s.perceived_share,
        "worst_axis": rung.worst_axis,
        "worst_axis_part": rung.worst_axis_part,
        "false_cues": rung.false_cues,
        "tilt_rate_peak": rung.tilt_rate_peak,
        "tilt_rate_share": rung.tilt_rate_share,
        "vibration": rung.vibration,
        "at_limit": rung.at_limit,
        "step_time_mean": rung.step_time_mean,
        "step_time_p99": rung.step_time_p99,
        "step_time_max": rung.step_time_max,
    }


# The ladder as a table for people, and as ``ladder.csv`` and ``ladder.md``.


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
