"""Parameters of model predictive control: horizon, forecast, weights, limits, and how often it linearizes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from ...envs.errors import ConfigurationError, UnknownNameError
from ...envs.settings import (
    NonNegative,
    Positive,
    configuration,
    from_dict,
    load,
    named,
    preset_names,
    read_yaml,
)
from ...envs.simulator.simulator import TIME_STEP

Share = Annotated[float, Field(gt=0.0, le=1.0)]
Whole = Annotated[int, Field(ge=1, le=100)]

_NODES: Final = (0.01, 0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.7, 0.9, 1.1, 1.3, 1.55, 1.8, 2.1, 2.6, 3.3, 4.2)


@configuration
class AxisWeights:
    """Quadratic weights on the motion of one subsystem; 1 is a cue error as large as the indifference zone.

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
    """Quadratic weights on the motion of the machine, by subsystem.

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
    """Forecast of the reference cue over the horizon: known for the preview, extrapolated beyond it.

    Args:
        preview: Time of the drive ahead that is known, s. With 0 only the present cue is known. The part
            beyond the horizon is not used.
        memory: Time constant of the low-pass that separates the sustained cue from the transient one, s.
        force_decay: Time constants with which transient specific force on x, y and z decays, s.
        rate_decay: The same of angular velocity, s.
        lasting_decay: Time constant with which the sustained cue decays to rest, s.
    """

    preview: NonNegative = 0.0
    memory: Positive = 4.0
    force_decay: tuple[Positive, Positive, Positive] = (3.0, 2.0, 2.0)
    rate_decay: Positive = 0.3
    lasting_decay: Positive = 5.0


@configuration
class TiltRate:
    """Soft limit on the cab's roll and pitch rate in excess of the car's own.

    Args:
        limit: Rate without cost, rad/s; the default is SIMONA's.
        weight: Quadratic weight of the excess, in indifference zones of rate.
    """

    limit: NonNegative = math.radians(3.0)
    weight: NonNegative = 0.0


@configuration
class Margins:
    """Shares of the machine's limits that a plan may use. The rest covers linearization and discretization.

    Args:
        position: Share of each travel, for the place where an actuator could stop.
        rate: Share of each speed limit.
        acceleration: Share of each acceleration limit.
        braking: Share of the acceleration limit with which an actuator stops before the end of its travel.
    """

    position: Share = 0.98
    rate: Share = 0.97
    acceleration: Share = 0.95
    braking: Share = 0.85


@configuration
class MpcParameters:
    """Model predictive control, linear or nonlinear.

    With ``nonlinear`` false each plan is one quadratic program (the real-time iteration). With true it is the
    converged solution of the nonlinear program. Over the standard maneuvers both reach the same J to three
    digits. The nonlinear one is slower: the 99th percentile of its step time is two to three times that of
    the linear one, and exceeds the 10 ms of a time step in some drives.

    Args:
        algorithm: Kind of controller, as parameter files name it.
        nodes: Times from now at which accelerations are free, s. Accelerations are straight lines between
            nodes and constant before the first one. The last node is the horizon.
        every: Time steps from one plan to the next; in between the plan is followed.
        objective: "cab": error of the cues at the cab, as in J. "perceived": error of the perceived cues; at
            the cab too, whereas perceived J takes the head.
        vestibular: Model of perception for the objective "perceived".
        cab_share: Weight of the cab's error beside the perceived one, for the objective "perceived". With 0,
            motion too quick to be perceived would cost nothing.
        forecast: Forecast of the reference cue.
        weights: Quadratic weights on the machine's motion.
        tilt_rate: Soft limit on tilt rate.
        margins: Shares of the machine's limits.
        penalty: Price of a limit's violation, as a mean over the horizon, in units of the cost. Violations
            are in shares of half the travel, of the greatest rate and of the greatest acceleration. It is
            higher than any multiplier, so that limits hold wherever they can (exact penalty).
        rounds: Greatest number of times that violated limits are added to a quadratic program.
        nonlinear: Whether a plan linearizes again and again (sequential quadratic programming), or once.
        iterations: Greatest number of quadratic programs for a nonlinear plan.
        tolerance: A step that changes no acceleration by more ends a nonlinear plan, m/s^2 and rad/s^2.
        compile: Whether to compile the machine's derivatives where there is a C compiler: the same numbers,
            sooner.
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
    nonlinear: bool = False
    iterations: Whole = 10
    tolerance: Positive = 0.05

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


_PRESETS: Final = Path(__file__).parent / "presets"


def mpc_presets() -> list[str]:
    """Names of the shipped parameter sets."""
    return preset_names(_PRESETS)


def load_mpc(name: str | Path) -> MpcParameters:
    """A parameter set by preset name, or from a YAML file with the fields of MpcParameters.

    Files of earlier versions that say ``algorithm: nmpc`` are read as nonlinear controllers.

    Raises:
        UnknownNameError: no set has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field is wrong.
    """
    if Path(name).suffix not in (".yaml", ".yml"):
        if str(name) not in mpc_presets():
            raise UnknownNameError("predictive controller", str(name), mpc_presets())
        return load(MpcParameters, _PRESETS / f"{name}.yaml")
    values = read_yaml(name)
    if isinstance(values, dict) and values.get("algorithm") == "nmpc":
        # Earlier versions held the linear controller in a block of its own.
        block = values.pop("mpc", {})
        if not isinstance(block, dict):
            raise ConfigurationError(f"{name}: field 'mpc' holds the fields of a controller, found {block!r}")
        values = {"nonlinear": True, **block, **values, "algorithm": "mpc"}
    return from_dict(MpcParameters, named(MpcParameters, values, name), str(name))
