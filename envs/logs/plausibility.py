"""What no car does: gravity, scales and speeds that show a wrong unit, each refused with the likely one.

A correlation knows no scale. Gravity gives the scale of the force, dv/dt that of the speed against it,
v r that of the yaw rate, and the course that of the yaw rate once more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..cues import GRAVITY, Floats
from ..errors import DataError
from .mounting import (
    LONGEST_DELAY_S,
    Evidence,
    Mounting,
    correlation,
    detrended,
    level,
    rest_force,
    turn,
    weightless,
)
from .signals import ImportOptions
from .units import RATES, UNITS

Fit: TypeAlias = NDArray[np.complex128]

GRAVITY_TOLERANCE: Final = 0.5
"""Gravity as a device measures it may differ by so much from 9.81 or from the one given, m/s^2."""

SLOPE_TOLERANCE: Final = 1.5
"""A slope outside of 1/1.5 to 1.5 shows a wrong unit; the smallest factor of one is 2.24 (mph)."""

_SURE: Final = 0.7
"""A slope is judged where its correlation is at least this."""

_LEAST_VARIATION: Final = {"force": 0.25, "heading": 0.05}
"""A slope is judged where the larger of both signals has this standard deviation, m/s^2, rad."""

_WINDOW_S: Final = 8.0
_TURNING: Final = 1.0
_SILENT: Final = 0.35
"""A channel may be dead in a window, s, where v r or f_y has this standard deviation, m/s^2, and the other
less than this share of it."""

_FASTEST: Final = {"speed": 120.0, **dict.fromkeys(RATES, 3.0)}
"""What no car exceeds below 0.5 Hz: m/s, rad/s."""


@dataclass(frozen=True)
class Slope:
    """How steeply one signal follows another that it should equal.

    Attributes:
        correlation: Between the two.
        least: Slope of the regression of the first on the second: too flat where the second is noisy.
        most: The inverse regression's: too steep where the first has other causes.
        judged: Whether both vary enough, and alike enough, to be judged.
        opposite: Whether they vary enough, and the first falls where the second rises.
    """

    correlation: float
    least: float
    most: float
    judged: bool
    opposite: bool = False

    @property
    def likely(self) -> float:
        """The geometric mean of both."""
        return float(np.sign(self.least) * np.sqrt(self.least * self.most))

    @property
    def wrong(self) -> bool:
        """Whether no slope between both is near 1."""
        return self.judged and (self.least > SLOPE_TOLERANCE or self.most < 1.0 / SLOPE_TOLERANCE)


def slope(measured: Floats, expected: Floats, least_variation: float) -> Slope:
    """Of ``measured`` (n,) on ``expected`` (n,)."""
    found = correlation(measured, expected)
    if found == 0.0:
        return Slope(0.0, 0.0, 0.0, False)
    ratio = float(measured.std() / expected.std())
    varied = bool(max(measured.std(), expected.std()) >= least_variation)
    return Slope(found, found * ratio, ratio / found, found >= _SURE and varied, found <= -_SURE and varied)


@dataclass(frozen=True)
class Slopes:
    """Slopes of a log in the axes of the car; None where the log lacks a signal.

    Attributes:
        along: Of f_x on dv/dt.
        across: Of f_y on v r.
        heading: Of the integrated yaw rate on the course, both without their straight line.
    """

    along: Slope | None
    across: Slope | None
    heading: Slope | None

    @classmethod
    def of(cls, evidence: Evidence, mounting: Mounting) -> Slopes:
        """The slopes of smoothed signals."""
        force, rate = mounting.force_in_car(evidence.force), mounting.rate_in_car(evidence.rate)
        along = across = heading = None
        if evidence.speed is not None:
            along = slope(force[:, 0], evidence.speed_rate, _LEAST_VARIATION["force"])
            across = slope(force[:, 1], turn(evidence, rate[:, 2]), _LEAST_VARIATION["force"])
        if evidence.course is not None:
            turned = detrended(np.cumsum(rate[:, 2]) * evidence.dt)
            heading = slope(turned, detrended(evidence.course), _LEAST_VARIATION["heading"])
        return cls(along, across, heading)

    def lines(self) -> list[str]:
        """For people."""
        names = {"f_x on dv/dt": self.along, "f_y on v r": self.across, "heading on course": self.heading}
        return [
            f"slope of {name:<18} {found.likely:.3f}"
            for name, found in names.items()
            if found is not None and found.judged
        ]


def silent_stretches(evidence: Evidence, mounting: Mounting) -> list[str]:
    """Notes on the time in which one of f_y and v r varies as in a turn, and the other does not."""
    if evidence.speed is None:
        return []
    measured = mounting.force_in_car(evidence.force)[:, 1]
    expected = turn(evidence, mounting.rate_in_car(evidence.rate)[:, 2])
    length = int(_WINDOW_S / evidence.dt)
    found: dict[str, list[float]] = {}
    for first in range(0, len(measured) - length + 1, length):
        window = slice(first, first + length)
        force, turning = float(measured[window].std()), float(expected[window].std())
        if max(force, turning) >= _TURNING and min(force, turning) < _SILENT * max(force, turning):
            which = ("v r varies, f_y does not", "f_y varies, v r does not")[force > turning]
            found.setdefault(which, []).append(first * evidence.dt)
    return [
        f"{which}, from {times[0]:.0f} to {times[-1] + _WINDOW_S:.0f} s: a channel may be dead there"
        for which, times in found.items()
    ]


def check_gravity(evidence: Evidence, options: ImportOptions) -> None:
    """Refuse a force at rest whose length is not gravity.

    Raises:
        DataError: with the likely unit, or how gravity is added.
    """
    found, expected = float(np.linalg.norm(rest_force(evidence)[0])), options.gravity_m_s2 or GRAVITY
    if abs(found - expected) <= GRAVITY_TOLERANCE:
        return
    said = f"gravity is {found:.3f} m/s^2 in the log, expected {expected:g}"
    if found < GRAVITY_TOLERANCE or weightless(evidence.force):
        raise DataError(
            f"{said}: the force comes without gravity; set gravity='add', with roll_deg and pitch_deg if the "
            "device is not level"
        )
    if options.gravity == "add":
        raise DataError(f"{said}: the force comes with gravity; leave out gravity='add'")
    likely = [
        f"the force looks like {unit}: {how}"
        for factor, unit, how in (
            (9.80665, "g", "declare it (force_x=COLUMN:g, likewise y and z)"),
            (1.0 / 9.80665, "m/s2", "declare it (force_x=COLUMN:m/s2, likewise y and z)"),
            (9.80665e-3, "mg", "divide it by 1000 and declare g"),
            (0.01, "cm/s2", "divide it by 100"),
            (0.001, "mm/s2", "divide it by 1000"),
            (0.3048, "ft/s2", "multiply it by 0.3048"),
        )
        if abs(found * factor - GRAVITY) <= 0.1 * GRAVITY
    ]
    raise DataError(
        f"{said}; {likely[0]}"
        if likely
        else f"{said}; check units and columns of the force, or give gravity_m_s2 if the device counts so"
    )


_PART_S: Final = 15.0
_LARGEST_TILT: Final = math.radians(40.0)
"""Parts of a drive, s, whose mean force may differ in direction by so much, rad, and what motion explains."""


def check_constancy(evidence: Evidence, options: ImportOptions) -> None:
    """Refuse a device that turns in the car during the drive, or whose unit or axes change.

    Raises:
        DataError: with the time from the beginning of what is imported.
    """
    length = int(_PART_S / evidence.dt)
    parts = [slice(first, first + length) for first in range(0, len(evidence.force) - length + 1, length)]
    if options.slopes == "accept" or len(parts) < 2 or weightless(evidence.force):
        return
    means = np.array([evidence.force[part].mean(axis=0) for part in parts])
    sizes = np.linalg.norm(means, axis=1)
    for place in range(1, len(parts)):
        when = f"at about {parts[place].start * evidence.dt:.0f} s of the import"
        ratio = sizes[place] / sizes[place - 1]
        if not 1.0 / SLOPE_TOLERANCE < ratio < SLOPE_TOLERANCE:
            raise DataError(
                f"gravity changes from {sizes[place - 1]:.3g} to {sizes[place]:.3g} m/s^2 {when}: the unit "
                "of the force changes; leave one part out with start_s or end_s, or set slopes='accept'"
            )
        cosine = means[place] @ means[place - 1] / (sizes[place] * sizes[place - 1])
        tilt = math.acos(min(max(float(cosine), -1.0), 1.0))
        explained = sum(_tilt_of_motion(evidence, part) for part in parts[place - 1 : place + 1])
        if tilt > _LARGEST_TILT + explained:
            raise DataError(
                f"the vertical tilts by {math.degrees(tilt):.0f} deg in the device's axes "
                f"{when}: the device moved, or its axes change; leave one part out with start_s or end_s, or "
                "set slopes='accept'"
            )


def _tilt_of_motion(evidence: Evidence, part: slice) -> float:
    """Angle between gravity and the mean force of a part, rad, by its changes of speed and its turns."""
    if evidence.speed is None:
        return 0.0
    speed = evidence.speed[part]
    turning = np.linalg.norm(np.mean(speed[:, None] * evidence.rate[part], axis=0))
    return math.atan((abs(speed[-1] - speed[0]) / _PART_S + float(turning)) / GRAVITY)


_AXES_S: Final = 8.0
"""Length of the parts whose axes are compared, s."""
_EXCITED: Final = 0.5
"""Root mean square of dv/dt and v r together from which a part shows its axes, m/s^2."""
_OWN_FIT, _WORSE_FIT = 0.9, 0.3
"""Axes have changed where a part's own turn fits at least so well, and that of all before by so much less."""
_ALIKE: Final = 0.7
"""The motion and its mirror image fit alike down to this ratio: v r has a sixth of the power of dv/dt."""
_DELAYS: Final = tuple(np.arange(0.0, LONGEST_DELAY_S + 0.05, 0.1).tolist())
_MISSING: Final = 1e-3
"""A horizontal force that varies by less is a constant, whose axis shows nothing, m/s^2."""
_TURNS: Final = (0.05, 0.8)
"""Root mean square of a yaw rate that shows its sense, rad/s, and the correlation that does."""


