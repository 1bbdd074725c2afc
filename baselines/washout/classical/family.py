"""The paper's classical washout: parameters, ranges of a search, and the family itself.

Every block can be opened, which makes EST1 to LC2 presets. The blocks and the step are in
:mod:`..kernels.blocks` and :mod:`..kernels.step`, with the paper's symbols and equation numbers.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from ....envs.arrays import vec3
from ....envs.platform.machines import Cab
from ....envs.settings import Positive, Vector2, Vector3, configuration, preset_names
from ..families import Coordinate, Family, coordinates, load_of
from ..kernels.blocks import HighPassParameters, Memory, Parameters, initial_memory
from ..kernels.launch import make_kernels
from ..kernels.step import washout
from ..policy import WashoutPolicy

Frequency = Annotated[float, Field(ge=0.0, le=100.0)]
Limits = tuple[Positive, Positive, Positive]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


@configuration
class HighPass:
    """One high-pass filter.

    Args:
        order: 1: s / (s + w); 2: s^2 / (s^2 + 2 zeta w s + w^2); 0: open, everything passes.
        frequency: Break frequency w, rad/s.
        damping: zeta of the second order.
    """

    order: Literal[0, 1, 2] = 0
    frequency: Frequency = 0.0
    damping: Positive = 1.0


@configuration
class LowPass:
    """w^2 / (s^2 + 2 zeta w s + w^2): break frequency w, rad/s, and damping zeta."""

    frequency: Annotated[float, Field(gt=0.0, le=100.0)]
    damping: Positive = 1.0


@configuration
class TiltCoordination:
    """Sustained specific force by tilt.

    Args:
        low_pass: LP FILT on f1.
        rate: Greatest tilt rate of each angle, rad/s.
        acceleration: Greatest tilt acceleration of each angle, rad/s^2.
        approach: Gain with which the tilt closes in on its target where neither limit acts, 1/s.
    """

    low_pass: LowPass = LowPass(5.0)
    rate: Positive = math.radians(3.0)
    acceleration: Positive = math.radians(8.0)
    approach: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0


@configuration
class WashoutParameters:
    """The whole algorithm, in the paper's order of blocks.

    Args:
        name: Preset name.
        description: One line for people.
        force_scale: Scale of f_AA an axis (z on f_z + g).
        force_limit: Greatest scaled specific force an axis, m/s^2 (z on f_z + g).
        rate_scale: Scale of omega_AA an axis.
        rate_limit: Greatest scaled angular velocity an axis, rad/s.
        hpr: HPR FILT on the Euler rates: roll, pitch, yaw.
        rate_bandwidth: First-order roll-off of HPR, rad/s: it makes the angular acceleration a state of the
            filter instead of a difference of its input.
        tilt: Tilt coordination, or None to switch it off.
        turntable_share: k_T: 1 turns the cab with the turntable, 0 with the hexapod.
        turntable_gain: k_yr, scales the turntable's angle for special effects.
        hps: HPS FILT on a2S in F_S: x, y.
        hpi: HPI FILT in F_I: x, y, z.
        lpc: LPC FILT, which gives the carriage its part, or None to leave all to the hexapod.
        start_carriage: C'(0): where the carriage begins a drive, m.
        start_hexapod: S'(0): where the hexapod begins a drive, m from neutral.
        follow_frequency: How fast machine and reference come together again after a limit was hit, rad/s.
        return_frequency: How fast a machine that a limit held back is led home, where HPI of order 0 or 1
            would leave it, rad/s; without a limit it has no effect.
    """

    name: str
    description: str = ""
    force_scale: Vector3 = (1.0, 1.0, 1.0)
    force_limit: Limits = (10.0, 10.0, 10.0)
    rate_scale: Vector3 = (1.0, 1.0, 1.0)
    rate_limit: Limits = (1.5, 1.5, 1.5)
    hpr: tuple[HighPass, HighPass, HighPass] = (HighPass(2, 0.5), HighPass(2, 0.5), HighPass(1, 0.2))
    rate_bandwidth: Annotated[float, Field(gt=0.0, le=200.0)] = 50.0
    tilt: TiltCoordination | None = TiltCoordination()
    turntable_share: Share = 1.0
    turntable_gain: Positive = 1.0
    hps: tuple[HighPass, HighPass] = (HighPass(2, 0.6), HighPass(2, 0.6))
    hpi: tuple[HighPass, HighPass, HighPass] = (HighPass(1, 0.1), HighPass(1, 0.1), HighPass(2, 2.0))
    lpc: LowPass | None = LowPass(3.0)
    start_carriage: Vector2 = (0.0, 0.0)
    start_hexapod: Vector3 = (0.0, 0.0, 0.0)
    follow_frequency: Annotated[float, Field(gt=0.0, le=50.0)] = 5.0
    return_frequency: Annotated[float, Field(ge=0.0, le=5.0)] = 0.1


_PRESETS: Final = Path(__file__).parent / "presets"


def washout_presets() -> list[str]:
    """Names of the shipped parameter sets."""
    return preset_names(_PRESETS)


def load_washout(name: str | Path) -> WashoutParameters:
    """A parameter set of the classical washout by preset name, or from a YAML file.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong, or it is a set of another family.
    """
    return load_of("classical", name)  # type: ignore[no-any-return]


def _high_pass(block: HighPass) -> Any:
    values: Any = HighPassParameters()
    values.order, values.frequency, values.damping = block.order, block.frequency, block.damping
    return values


def kernel_parameters(p: WashoutParameters, cab: Cab) -> Any:
    """The kernels' struct of a parameter set for a cab."""
    k: Any = Parameters()
    for name in ("force_scale", "force_limit", "rate_scale", "rate_limit"):
        setattr(k, name, vec3(*getattr(p, name)))
    blocks = {"hpr_roll": p.hpr[0], "hpr_pitch": p.hpr[1], "hpr_yaw": p.hpr[2], "hps_x": p.hps[0]}
    blocks |= {"hps_y": p.hps[1], "hpi_x": p.hpi[0], "hpi_y": p.hpi[1], "hpi_z": p.hpi[2]}
    for name, block in blocks.items():
        setattr(k, name, _high_pass(block))
    tilt = p.tilt or TiltCoordination()
    k.tilt_gain = 1.0 if p.tilt else 0.0
    k.tilt_frequency, k.tilt_damping = tilt.low_pass.frequency, tilt.low_pass.damping
    k.tilt_rate, k.tilt_acceleration, k.tilt_approach = tilt.rate, tilt.acceleration, tilt.approach
    lpc = p.lpc or LowPass(1.0)
    k.carriage_share = 1.0 if p.lpc else 0.0
    k.lpc_frequency, k.lpc_damping = lpc.frequency, lpc.damping
    for name in (
        "rate_bandwidth",
        "turntable_share",
        "turntable_gain",
        "follow_frequency",
        "return_frequency",
    ):
        setattr(k, name, getattr(p, name))
    k.cab = vec3(*cab.reference_point)
    return k


