"""``motion-cueing robustness``: controllers under what they were not made for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .arguments import (
    BENCHMARK,
    CarName,
    Fresh,
    ManeuverNames,
    Name,
    OutFolder,
    PlatformName,
    PolicyNames,
    find_car,
    find_maneuvers,
    find_platform,
    find_policies,
)

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..evaluation.studies.disturbances import Study
    from ..evaluation.suite import CueSource


@dataclass(frozen=True, kw_only=True)
class RobustnessCommand:
    """Drive policies with slower actuators, dead time, noisy sensors, another car, and in faster drives.

    Each policy is made for the machine as it should be and knows nothing of the disturbance. Policies of the
    benchmark that know the drive beforehand are left out. Without --maneuvers the standard maneuvers are
    driven. Drives that are done are kept in the output folder and not driven again.
    """

    policies: PolicyNames = (BENCHMARK,)
    maneuvers: ManeuverNames = ()
    platform: PlatformName = "paper"
    car: CarName = "sedan"
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
    out: OutFolder = Path("robustness")
    fresh: Fresh = False


def run(command: RobustnessCommand) -> int:
    """Drive everything; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.reporting.text import words_of
    from ..evaluation.studies.figures import heat_figure
    from .studies import prepare, run_and_save

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
    from ..evaluation.benchmark import benchmark_policies
    from ..evaluation.policies import policy_names
    from ..evaluation.studies.disturbances import Disturbances, SensorNoise, Study

    names = command.maneuvers or tuple(maneuver_names())

    def maneuvers(driven: Car) -> Mapping[str, CueSource]:
        return find_maneuvers(names, driven)

    rows = benchmark_policies(policy_names()) if BENCHMARK in command.policies else []
    return Study(
        platform=find_platform(command.platform),
        car=find_car(command.car),
        other=find_car(command.other_car),
        maneuvers=maneuvers,
        causal=frozenset(rows) - set(command.policies),
        disturbances=Disturbances(
            lag=command.lag,
            dead_time=command.dead_time,
            noise=SensorNoise(force=command.force_noise, rate=math.radians(command.rate_noise)),
            time_scaling=command.time_scaling,
        ),
    )
