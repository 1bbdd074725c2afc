"""``motion-cueing list``: every name a command accepts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ListCommand:
    """Show every name that a command accepts: policies, maneuvers, motion bases, cars and more."""


def run(command: ListCommand) -> int:
    """Print every name with one line about it."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

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
    from .. import baselines as policies
    from ..envs import car, maneuvers, platform
    from ..envs.telemetry import SOURCES
    from ..train import agents  # noqa: F401  (registers them)
    from ..train.registry import ALGORITHMS

    kinds = [
        ("Policies", policies.policy_names(), policies.describe_policy),
        ("Maneuvers", maneuvers.maneuver_names(None), maneuvers.describe_maneuver),
        ("Recorded drives", maneuvers.recording_names(), maneuvers.describe_recording),
        (
            "Motion bases",
            [*platform.platform_names(), *platform.ablation_names()],
            platform.describe_platform,
        ),
        ("Cars", car.car_names(), car.describe_car),
        ("Sources of telemetry", SOURCES.names(), SOURCES.description),
        ("Training algorithms", ALGORITHMS.names(), ALGORITHMS.description),
    ]
    return [(title, [(name, describe(name)) for name in names]) for title, names, describe in kinds]