_SCALES: Final = (0.2, 1.2)
"""From a fifth of the car's cue to a fifth more than it."""
_FORCE_LIMITS: Final = (0.5, 30.0)
"""From the threshold of perception to beyond any tire or rough road, m/s^2."""
_RATE_LIMITS: Final = (math.radians(3.0), 5.0)
"""From the threshold of perception to beyond any road, rad/s."""
_DAMPING: Final = (0.3, 4.0)
"""From a third of overshoot to two real poles a factor of 62 apart."""
_ROTATION: Final = (0.001, 2.5)
"""rad/s; up to the set of shoarai/washout. The turntable has no end: yaw need not return within a drive."""
_TRANSLATION: Final = (0.005, 2.5)
"""rad/s; from a machine that hardly returns within a drive, up to Reid and Nahon's sets."""
_HEAVE: Final = (0.1, 10.0)
_ROLL_OFF: Final = (10.0, 200.0)
_TILT: Final = (0.1, 20.0)
"""rad/s; published sets have up to 5, but above that only the limits on rate and acceleration count."""
_TILT_RATE: Final = (math.radians(0.5), math.radians(20.0))
"""Up to four times the largest limit in use (doi 10.1177/0037549716675955): J, not a rule, decides."""
_TILT_ACCELERATION: Final = (math.radians(2.0), math.radians(200.0))
_APPROACH: Final = (0.5, 50.0)
_SPLIT: Final = (0.1, 100.0)
TRAVEL: Final = (0.3, 30.0)
"""m; up to where the carriage's ends no longer count."""
CARRIAGE_SPEED: Final = (0.3, 30.0)
HEAVE_TRAVEL: Final = (0.02, 2.0)

COORDINATES: Final = (
    *coordinates("force_scale.{}", 3, _SCALES, log=False),
    *coordinates("rate_scale.{}", 3, _SCALES, log=False),
    *coordinates("force_limit.{}", 3, _FORCE_LIMITS),
    *coordinates("rate_limit.{}", 3, _RATE_LIMITS),
    *coordinates("hpr.{}.frequency", 3, _ROTATION),
    *coordinates("hpr.{}.damping", 3, _DAMPING),
    Coordinate("rate_bandwidth", *_ROLL_OFF),
    Coordinate("tilt.low_pass.frequency", *_TILT),
    Coordinate("tilt.low_pass.damping", *_DAMPING),
    Coordinate("tilt.rate", *_TILT_RATE),
    Coordinate("tilt.acceleration", *_TILT_ACCELERATION),
    Coordinate("tilt.approach", *_APPROACH),
    Coordinate("turntable_share", 0.0, 1.0, log=False),
    *coordinates("hps.{}.frequency", 2, _TRANSLATION),
    *coordinates("hps.{}.damping", 2, _DAMPING),
    *coordinates("hpi.{}.frequency", 2, _TRANSLATION),
    *coordinates("hpi.{}.damping", 2, _DAMPING),
    Coordinate("hpi.2.frequency", *_HEAVE),
    Coordinate("hpi.2.damping", *_DAMPING),
    Coordinate("lpc.frequency", *_SPLIT),
    Coordinate("lpc.damping", *_DAMPING),
)
"""Numbers that a search may change."""

FAMILY: Final = Family(
    name="classical",
    title="the classical washout",
    parameters=WashoutParameters,
    kernels=make_kernels(
        Parameters,
        Memory,
        initial_memory,
        washout,
        lambda p, cab, dt: kernel_parameters(p, cab),
        differentiable=True,
    ),
    presets=_PRESETS,
    start="classical",
    coordinates=COORDINATES,
)


class ClassicalWashout(WashoutPolicy[WashoutParameters]):
    """The paper's algorithm as a policy; arguments as of :class:`~..policy.WashoutPolicy`."""

    algorithm = "classical"
