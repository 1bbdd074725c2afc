"""Parameters of the optimal washout: what each error and each movement of the machine costs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from ...envs.perception import get_vestibular_model
from ...envs.settings import Positive, Vector2, Vector3, configuration
from ..presets import load_preset, preset_names
from ..washout import LowPass
from ..washout.parameters import Limits, Share


@configuration
class PlaneWeights:
    """Surge and pitch, or sway and roll: the size at which a quantity costs as much as any other at its own.

    Args:
        sensed_force: Error of the sensed specific force, m/s^2.
        sensed_rate: Error of the sensed angular velocity, rad/s.
        integral: Time integral of the displacement, m s.
        displacement: Of the cab from where the drive began, m.
        velocity: Of it, m/s.
        tilt_rate: Angular velocity of the cab, rad/s.
        acceleration: Of the displacement, m/s^2.
        tilt_acceleration: Angular acceleration of the cab, rad/s^2.
    """

    sensed_force: Positive = 0.6
    sensed_rate: Positive = math.radians(3.0)
    integral: Positive = 50.0
    displacement: Positive = 10.0
    velocity: Positive = 10.0
    tilt_rate: Positive = 0.2
    acceleration: Positive = 10.0
    tilt_acceleration: Positive = 2.0


@configuration
class HeaveWeights:
    """Heave: the size at which each quantity costs 1.

    Args:
        sensed_force: Error of the sensed specific force, m/s^2.
        integral: Time integral of the displacement, m s.
        displacement: Of the cab from where the drive began, m.
        velocity: Of it, m/s.
        acceleration: Of it, m/s^2.
    """

    sensed_force: Positive = 0.6
    integral: Positive = 0.5
    displacement: Positive = 0.2
    velocity: Positive = 0.5
    acceleration: Positive = 5.0


@configuration
class YawWeights:
    """Yaw: the size at which each quantity costs 1.

    Args:
        sensed_rate: Error of the sensed angular velocity, rad/s.
        angle: Of the cab from where the drive began, rad.
        rate: Angular velocity of the cab, rad/s.
        acceleration: Angular acceleration of the cab, rad/s^2.
    """

    sensed_rate: Positive = math.radians(3.0)
    angle: Positive = 100.0
    rate: Positive = 5.0
    acceleration: Positive = 5.0


@configuration
class OptimalParameters:
    """The whole algorithm.

    Args:
        name: Preset name.
        description: One line for people.
        algorithm: Tells files of the families apart.
        force_scale: Scale of f_AA an axis (z on f_z + g).
        force_limit: Greatest scaled specific force an axis, m/s^2 (z on f_z + g).
        rate_scale: Scale of omega_AA an axis.
        rate_limit: Greatest scaled angular velocity an axis, rad/s.
        force_bandwidth: Of the first-order filter of white noise that stands for the car's specific force,
            rad/s.
        rate_bandwidth: The same of its angular velocity, rad/s.
        vestibular: Name of the perception model that the filters are optimal for.
        surge: Weights of surge and pitch.
        sway: Weights of sway and roll.
        heave: Weights of heave.
        yaw: Weights of yaw.
        turntable_share: k_T: 1 turns the cab with the turntable, 0 with the hexapod.
        turntable_gain: k_yr, scales the turntable's angle for special effects.
        lpc: LPC FILT, which gives the carriage its part, or None to leave all to the hexapod.
        start_carriage: Where the carriage begins a drive, m.
        start_hexapod: Where the hexapod begins a drive, m from neutral.
        follow_frequency: How fast machine and filters come together again after a limit was hit, rad/s.
    """

    name: str
    description: str = ""
    algorithm: Literal["optimal"] = "optimal"
    force_scale: Vector3 = (1.0, 1.0, 1.0)
    force_limit: Limits = (10.0, 10.0, 10.0)
    rate_scale: Vector3 = (1.0, 1.0, 1.0)
    rate_limit: Limits = (1.5, 1.5, 1.5)
    force_bandwidth: Positive = 1.0
    rate_bandwidth: Positive = 1.0
    vestibular: str = "telban"
    surge: PlaneWeights = PlaneWeights()
    sway: PlaneWeights = PlaneWeights()
    heave: HeaveWeights = HeaveWeights()
    yaw: YawWeights = YawWeights()
    turntable_share: Share = 1.0
    turntable_gain: Positive = 1.0
    lpc: LowPass | None = LowPass(8.0)
    start_carriage: Vector2 = (0.0, 0.0)
    start_hexapod: Vector3 = (0.0, 0.0, 0.0)
    follow_frequency: Annotated[float, Field(gt=0.0, le=50.0)] = 5.0

    def __post_init__(self) -> None:
        get_vestibular_model(self.vestibular)


_PRESETS: Final = Path(__file__).parent / "presets"


def optimal_presets() -> list[str]:
    """Names of the shipped parameter sets."""
    return preset_names(_PRESETS)


def load_optimal(name: str | Path) -> OptimalParameters:
    """A parameter set by preset name, or from a YAML file.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    return load_preset(OptimalParameters, "optimal washout preset", name, _PRESETS)
