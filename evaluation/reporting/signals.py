"""Signals of a drive, as plots show them: each panel is declared once, for the report and for figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...envs.platform.kernels import ACTUATORS
from ..comparison import STILL
from ..metrics import CUE_AXES, Criteria, cab_motion, cue_error, tilt_rate
from ..trajectory import Floats, Trajectory

Drives = Mapping[str, Trajectory]
"""Trajectories of one maneuver by policy."""
Signal = Callable[[Trajectory, Criteria], Floats]
Limits = Callable[[Trajectory, Criteria], "tuple[float, float]"]

MOST_SHOWN: Final = 4
"""Policies that a plot shows at first; more lines cannot be told apart."""
COLORS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colors of policies, those of Okabe and Ito, which everyone can tell apart."""
DASHES: Final[tuple[tuple[float, ...], ...]] = ((), (7.0, 3.0), (2.0, 2.0))
"""Lengths of strokes and gaps; each color has every dash."""
STILL_STYLE: Final = ("#8a8a8a", (3.0, 3.0))
"""Color and dash of no motion."""
_DEGREES: Final = float(np.degrees(1.0))
_LEGS: Final = slice(2, 8)
_WINDOW: Final = 1.0
"""Length of the worst second, s."""


@dataclass(frozen=True)
class Panel:
    """One plot over time.

    Args:
        name: In files.
        group: Heading above panels that belong together.
        title: Above it.
        unit: Of its values.
        signal: (n,) values of a drive; (n, 2) for a band from a lowest to a highest value.
        least: Range of values that stays in view, so that rounding or tiny motion does not fill a panel.
        car: (n,) values of the car, where it has this signal.
        limits: Lowest and highest value that is allowed.
        from_zero: Whether the axis begins at zero.
        logarithmic: Whether the axis is.
        levels: Whether the value holds from sample to sample instead of changing along a line.
    """

    name: str
    group: str
    title: str
    unit: str
    signal: Signal
    least: float = 0.0
    car: Signal | None = None
    limits: Limits | None = None
    from_zero: bool = False
    logarithmic: bool = False
    levels: bool = False


def _cue(i: int, simulator: bool) -> Signal:
    factor = 1.0 if CUE_AXES[i].startswith("f") else _DEGREES
    return lambda drive, _: factor * cab_motion(drive)[int(simulator)][:, i]


def _travel(actuators: slice, factor: float) -> Limits:
    """Limits of actuators that share them; infinity where there are none."""
    return lambda drive, _: (
        factor * float(drive.limits.position_min[actuators].max()),
        factor * float(drive.limits.position_max[actuators].min()),
    )


def gathered_error(drive: Trajectory, criteria: Criteria) -> Floats:
    """(n,) the cue error so far over the whole drive; its last value is J."""
    return np.asarray(np.cumsum(cue_error(*cab_motion(drive), criteria)) / len(drive))


def running_error(drive: Trajectory, criteria: Criteria) -> Floats:
    """(n,) mean cue error over the second around each sample, shorter at both ends."""
    half = max(1, round(0.5 * _WINDOW / drive.dt))
    sums = np.concatenate([[0.0], np.cumsum(cue_error(*cab_motion(drive), criteria))])
    rows = np.arange(len(drive))
    begin, end = np.maximum(rows - half, 0), np.minimum(rows + half + 1, len(drive))
    return np.asarray((sums[end] - sums[begin]) / (end - begin))


def _extension(drive: Trajectory, _: Criteria) -> Floats:
    return np.column_stack([drive.legs.min(axis=1), drive.legs.max(axis=1)])


