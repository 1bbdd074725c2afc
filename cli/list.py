"""``motion-cueing list``: every name a command accepts."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table


@dataclass(frozen=True, kw_only=True)
class ListCommand:
    """Show every name that a command accepts: policies, maneuvers, motion bases and cars."""


def run(command: ListCommand) -> int:
    """Print every name with one line about it."""
    console = Console()
    for title, rows in catalogue():
        table = Table(title=title, title_justify="left", title_style="bold", box=None, show_header=False)
        table.add_column(no_wrap=True, style="cyan")
        table.add_column()
        for name, line in rows:
            table.add_row(escape(name), escape(line))
        console.print(table)
        console.print()
    return 0


def catalogue() -> list[tuple[str, list[tuple[str, str]]]]:
    """Titles, each with names and one line about each."""
    from ..envs.car import car_names, get_car
    from ..envs.maneuvers import get_maneuver, get_recording, maneuver_names, recording_names
    from ..envs.platform import ablation_names, get_platform, platform_names
    from ..train.agents import describe_policy, policy_names

    return [
        ("Policies", [(name, describe_policy(name)) for name in policy_names()]),
        ("Maneuvers", _lines(maneuver_names(), get_maneuver)),
        ("Recorded drives", [(name, get_recording(name).source) for name in recording_names()]),
        ("Motion bases", _lines([*platform_names(), *ablation_names()], get_platform)),
        ("Cars", _lines(car_names(), get_car)),
    ]


def _lines(names: Iterable[str], get: Callable[[str], Any]) -> list[tuple[str, str]]:
    return [(name, one_line(get(name))) for name in names]


def one_line(thing: Any) -> str:
    """The ``description`` of a configuration, or the first line of its class's docstring."""
    described = getattr(thing, "description", "") or inspect.getdoc(type(thing)) or ""
    return str(described).strip().split("\n", maxsplit=1)[0]
