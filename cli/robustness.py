"""``motion-cueing robustness``: controllers under what they were not made for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import FlagCreatePairsOff, arg

from ..evaluation.benchmark import BENCHMARK, benchmark_policies
from ..evaluation.reporting.text import words_of
from ..evaluation.selection import find_car, find_maneuvers, find_platform, find_policies
from .studies import prepare, run_and_save

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..evaluation.studies.disturbances import Study
    from ..evaluation.suite import CueSource

Name = Annotated[str, arg(metavar="NAME|FILE")]
Names = Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")]


@dataclass(frozen=True)
class RobustnessCommand:
    """Drive policies with slower actuators, dead time, noisy sensors, another car, and in fiercer drives.

    Each policy is made for the machine as it should be and knows nothing of the disturbance. Drives that are
    done are kept in the output folder and not driven again.
    """

    policies: Names = (BENCHMARK,)
    """Policies, by name or file; `benchmark` for every controller that is not told the drive beforehand."""
    maneuvers: Names = ()
    """Maneuvers and recordings, by name or cue CSV file; default: the standard maneuvers."""
    platform: Name = "paper"
    """Motion base, by name or YAML file."""
    car: Name = "sedan"
    """Car, by name or YAML file."""
    other_car: Name = "e-class-suv"
    """The other car, by name or YAML file."""
    lag: float = 30.0
    """Natural frequency of the actuators' lag, rad/s."""
    dead_time: float = 0.05
    """Dead time of the actuators, s."""
    force_noise: float = 0.05
    """Standard deviation of the noise on specific forces, m/s^2."""
    rate_noise: float = 0.3
    """Standard deviation of the noise on angular velocities, deg/s."""
    time_scaling: float = 2.0
    """Factor on all accelerations of the drives."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("robustness")
    """Folder for everything that is written; made if missing."""
    fresh: Annotated[bool, FlagCreatePairsOff] = False
    """Drive everything again."""


def run(command: RobustnessCommand) -> int:
    """Drive everything; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.studies.figures import heat_figure

    study = make_study(command)
    policies = find_policies(command.policies, study.platform)
    prepare(command.out, command.fresh)
    return run_and_save(
        study.conditions(),
        policies,
        command.out,
        words_of("robustness", command),
        "What happens to a controller?",
        True,
        heat_figure,
    )


def make_study(command: RobustnessCommand) -> Study:
    """Everything but the policies, all names resolved.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..envs.maneuvers import maneuver_names
    from ..evaluation.policies import policy_names
    from ..evaluation.studies.disturbances import Disturbances, SensorNoise, Study

    names = command.maneuvers or tuple(maneuver_names())

    def maneuvers(driven: Car) -> Mapping[str, CueSource]:
        return find_maneuvers(names, driven)

    compared = benchmark_policies(policy_names()) if BENCHMARK in command.policies else []
    return Study(
        platform=find_platform(command.platform),
        car=find_car(command.car),
        other=find_car(command.other_car),
        maneuvers=maneuvers,
        causal=frozenset(compared) - set(command.policies),
        disturbances=Disturbances(
            lag=command.lag,
            dead_time=command.dead_time,
            noise=SensorNoise(force=command.force_noise, rate=math.radians(command.rate_noise)),
            time_scaling=command.time_scaling,
        ),
    )