_FORCES: Final = ("Specific force x (surge)", "Specific force y (sway)", "Specific force z + g (heave)")
_RATES: Final = ("Roll rate", "Pitch rate", "Yaw rate")
PANELS: Final[tuple[Panel, ...]] = (
    *(
        Panel(CUE_AXES[i], "Cues at the cab", title, "m/s²", _cue(i, True), 1.0, _cue(i, False))
        for i, title in enumerate(_FORCES)
    ),
    *(
        Panel(CUE_AXES[i], "Cues at the cab", title, "deg/s", _cue(i, True), 5.0, _cue(i, False))
        for i, title in enumerate(_RATES, 3)
    ),
    Panel("error", "Error", "Cue error, mean over 1 s", "", running_error, 1.0, from_zero=True),
    Panel("gathered", "Error", "Cue error so far, to J at the end", "", gathered_error, 0.5, from_zero=True),
    Panel(
        "step_time", "Error", "Time of a step", "µs",
        lambda drive, _: 1e6 * drive.step_time, logarithmic=True,
    ),
    Panel("roll", "Tilt", "Hexapod roll", "deg", lambda drive, _: _DEGREES * drive.hexapod[:, 3], 2.0),
    Panel("pitch", "Tilt", "Hexapod pitch", "deg", lambda drive, _: _DEGREES * drive.hexapod[:, 4], 2.0),
    Panel(
        "tilt_rate", "Tilt", "Tilt rate beyond the car's own", "deg/s",
        lambda drive, _: _DEGREES * tilt_rate(drive), 4.0, from_zero=True,
        limits=lambda _, criteria: (-np.inf, _DEGREES * criteria.tilt_rate),
    ),
    Panel(
        "carriage_x", "Travel and limits", "Carriage x", "m",
        lambda drive, _: drive.carriage[:, 0], 0.5, limits=_travel(slice(0, 1), 1.0),
    ),
    Panel(
        "carriage_y", "Travel and limits", "Carriage y", "m",
        lambda drive, _: drive.carriage[:, 1], 0.5, limits=_travel(slice(1, 2), 1.0),
    ),
    Panel(
        "turntable", "Travel and limits", "Turntable", "deg",
        lambda drive, _: _DEGREES * drive.turntable, 30.0, limits=_travel(slice(8, 9), _DEGREES),
    ),
    Panel(
        "legs", "Travel and limits", "Legs, shortest to longest of the six", "m from neutral",
        _extension, 0.1, limits=_travel(_LEGS, 1.0),
    ),
    Panel(
        "at_limit", "Travel and limits", "Actuators at a limit", f"of {len(ACTUATORS)}",
        lambda drive, _: np.count_nonzero(drive.limits_active, axis=1).astype(np.float64),
        float(len(ACTUATORS)), from_zero=True, levels=True,
    ),
)  # fmt: skip
"""Every panel of a drive, in order."""

PHASES: Final = (
    ("Pitch against specific force x of the car", "f_x", "pitch", 1.0),
    ("Roll against specific force y of the car", "f_y", "roll", -1.0),
)
"""Phase plots: title, panel of the car's cue, panel of the tilt, and the sign of the tilt with that cue."""


@dataclass(frozen=True)
class WorstSecond:
    """The second of a drive in which the cue error is largest.

    Args:
        begin: Its first moment, s.
        end: Its last, s.
        error: Mean cue error in it.
        axis: The axis of :data:`CUE_AXES` with the largest part of that error.
    """

    begin: float
    end: float
    error: float
    axis: str


def worst_second(drive: Trajectory, criteria: Criteria) -> WorstSecond:
    """The second with the largest mean cue error; the whole drive where that is shorter."""
    reference, simulated = cab_motion(drive)
    parts = ((simulated - reference) / np.array(criteria.indifference_zone)) ** 2
    count = min(max(1, round(_WINDOW / drive.dt)), len(drive) - 1)
    sums = np.concatenate([np.zeros((1, parts.shape[1])), np.cumsum(parts, axis=0)])
    means = (sums[count:] - sums[:-count]) / count
    first = int(np.argmax(means.sum(axis=1)))
    return WorstSecond(
        begin=float(drive.time[first]),
        end=float(drive.time[min(first + count, len(drive) - 1)]),
        error=float(means[first].sum()),
        axis=CUE_AXES[int(np.argmax(means[first]))],
    )


def in_order(errors: Mapping[str, float], criteria: Criteria) -> list[str]:
    """Policies in the order of a legend: the references of the score, then the others, best first.

    No motion comes last: its lines are those of a machine that stands.

    Args:
        errors: J by policy.
        criteria: Names the references.
    """
    references = [
        name for name in (criteria.references.baseline, criteria.references.optimum) if name in errors
    ]
    others = [name for name in sorted(errors, key=errors.__getitem__) if name not in references]
    return [*references, *sorted(others, key=lambda name: name == STILL)]


def looks(policies: Sequence[str]) -> dict[str, tuple[str, tuple[float, ...]]]:
    """Color and dash of each policy; the same for the same list, so that all plots agree."""
    moving = [name for name in policies if name != STILL]
    styles = {STILL: STILL_STYLE} | {
        name: (COLORS[i % len(COLORS)], DASHES[i // len(COLORS) % len(DASHES)])
        for i, name in enumerate(moving)
    }
    return {name: styles[name] for name in policies}


def shown_at_first(order: Sequence[str]) -> list[str]:
    """The policies of :func:`in_order` that a plot shows: at most :data:`MOST_SHOWN`."""
    return list(order[:MOST_SHOWN])