def check_axes(evidence: Evidence) -> None:
    """Refuse axes that change during the drive: a device that slipped, or columns that were swapped.

    The horizontal force is compared with (dv/dt, v r), part by part, as complex numbers: the force of a part
    is that motion turned by one angle, or its mirror image. The delay of the speed is the one with which
    the parts fit best, each for itself, since that of the whole drive supposes that nothing changes.

    Args:
        evidence: With the speed as it was recorded, late.

    Raises:
        DataError: with the time from the beginning of what is imported.
    """
    if evidence.speed is None:
        return
    leveled = Mounting(*level(rest_force(evidence)[0]))
    forward, right, _ = leveled.force_in_car(evidence.force).T
    if min(forward.std(), right.std()) < _MISSING:
        return
    planar = np.asarray(forward + 1.0j * right, dtype=np.complex128)
    rate = leveled.rate_in_car(evidence.rate)[:, 2]
    trials = [_parts(evidence.delayed(delay), planar, rate) for delay in _DELAYS]
    parts = max(trials, key=lambda found: sum(float(np.abs(fit).max()) for _, fit in found))
    before = np.zeros(2, dtype=np.complex128)
    for place, (when, fit) in enumerate(parts):
        # A change lasts: no later part has the turn of before again.
        later = [one for _, one in parts[place:]]
        if (
            np.any(before)
            and np.abs(fit).max() >= _OWN_FIT
            and not any(_agrees(one, before) for one in later)
        ):
            raise DataError(
                f"the axes of the force change at about {when:.0f} s of the import: it follows dv/dt and v r "
                "in another direction than before; the device moved, or columns are swapped there; leave one "
                "part out with start_s or end_s, or set slopes='accept'"
            )
        before += fit
    _check_sense(evidence, rate)


