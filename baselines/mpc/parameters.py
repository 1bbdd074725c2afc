"""What a predictive controller is told: how far it looks, on which grid, and what it minds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from ...envs.settings import NonNegative, Positive, configuration
from ...envs.simulator.simulator import TIME_STEP
from ..presets import load_preset, preset_names

Share = Annotated[float, Field(gt=0.0, le=1.0)]
Whole = Annotated[int, Field(ge=1, le=100)]

_NODES: Final = (0.01, 0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.7, 0.9, 1.1, 1.3, 1.55, 1.8, 2.1, 2.6, 3.3, 4.2)


@configuration
class AxisWeights:
    """What motion of one subsystem costs, squared, relative to a cue error at the edge of the zone.

    Args:
        position: Away from neutral, per m^2 or rad^2.
        rate: Per (m/s)^2 or (rad/s)^2.
        acceleration: Per (m/s^2)^2 or (rad/s^2)^2.
        end_position: Position at the horizon's end, times 1 s.
        end_rate: Rate there, times 1 s.
    """

    position: NonNegative = 0.0
    rate: NonNegative = 0.0
    acceleration: NonNegative = 0.0
    end_position: NonNegative = 0.0
    end_rate: NonNegative = 0.0


@configuration
class Weights:
    """What motion costs, by subsystem.

    Args:
        carriage: Its x and y.
        translation: Surge, sway and heave of the hexapod.
        tilt: Its roll and pitch.
        yaw: Its yaw.
        turntable: The turntable. Position counts only where its travel ends.
    """

    carriage: AxisWeights = AxisWeights(0.0005, 0.0005, 0.001, 0.004, 0.3)
    translation: AxisWeights = AxisWeights(0.07, 0.035, 0.012, 0.7, 1.5)
    tilt: AxisWeights = AxisWeights(0.1, 0.0, 0.012, 1.5, 3.0)
    yaw: AxisWeights = AxisWeights(2.0, 1.0, 0.1, 10.0, 10.0)
    turntable: AxisWeights = AxisWeights(0.01, 0.0, 0.05, 0.1, 0.0)


@configuration
class Forecast:
    """What the car will do, where nobody says.

    Args:
        preview: How much of the drive ahead is known, s: 0 for nothing but now. What lies beyond the
            horizon is never looked at.
        memory: Time constant of the low-pass that tells what lasts from what is new, s.
        force_decay: Time constants with which new specific force on x, y and z goes to what lasts, s.
        rate_decay: The same of angular velocity.
        lasting_decay: Time constant with which what lasts goes to rest, s.
    """

    preview: NonNegative = 0.0
    memory: Positive = 4.0
    force_decay: tuple[Positive, Positive, Positive] = (3.0, 2.0, 2.0)
    rate_decay: Positive = 0.3
    lasting_decay: Positive = 5.0


@configuration
class TiltRate:
    """Soft limit of the cab's roll and pitch rate beyond the car's own.

    Args:
        limit: Rate that costs nothing, rad/s; the default is SIMONA's.
        weight: Cost of a rate beyond it, squared, per zone of rate.
    """

    limit: NonNegative = math.radians(3.0)
    weight: NonNegative = 0.0


@configuration
class Margins:
    """Shares of the machine's limits that a plan may use; the rest is for what the model leaves out.

    Args:
        position: Of each travel, for where an actuator could stop.
        rate: Of each speed limit.
        acceleration: Of each acceleration limit.
        braking: Of the acceleration limit, to stop before the end of travel with.
    """

    position: Share = 0.98
    rate: Share = 0.97
    acceleration: Share = 0.95
    braking: Share = 0.85


@configuration
class MpcParameters:
    """A predictive controller.

    Args:
        algorithm: What a file of such parameters says it is.
        nodes: Times from now at which accelerations are free, s; between them they are straight lines,
            before the first one constant. The last is the horizon.
        every: Time steps from one solution to the next; in between the plan is followed.
        objective: "cab": the error of the cab's cues, as J; "perceived": of what is sensed of them, at the
            cab as well, where perceived J takes the head.
        vestibular: Model of perception for the objective "perceived".
        cab_share: What the cab's error counts beside the perceived one, for the objective "perceived":
            motion too quick to be sensed would cost nothing otherwise.
        forecast: The car's cues over the horizon.
        weights: Cost of motion.
        tilt_rate: Soft limit.
        margins: Shares of the machine's limits.
        penalty: Price of a limit's violation, its mean over the horizon, in units of the cost: of an
            actuator's stopping place by half its travel, of its rate by the greatest rate, of its
            acceleration by the greatest. Higher than any multiplier, so that limits hold wherever they can.
        rounds: Most times that limits are added to a problem until none is violated.
        compile: Whether to compile the machine's derivatives where there is a C compiler: the same
            numbers, sooner.
    """

    algorithm: Literal["mpc"] = "mpc"
    nodes: Annotated[tuple[float, ...], Field(min_length=2, max_length=100)] = _NODES
    every: Whole = 1
    objective: Literal["cab", "perceived"] = "cab"
    vestibular: str = "zacharias"
    cab_share: NonNegative = 0.1
    forecast: Forecast = Forecast()
    weights: Weights = Weights()
    tilt_rate: TiltRate = TiltRate()
    margins: Margins = Margins()
    penalty: Positive = 1e4
    rounds: Whole = 20
    compile: bool = True

    def __post_init__(self) -> None:
        if self.nodes[0] < TIME_STEP or any(b <= a for a, b in zip(self.nodes, self.nodes[1:], strict=False)):
            raise ValueError(
                f"nodes must increase from at least {TIME_STEP} s, found {list(self.nodes)}; "
                "give times such as [0.01, 0.1, 0.5, 2.0]"
            )
        if self.every * TIME_STEP > self.nodes[-1]:
            raise ValueError(
                f"every = {self.every} time steps is longer than the horizon of {self.nodes[-1]} s; "
                "solve more often"
            )

    @property
    def horizon(self) -> float:
        """The last node, s."""
        return self.nodes[-1]


_FOLDER: Final = Path(__file__).parent / "presets"


def mpc_presets() -> list[str]:
    """Names :func:`load_mpc` knows."""
    return preset_names(_FOLDER)


def load_mpc(name: str | Path) -> MpcParameters:
    """Parameters of a predictive controller, by name or from a YAML file with the fields of MpcParameters.

    Raises:
        UnknownNameError: no set has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field is wrong.
    """
    return load_preset(MpcParameters, "predictive controller", name, _FOLDER)


# What the nonlinear controller is told beside what the linear one is.


@configuration
class NmpcParameters:
    """A nonlinear predictive controller.

    Args:
        algorithm: What a file of such parameters says it is.
        mpc: Horizon, forecast, weights and margins, as of the linear one.
        iterations: Most programs a plan. 1 is the real-time iteration, which is the linear controller.
        tolerance: A step that changes no acceleration by more ends the search, m/s^2 and rad/s^2.
    """

    algorithm: Literal["nmpc"] = "nmpc"
    mpc: MpcParameters = MpcParameters()
    iterations: Annotated[int, Field(ge=1, le=100)] = 10
    tolerance: Positive = 0.05
