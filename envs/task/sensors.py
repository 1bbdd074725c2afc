"""Sensors of the car: what a policy sees of the car's cues, with the errors of real instruments.

Errors are drawn once for each drive of the library, so that an episode is the same alone, in a batch, in an
unroll and after a restore. The reward knows the true cues.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.signal import butter, sosfilt, sosfilt_zi

from ..cues import CueTrace
from ..settings import NonNegative, Positive, check_range, configuration

Floats = NDArray[np.float64]


@configuration
class CarSensors:
    """Errors of the car's cues as an agent sees them; none by default. The order is that of the chain.

    Sizes are upper bounds: each drive draws its own from 0 up to them.

    Args:
        low_pass: Range of the cutoff frequency of a second-order low-pass, Hz; None for no filter.
        force_bias: Largest bias of each axis of the specific force, m/s^2.
        rate_bias: Largest bias of each axis of the angular velocity, rad/s.
        force_noise: Standard deviation of white noise of the specific force, m/s^2.
        rate_noise: Standard deviation of white noise of the angular velocity, rad/s.
        force_step: Quantization of the specific force, m/s^2.
        rate_step: Quantization of the angular velocity, rad/s.
        dropout: Share of time in which the last cue is held.
        dropout_time: Mean duration of a drop-out, s.
    """

    low_pass: tuple[Positive, Positive] | None = None
    force_bias: NonNegative = 0.0
    rate_bias: NonNegative = 0.0
    force_noise: NonNegative = 0.0
    rate_noise: NonNegative = 0.0
    force_step: NonNegative = 0.0
    rate_step: NonNegative = 0.0
    dropout: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    dropout_time: Positive = 0.1

    def __post_init__(self) -> None:
        if self.low_pass is not None:
            check_range("low_pass", self.low_pass)

    @property
    def perfect(self) -> bool:
        """Whether the cues are seen as they are."""
        sizes = [
            getattr(self, item.name)
            for item in dataclasses.fields(self)
            if item.name not in ("low_pass", "dropout_time")
        ]
        return self.low_pass is None and max(sizes) == 0.0


_SENSOR_STREAM: Final = 4


def sensed_drives(drives: Sequence[CueTrace], sensors: CarSensors, seed: int) -> list[CueTrace]:
    """The drives as the car's sensors give them; the drives themselves where these are perfect.

    Args:
        drives: Of a library.
        sensors: Their errors.
        seed: Of the library.
    """
    if sensors.perfect:
        return list(drives)
    return [
        _sensed(drive, sensors, np.random.default_rng((seed, _SENSOR_STREAM, number)))
        for number, drive in enumerate(drives)
    ]


def _sensed(drive: CueTrace, sensors: CarSensors, rng: np.random.Generator) -> CueTrace:
    cues = np.hstack((drive.specific_force, drive.angular_velocity))
    per_axis = np.repeat(
        [
            (sensors.force_bias, sensors.force_noise, sensors.force_step),
            (sensors.rate_bias, sensors.rate_noise, sensors.rate_step),
        ],
        3,
        axis=0,
    )
    # Everything is drawn, whatever it is for, so that one kind of error leaves the others as they were.
    cutoff = rng.uniform(*(sensors.low_pass or (1.0, 1.0)))
    bias = per_axis[:, 0] * rng.uniform(-1.0, 1.0, 6)
    spread, step = per_axis[:, 1] * rng.uniform(), per_axis[:, 2] * rng.uniform()
    share = sensors.dropout * rng.uniform()
    noise, chance = rng.normal(size=cues.shape), rng.uniform(size=len(cues))
    if sensors.low_pass is not None:
        cues = _filtered(cues, min(cutoff, 0.45 / drive.dt), drive.dt)
    cues = cues + bias + spread * noise
    cues = np.where(step > 0.0, np.round(cues / np.where(step > 0.0, step, 1.0)) * step, cues)
    cues = cues[_held(chance, share, sensors.dropout_time, drive.dt)]
    return dataclasses.replace(drive, specific_force=cues[:, :3], angular_velocity=cues[:, 3:])


def _filtered(cues: Floats, cutoff: float, dt: float) -> Floats:
    """Second-order Butterworth low-pass, settled at the first sample."""
    sos: Any = butter(2, cutoff, fs=1.0 / dt, output="sos")
    start = sosfilt_zi(sos)[:, :, None] * cues[:1]
    return np.asarray(sosfilt(sos, cues, axis=0, zi=start)[0])


def _held(chance: Floats, share: float, duration: float, dt: float) -> NDArray[np.intp]:
    """Sample shown at each sample: the last good one, with drop-outs as a chain of two states."""
    recover = min(dt / duration, 1.0)
    fail = min(recover * share / (1.0 - share), 1.0)
    shown, last, out = np.zeros(len(chance), dtype=np.intp), 0, False
    for k, number in enumerate(chance.tolist()):
        out = number >= recover if out else number < fail
        if not out or k == 0:
            last = k
        shown[k] = last
    return shown
