"""``motion-cueing compare``: how much machine does a controller need?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import FlagCreatePairsOff, arg

from ..envs.errors import ConfigurationError
from ..evaluation.benchmark import BENCHMARK
from ..evaluation.reporting.text import words_of
from ..evaluation.selection import ALL, find_car, find_maneuvers, find_platform, find_policies
from .studies import prepare, run_and_save

if TYPE_CHECKING:
    from ..envs.platform import Platform

Name = Annotated[str, arg(metavar="NAME|FILE")]
Names = Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")]


@dataclass(frozen=True)
class CompareCommand:
    """Drive maneuvers on several machines with several policies: how much machine does a controller need?

    Drives that are done are kept in the output folder and not driven again.
    """

    platforms: Names = (ALL,)
    """Motion bases, by name or YAML file; `all` for every whole one."""
    policies: Names = (BENCHMARK,)
    """Policies, by name or file; `benchmark` for every controller."""
    maneuvers: Names = (ALL,)
    """Maneuvers and recordings, by name or cue CSV file; `all` for every one of them."""
    ablations: Annotated[bool, FlagCreatePairsOff] = False
    """Also each machine without its turntable, without its carriage, and with its hexapod alone."""
    car: Name = "sedan"
    """Car, by name or YAML file."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("comparison")
    """Folder for everything that is written; made if missing."""
    fresh: Annotated[bool, FlagCreatePairsOff] = False
    """Drive everything again."""


def run(command: CompareCommand) -> int:
    """Compare; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.policies import make_policy
    from ..evaluation.studies.figures import lines_figure
    from ..evaluation.studies.study import Condition

    machines = find_machines(command)
    car = find_car(command.car)
    maneuvers = find_maneuvers(command.maneuvers, car)
    policies = find_policies(command.policies, next(iter(machines.values())))
    prepare(command.out, command.fresh)
    conditions = [
        Condition(
            name,
            machine.description,
            machine,
            car,
            maneuvers,
            partial(make_policy, platform=machine, force=True),
        )
        for name, machine in machines.items()
    ]
    return run_and_save(
        conditions,
        policies,
        command.out,
        words_of("compare", command),
        "How much machine does a controller need?",
        False,
        lines_figure,
    )


def find_machines(command: CompareCommand) -> dict[str, Platform]:
    """The machines of a command by label, each followed by its ablations if they are asked for.

    Raises:
        MotionCueingError: there is no such machine, or two have one name.
    """
    from ..envs.platform import ablations, platform_names

    named = [name for given in command.platforms for name in (platform_names() if given == ALL else [given])]
    found: dict[str, Platform] = {}
    for name in dict.fromkeys(named):
        machine = find_platform(name)
        for one in [machine, *(ablations(machine) if command.ablations else ())]:
            if found.setdefault(one.name, one) != one:
                raise ConfigurationError(
                    f"two motion bases have the name {one.name!r}; rename one in its file"
                )
    return found
