"""Coefficients of the prediction of a car's cues for late machines, fitted to random drives.

    python -m benchmarks.cue_predictor

For each number of time steps ahead, the change of the six cues by least squares from the six cues now and
before, with the noise of a cheap inertial sensor on what is known. Writes
``baselines/compensation/predictor.safetensors`` and prints the root mean square error on other drives, over
the indifference zones of J, with the prediction and without.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save_file

from motion_cueing.baselines.compensation import CompensationOptions
from motion_cueing.baselines.compensation.cues import COEFFICIENTS, FURTHEST, PAST, CuePredictor
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import drive_seeds
from motion_cueing.envs.simulator.kernels.step import CueCost
from motion_cueing.evaluation.endurance import Endurance
from motion_cueing.evaluation.endurance.run import seeded_drives

Floats = NDArray[np.float64]

FITTED, CHECKED, DURATION = 200, 50, 60.0
FORCE_NOISE, RATE_NOISE = 0.05, math.radians(0.3)
RIDGE = 1e-6
"""Over the mean square of what is known."""


def main() -> None:
    """Fit, write and check."""
    drives = _drives(FITTED, 1)
    noise = np.repeat([FORCE_NOISE, RATE_NOISE], 3)
    rng = np.random.default_rng(0)
    signals = [_beyond_rest(drive) for drive in drives]
    known = np.concatenate([_past(s + noise * rng.standard_normal(s.shape))[:-FURTHEST] for s in signals])
    size = np.sqrt(np.mean(known**2, axis=0))
    product = known.T @ known / np.outer(size, size)
    product += RIDGE * len(known) * np.eye(len(size))
    coefficients = []
    for k in range(1, FURTHEST + 1):
        change = np.concatenate([s[k : len(s) - FURTHEST + k] - s[:-FURTHEST] for s in signals])
        coefficients.append(np.linalg.solve(product, known.T @ change / size[:, None]) / size[:, None])
    save_file({"coefficients": np.array(coefficients, dtype=np.float32)}, COEFFICIENTS)
    _check(_drives(CHECKED, 2))


def _check(drives: Sequence[CueTrace]) -> None:
    zones = np.repeat([CueCost().force, CueCost().rate], 3)
    print("| ms ahead | | f_x | f_y | f_z | w_x | w_y | w_z |\n|---|---|---|---|---|---|---|---|")
    for k in (5, 9, 12, 20):
        errors = []
        for drive in drives:
            true = _beyond_rest(drive)
            seen = _beyond_rest(CuePredictor(k, CompensationOptions()).whole(drive))
            errors.append([np.mean((one[:-k] - true[k:]) ** 2, axis=0) for one in (true, seen)])
        for name, error in zip(("now", "predicted"), np.sqrt(np.mean(errors, axis=0)), strict=True):
            print(f"| {10 * k} | {name} | {' | '.join(f'{one:.3f}' for one in error / zones)} |")


def _drives(n: int, seed: int) -> list[CueTrace]:
    return [one.cues for one in seeded_drives(Endurance(duration=DURATION), drive_seeds(n, 990 + seed))]


def _beyond_rest(cues: CueTrace) -> Floats:
    rest = [0.0, 0.0, 9.81, 0.0, 0.0, 0.0]
    return np.hstack([cues.specific_force, cues.angular_velocity]) + rest


def _past(signals: Floats) -> Floats:
    samples = np.arange(len(signals))
    return np.concatenate([signals[np.maximum(samples - k, 0)] for k in PAST], axis=1)


if __name__ == "__main__":
    main()