def _parts(evidence: Evidence, planar: NDArray[np.complex128], rate: Floats) -> list[tuple[float, Fit]]:
    """Begin, s, and fit of each part that shows its axes.

    A fit is the product of the force with the motion and with its mirror image, of length 1 where it is that
    motion. Its angle is the turn between both.
    """
    motion = evidence.speed_rate + 1.0j * turn(evidence, rate[: len(evidence.rate)])
    length, found = int(_AXES_S / evidence.dt), []
    for first in range(0, len(motion) - length + 1, length):
        force, expected = (values[first : first + length] for values in (planar, motion))
        force, expected = force - force.mean(), expected - expected.mean()
        size = float(np.linalg.norm(force) * np.linalg.norm(expected))
        if size > 0.0 and float(np.linalg.norm(expected)) >= _EXCITED * math.sqrt(length):
            products = [np.vdot(expected, force), np.vdot(expected.conj(), force)]
            found.append((first * evidence.dt, np.asarray(products, dtype=np.complex128) / size))
    return found


def _fit_of(fit: Fit, before: Fit) -> float:
    """How well a part (2,) has the turn of the parts before it (2,)."""
    sizes = np.abs(before)
    # Where both fit alike, the drive so far does not show whether the axes are mirrored.
    likely = sizes >= _ALIKE * sizes.max()
    return float(np.real(fit * before.conj() / np.maximum(sizes, 1e-12))[likely].max())


def _agrees(fit: Fit, before: Fit) -> bool:
    """Whether a part (2,) fits nearly as well with the turn of the parts before it as with its own."""
    return _fit_of(fit, before) > float(np.abs(fit).max()) - _WORSE_FIT


