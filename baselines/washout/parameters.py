"""Parameters of the paper's classical washout. Every block can be opened, which makes EST1 to LC2 presets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from ...envs.settings import Positive, Vector2, Vector3, configuration
from ..presets import load_preset, preset_names

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


OPEN: Final = HighPass()


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
    """A parameter set by preset name, or from a YAML file.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    return load_preset(WashoutParameters, "washout preset", name, _PRESETS)
