"""What went wrong in solves, as controllers count it in their notes: one line a policy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from rich.console import Console
from rich.markup import escape

from .words import how_many

_TROUBLES: Final = {
    "mpc_failures": "without a plan (the machine braked)",
    "mpc_relaxed": "with a limit relaxed",
    "mpc_unconverged": "unconverged",
    "optimum_unconverged": "unconverged",
    "optimum_braked": "without a plan (the machine braked)",
}
"""Counts that should be 0, and what they count."""
_WHOLES: Final = {"mpc": ("mpc_solves", "solve"), "optimum": ("optimum_windows", "window")}
"""By the first word of a count: the count it is a part of, and of what."""
_MOST: Final = 3
"""Drives that are named; the others are counted."""

Notes = Mapping[str, Mapping[str, str]]
"""What a policy counted, by drive."""


def trouble_lines(notes: Iterable[tuple[str, str, Mapping[str, str]]]) -> dict[str, str]:
    """What each policy counted that should not be, in words; policies with nothing of the kind are missing.

    Args:
        notes: Policy, drive and what the policy counted there.
    """
    drives: dict[str, dict[str, Mapping[str, str]]] = {}
    for policy, drive, counted in notes:
        drives.setdefault(policy, {})[drive] = counted
    told = {policy: _told(found) for policy, found in drives.items()}
    return {policy: line for policy, line in told.items() if line}


def _told(drives: Notes) -> str:
    return "; ".join(text for trouble in _TROUBLES if (text := _trouble(trouble, drives)))


def _trouble(trouble: str, drives: Notes) -> str:
    """One kind of trouble: how many of how many, and in which drives, most first."""
    whole, noun = _WHOLES[trouble.partition("_")[0]]
    found = {name: _number(counted, trouble) for name, counted in drives.items()}
    found = {name: count for name, count in found.items() if count > 0}
    if not found:
        return ""
    totals = {name: _number(counted, whole) for name, counted in drives.items()}
    order = sorted(found, key=lambda name: -found[name])
    named = ", ".join(f"{name} {found[name]} of {totals[name]}" for name in order[:_MOST])
    more = f", and {how_many(len(order) - _MOST, 'more drive')}" if len(order) > _MOST else ""
    total = how_many(sum(totals.values()), noun)
    return f"{sum(found.values())} of {total} {_TROUBLES[trouble]} ({named}{more})"


def _number(counted: Mapping[str, str], name: str) -> int:
    """A count; 0 where a policy of somebody else's notes something that is none."""
    text = counted.get(name, "0")
    return int(text) if text.isdecimal() else 0


def print_troubles(console: Console, notes: Iterable[tuple[str, str, Mapping[str, str]]]) -> None:
    """Show :func:`trouble_lines`."""
    for policy, line in trouble_lines(notes).items():
        console.print(f"[bold]counted[/bold] {escape(policy)}: {escape(line)}", highlight=False)
