"""``motion-cueing compare``: how much machine does a controller need?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from .arguments import (
    ALL,
    BENCHMARK,
    CarName,
    Fresh,
    ManeuverNames,
    Names,
    OutFolder,
    PolicyNames,
    find_car,
    find_maneuvers,
    find_platforms,
    find_policies,
)


@dataclass(frozen=True, kw_only=True)
class CompareCommand:
    """Drive maneuvers on several machines with several policies: how much machine does a controller need?

    Drives that are done are kept in the output folder and not driven again.
    """

    platforms: Names = (ALL,)
    """Motion bases, by name or YAML file; `all` for every whole one."""
    policies: PolicyNames = (BENCHMARK,)
    maneuvers: ManeuverNames = (ALL,)
    ablations: bool = False
    """Also each machine without its turntable, without its carriage, and with its hexapod alone."""
    car: CarName = "sedan"
    out: OutFolder = Path("comparison")
    fresh: Fresh = False


def run(command: CompareCommand) -> int:
    """Compare; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.policies import make_policy
    from ..evaluation.reporting.text import words_of
    from ..evaluation.studies.figures import lines_figure
    from ..evaluation.studies.study import Condition
    from .studies import prepare, run_and_save

    machines = find_platforms(command.platforms, command.ablations)
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
