"""Motion sickness incidence by the 6-DOF subjective vertical conflict model (Inoue, Liu and Wada).

The model compares the vertical that the vestibular organs sense with the vertical that an internal model
expects. The difference is the conflict. Conflict that lasts makes a share of people sick. The model has no
eyes: it is that of people who see nothing of the motion.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np
import warp as wp

from ...envs.arrays import FLOAT, real, vec3
from ...envs.cues import GRAVITY
from ...envs.settings import Positive, configuration
from ..trajectory import Floats
from .kernels import Model, repeat_drives

TIME_STEP: Final = 0.01
"""Euler step of the model, s. Drives of another step are interpolated."""


@configuration
class ConflictModel:
    """Parameters of the model, as its authors publish them.

    Args:
        of_acceleration: Ka, share of the acceleration that the internal model knows.
        of_rate: Kw, share of the angular velocity that it knows.
        rate_feedback: Kwc, feedback of the conflict of angular velocity.
        vertical_feedback: Kvc, feedback of the integral of the conflict of the vertical, 1/s.
        acceleration_feedback: Kac, feedback of the conflict of acceleration.
        canal_long: td, long time constant of the canals, s.
        canal_adaptation: ta, adaptation of the canals, s.
        vertical_time: tau, time constant of the sensed vertical, s.
        half_conflict: b, conflict at which half of the largest share become sick, m/s^2.
        incidence_time: tI, time constant of sickness, s.
        largest: P, largest share of people who become sick, %.
    """

    of_acceleration: float = 0.1
    of_rate: float = 0.1
    rate_feedback: float = 10.0
    vertical_feedback: Positive = 5.0
    acceleration_feedback: float = 0.5
    canal_long: Positive = 7.0
    canal_adaptation: Positive = 190.0
    vertical_time: Positive = 2.0
    half_conflict: Positive = 0.5
    incidence_time: Positive = 720.0
    largest: Positive = 85.0


@dataclasses.dataclass(frozen=True, eq=False)
class HeadMotion:
    """The motion of a head.

    The model is the same in any right-handed frame: in this project's (z down) as in that of its authors
    (z up).

    Args:
        force: (n, 3) specific force, m/s^2.
        rate: (n, 3) angular velocity, rad/s.
        vertical: (3,) specific force at rest in the attitude of the first sample.
    """

    force: Floats
    rate: Floats
    vertical: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)


def sickness_incidence(
    motions: Sequence[HeadMotion], dt: float, exposure: float, model: ConflictModel | None = None
) -> Floats:
    """(k,) share of people who vomit after a motion that is repeated for a while, %.

    The motion begins after a long rest, which the model's initial state is. At each repetition the attitude
    is that of the first sample again; what the organs sense goes on.

    Args:
        motions: k motions.
        dt: Time step, s.
        exposure: How long each is repeated, s.
        model: Parameters.
    """
    drives = [(_at_time_step(one.force, dt), _at_time_step(one.rate, dt)) for one in motions]
    lengths = np.array([len(force) for force, _ in drives], dtype=np.int32)
    rows = np.zeros((2, len(drives), int(lengths.max()), 3), dtype=FLOAT)
    for k, pair in enumerate(drives):
        rows[:, k, : lengths[k]] = pair
    values = Model()
    for name, value in dataclasses.asdict(model or ConflictModel()).items():
        setattr(values, name, value)
    vertical = np.array([one.vertical for one in motions], dtype=FLOAT)
    incidence = wp.zeros(len(drives), dtype=real, device="cpu")
    wp.launch(
        repeat_drives,
        dim=len(drives),
        inputs=[
            values,
            wp.array(rows[0], dtype=vec3, device="cpu"),
            wp.array(rows[1], dtype=vec3, device="cpu"),
            wp.array(lengths, dtype=int, device="cpu"),
            wp.array(vertical, dtype=vec3, device="cpu"),
            round(exposure / TIME_STEP),
            TIME_STEP,
        ],
        outputs=[incidence],
        device="cpu",
    )
    return np.asarray(incidence.numpy(), dtype=np.float64)


def _at_time_step(values: Floats, dt: float) -> Floats:
    """(n, 3) values at the time step of the model."""
    if abs(dt / TIME_STEP - 1.0) <= 1e-6:
        return values
    time = dt * np.arange(len(values))
    wanted = TIME_STEP * np.arange(int(time[-1] / TIME_STEP + 1e-6) + 1)
    return np.column_stack([np.interp(wanted, time, column) for column in values.T])
