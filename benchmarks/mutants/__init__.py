"""Wrong washouts and wrong cues in the paper's cases, and the statements that notice each of them.

    python -m benchmarks.mutants
    python -m benchmarks.mutants --cases EST1 LC2 --all

A *mutant* is one case with one fault: a block of its washout opened, reversed, or scaled by 0.8 or 1.25; a
limit of tilt coordination off; or a cue of the cab absent, reversed or scaled. A mutant *survives* where
every statement still passes. Its change is that of its cues, see :func:`change`. No survivor may change a cue
by more than :data:`LARGEST`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
import warp as wp

from motion_cueing.baselines.washout.classical.family import (
    ClassicalWashout,
    HighPass,
    WashoutParameters,
    load_washout,
)
from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.paper.statements import CASES, Drives, all_checks
from motion_cueing.evaluation.rollout import rollout
from motion_cueing.evaluation.trajectory import Trajectory

from .kernels import KERNELS, Mutated

FACTORS: Final = {"reversed": -1.0, "x 0.8": 0.8, "x 1.25": 1.25}
LARGEST: Final = 0.2
"""Greatest change of a cue that a surviving mutant may have."""
_FLOOR: Final = np.array([0.02, 0.02, 0.02, 0.002, 0.002, 0.002])
"""Changes of specific force (m/s^2) and of rates (rad/s) that nobody feels.