def _check_sense(evidence: Evidence, rate: Floats) -> None:
    """Refuse a yaw rate whose sense against the course changes during the drive."""
    if evidence.course is None:
        return
    turning = np.gradient(evidence.course, evidence.dt)
    length, senses = int(_AXES_S / evidence.dt), dict[float, float]()
    for first in range(0, len(rate) - length + 1, length):
        part = slice(first, first + length)
        alike = correlation(rate[part], turning[part])
        if turning[part].std() >= _TURNS[0] and abs(alike) >= _TURNS[1]:
            senses[first * evidence.dt] = float(np.sign(alike))
    changed = [when for when, sense in senses.items() if sense != next(iter(senses.values()))]
    if changed:
        raise DataError(
            f"the sense of the rates against the course changes at about {changed[0]:.0f} s of the import; "
            "leave one part out with start_s or end_s, or set slopes='accept'"
        )


def check_fastest(evidence: Evidence, units: Mapping[str, str]) -> None:
    """Refuse rates and speeds that no car has, below 0.5 Hz.

    Raises:
        DataError: with the likely unit.
    """
    fastest = {name: np.abs(evidence.rate[:, axis]) for axis, name in enumerate(RATES)}
    if evidence.speed is not None:
        fastest["speed"] = np.abs(evidence.speed)
    for name, values in fastest.items():
        if values.max() > _FASTEST[name]:
            known = UNITS[name]
            unit = units.get(name, next(iter(known)))
            others = " or ".join(f"{name}=COLUMN:{one}" for one in known if known[one] < known[unit])
            remedy = f"its unit is not {unit}; declare {others}" if others else "check the column"
            raise DataError(
                f"{name} reaches {values.max():.4g} {next(iter(known))}, which no car does; {remedy}"
            )


def check_slopes(slopes: Slopes) -> None:
    """Refuse slopes that show a wrong unit of speed, yaw rate or course.

    Gravity has been checked before, so the force has its scale.

    Raises:
        DataError: names the signal at fault and the likely factor.
    """
    found = {
        "f_x on dv/dt": slopes.along,
        "f_y on v r": slopes.across,
        "heading on course": slopes.heading,
    }
    wrong = {name: one for name, one in found.items() if one is not None and one.wrong}
    if not wrong:
        return
    across, heading = (wrong.get(name) for name in ("f_y on v r", "heading on course"))
    if "f_x on dv/dt" in wrong:
        signal, factor = "speed", 1.0 / wrong["f_x on dv/dt"].likely
    elif heading is not None and across is None:
        signal, factor = "course", 1.0 / heading.likely
    elif across is not None:
        # Speed and yaw rate both scale v r. Where dv/dt is right, or does not vary, the rates are at fault.
        signal, factor = "rates", 1.0 / across.likely
        if slopes.heading is not None and heading is None and slopes.heading.judged:
            signal = "speed"
    shown = ", ".join(f"slope of {name} {one.likely:.3g}" for name, one in wrong.items())
    raise DataError(
        f"{shown}, expected 1: the {signal} {'are' if signal == 'rates' else 'is'} off by a factor of "
        f"{factor:.3g}{_likely_factor(signal, factor)}; declare the unit, or set slopes='accept'"
    )


def check_senses(slopes: Slopes) -> None:
    """Refuse signals in the car's own axes whose signs disagree; other devices have theirs estimated.

    Raises:
        DataError: names the pair that disagrees.
    """
    found = {"f_x on dv/dt": slopes.along, "f_y on v r": slopes.across, "heading on course": slopes.heading}
    opposite = [name for name, one in found.items() if one is not None and one.opposite]
    if opposite:
        raise DataError(
            f"{' and '.join(opposite)}: the first falls where the second rises, so a sign is wrong; reverse "
            "its column (force_y=-force_y), or set slopes='accept'"
        )


def _likely_factor(signal: str, factor: float) -> str:
    hints = {
        "speed": {3.6: "km/h (speed=COLUMN:km/h)", 2.237: "mph (speed=COLUMN:mph)", 1.944: "knots",
                  9.80665: "x and y of the force in g (force_x=COLUMN:g)",
                  1 / 3.6: "m/s (speed=COLUMN:m/s)", 0.447: "m/s (speed=COLUMN:m/s)",
                  1.609: "mph declared as km/h", 1 / 1.609: "km/h declared as mph"},
        "rates": {57.3: "deg/s (rate_z=COLUMN:deg/s)", 1 / 57.3: "rad/s (rate_z=COLUMN:rad/s)"},
        "course": {57.3: "deg (course=COLUMN:deg)", 1 / 57.3: "rad (course=COLUMN:rad)"},
    }[signal]  # fmt: skip
    near = min(hints, key=lambda one: abs(np.log(one / factor)))
    return f", which looks like {hints[near]}" if abs(np.log(near / factor)) < 0.25 else ""
