"""What a policy knows of the past: the car's cues through first-order low-passes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ..cues import GRAVITY, CueTrace
from ..observation import SCALES


def low_passed(drives: Sequence[CueTrace], time_constants: Sequence[float], dt: float) -> NDArray[np.float32]:
    """(samples of all drives, 6 per time constant) cues through 1 / (T s + 1), scaled as the observation's.

    Held inputs, discretised exactly: y[k] = p y[k-1] + (1 - p) u[k] with p = exp(-dt / T). Before a drive the
    car is taken to have moved as at its first sample.
    """
    return np.concatenate([_of_drive(drive, time_constants, dt) for drive in drives]).astype(np.float32)


def _of_drive(drive: CueTrace, time_constants: Sequence[float], dt: float) -> NDArray[np.float64]:
    lifted = drive.specific_force + np.array([0.0, 0.0, GRAVITY])
    cues = np.hstack([lifted / SCALES["wanted_force"], drive.angular_velocity / SCALES["wanted_rate"]])
    columns = [np.zeros((len(cues), 0))]
    for time_constant in time_constants:
        p = np.exp(-dt / time_constant)
        filtered, _ = lfilter([1.0 - p], [1.0, -p], cues, axis=0, zi=p * cues[:1])
        columns.append(filtered)
    return np.hstack(columns)