An eighth of a threshold or less. Thresholds are 0.17 m/s^2 and 2.6 deg/s (docs/explanation/perception.md).
"""
AXES: Final = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
_OPEN: Final = HighPass()


@dataclass(frozen=True)
class Mutant:
    """A case with one fault.

    Args:
        case: EST1 to LC2.
        block: What is wrong.
        how: How it is wrong.
        parameters: The washout's set.
        factors: Factors on the outputs of blocks, by name.
        cues: (6,) factors on the cab's specific force, gravity apart, and on its rates.
    """

    case: str
    block: str
    how: str
    parameters: WashoutParameters
    factors: Mapping[str, float] = field(default_factory=dict)
    cues: tuple[float, ...] | None = None

    @property
    def name(self) -> str:
        """As the table shows it."""
        return f"{self.case} {self.block} {self.how}"


class MutantWashout(ClassicalWashout):
    """The washout of a mutant."""

    def __init__(self, mutant: Mutant) -> None:
        platform = get_platform("paper")
        super().__init__(mutant.parameters, platform.cab)
        self.family = replace(self.family, kernels=KERNELS)
        values = KERNELS.values(mutant, self.cab, self.time_step)
        self._kernel_parameters = wp.array([values], dtype=Mutated, device="cpu")
        self._buffers = {}


def _set(values: tuple[Any, ...], index: int, value: Any) -> tuple[Any, ...]:
    return (*values[:index], value, *values[index + 1 :])


def _filters(p: WashoutParameters) -> Iterator[tuple[str, str, WashoutParameters]]:
    """Each high-pass opened, and its frequency scaled."""
    for name, labels in {"hpr": ("roll", "pitch", "yaw"), "hps": "xy", "hpi": "xyz"}.items():
        for k, label in enumerate(labels):
            blocks = getattr(p, name)
            if blocks[k].order:
                yield f"{name} {label}", "opened", replace(p, **{name: _set(blocks, k, _OPEN)})
                for factor in (0.8, 1.25):
                    changed = replace(blocks[k], frequency=factor * blocks[k].frequency)
                    yield f"{name} {label}", f"w x {factor}", replace(p, **{name: _set(blocks, k, changed)})


def _tilt(p: WashoutParameters) -> Iterator[tuple[str, str, WashoutParameters]]:
    """Tilt coordination off, its low-pass opened, its limits off and scaled."""
    tilt = p.tilt
    if tilt is None:
        return
    yield "tilt", "off", replace(p, tilt=None)
    low_pass = replace(tilt.low_pass, frequency=100.0)
    yield "tilt low-pass", "opened", replace(p, tilt=replace(tilt, low_pass=low_pass))
    yield "tilt limits", "off", replace(p, tilt=replace(tilt, rate=1e3, acceleration=1e3))
    yield "tilt rate limit", "off", replace(p, tilt=replace(tilt, rate=1e3))
    for factor in (0.8, 1.25):
        low_pass = replace(tilt.low_pass, frequency=factor * tilt.low_pass.frequency)
        yield "tilt low-pass", f"w x {factor}", replace(p, tilt=replace(tilt, low_pass=low_pass))
        yield "tilt rate limit", f"x {factor}", replace(p, tilt=replace(tilt, rate=factor * tilt.rate))


def _split(p: WashoutParameters) -> Iterator[tuple[str, str, WashoutParameters]]:
    """Turntable and carriage: without them, or with them; the filter that shares the motion."""
    yield "split", "other", replace(p, turntable_share=1.0 - p.turntable_share)
    if p.lpc is not None:
        yield "lpc", "opened", replace(p, lpc=None)
        for factor in (0.8, 1.25):
            yield "lpc", f"w x {factor}", replace(p, lpc=replace(p.lpc, frequency=factor * p.lpc.frequency))


def _scales(p: WashoutParameters) -> Iterator[tuple[str, str, WashoutParameters]]:
    """Force and rates at the input absent, reversed, scaled; all of them, and axis by axis."""
    for name, labels in {"force_scale": "xyz", "rate_scale": ("roll", "pitch", "yaw")}.items():
        for how, factor in {"absent": 0.0, **FACTORS}.items():
            scale = getattr(p, name)
            yield name, how, replace(p, **{name: tuple(factor * v for v in scale)})
            for k, label in enumerate(labels):
                yield f"{name} {label}", how, replace(p, **{name: _set(scale, k, factor * scale[k])})
    yield "force_scale", "x 0.9", replace(p, force_scale=tuple(0.9 * v for v in p.force_scale))
    yield "rate_scale yaw", "x 0.1", replace(p, rate_scale=_set(p.rate_scale, 2, 0.1 * p.rate_scale[2]))


def mutants(case: str) -> list[Mutant]:
    """Every mutant of a case."""
    p = load_washout(CASES[case][1])
    found = [Mutant(case, *mutant) for kinds in (_scales, _filters, _tilt, _split) for mutant in kinds(p)]
    outputs = ["hps_x", "hps_y", "hps_z", "hpr_roll", "hpr_pitch", "hpr_yaw"]
    outputs += ["tilt"] * (p.tilt is not None) + ["lpc"] * (p.lpc is not None)
    outputs += ["turntable"] * (p.turntable_share > 0.0)
    found += [Mutant(case, f"output of {o}", how, p, {o: k}) for o in outputs for how, k in FACTORS.items()]
    for k, axis in enumerate(AXES):
        for how, factor in {"absent": 0.0, **FACTORS}.items():
            factors = _set((1.0,) * 6, k, factor)
            found.append(Mutant(case, f"cue {axis}", how, p, cues=factors))
    for axes, how, factor in (
        ((0, 1, 2), "absent", 0.0),
        ((0, 1, 2), "reversed", -1.0),
        ((0, 1, 2), "x 0.9", 0.9),
        ((5,), "x 0.1", 0.1),
    ):
        factors = tuple(factor if k in axes else 1.0 for k in range(6))
        found.append(Mutant(case, "cue force" if len(axes) > 1 else "cue w_z", how, p, cues=factors))
    return found


def drive(mutant: Mutant, original: Trajectory) -> Trajectory:
    """The drive of a mutant.

    Perceived cues of scaled cues are scaled as well: perception is linear.
    """
    if mutant.cues is None:
        cues = get_maneuver(CASES[mutant.case][0]).drive(get_car("sedan"))
        return rollout(MutantWashout(mutant), cues, get_platform("paper"))
    force, rate = np.split(np.array(mutant.cues), 2)
    rest = np.array([0.0, 0.0, -GRAVITY])
    changed = {name: rest + force * (getattr(original, name) - rest) for name in _FORCES}
    changed |= {name: rate * getattr(original, name) for name in _RATES}
    return replace(original, **changed)


_FORCES: Final = ("f_simulator", "head_f_simulator", "perceived_f_simulator")
_RATES: Final = ("w_simulator", "perceived_w_simulator")


def change(original: Trajectory, mutated: Trajectory) -> tuple[float, str]:
    """The largest change of a cue, and its axis.

    It is the rms of the difference over the rms of the cue, the car's or the cab's, whichever is larger. A
    change that nobody feels counts as none.
    """

    def rms(values: Any) -> Any:
        return np.sqrt(np.mean(values**2, axis=0))

    def cues(t: Trajectory, whose: str) -> Any:
        force = getattr(t, f"f_{whose}") + np.array([0.0, 0.0, GRAVITY])
        return np.hstack([force, getattr(t, f"w_{whose}")])

    simulator = cues(original, "simulator")
    size = np.maximum(rms(simulator), rms(cues(original, "reference")))
    difference = rms(cues(mutated, "simulator") - simulator)
    changes = np.where(difference > _FLOOR, difference / np.maximum(size, _FLOOR), 0.0)
    return float(changes.max()), AXES[int(changes.argmax())]


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant.

    Args:
        mutant: The mutant.
        change: The largest change of a cue.
        axis: Where.
        noticed: The statements that fail.
    """

    mutant: Mutant
    change: float
    axis: str
    noticed: tuple[str, ...]

    @property
    def wanted(self) -> bool:
        """Whether some statement notices it, or nobody could."""
        return bool(self.noticed) or self.change <= LARGEST


def judge(mutant: Mutant, drives: Drives) -> Verdict:
    """Drive a mutant and measure the statements with it."""
    original = drives[mutant.case]
    try:
        mutated = drive(mutant, original)
    except Exception as error:  # It left the machine's range: that is noticed.
        return Verdict(mutant, np.inf, "", (f"{type(error).__name__}: {error}",))
    failed = [c for c in all_checks({**drives, mutant.case: mutated}) if not c.set_up and not c.passed]
    return Verdict(mutant, *change(original, mutated), tuple(f"{c.case} {c.quantity}" for c in failed))
