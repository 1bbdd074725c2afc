"""The washout's blocks, opened to NumPy: a whole signal in, a whole signal out."""

from __future__ import annotations

import numpy as np
import warp as wp

from motion_cueing.baselines.washout.kernels.blocks import (
    HighPassParameters,
    high_pass,
    integrated,
    limited_tilt,
    low_pass,
)
from motion_cueing.envs.arrays import real, vec2, vec3

DT = 0.01

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _high_pass(
    block: HighPassParameters, dt: real, u: wp.array(dtype=real), out: wp.array(dtype=vec3)
) -> None:
    s = vec2()
    for k in range(u.shape[0]):
        a = high_pass(block, s[0], s[1], u[k], dt)
        s = integrated(s[0], s[1], a, dt)
        out[k] = vec3(s[0], s[1], a)


@wp.kernel
def _low_pass(w: real, damping: real, dt: real, u: wp.array(dtype=real), out: wp.array(dtype=vec3)) -> None:
    s = vec2()
    for k in range(u.shape[0]):
        a = low_pass(w, damping, s[0], s[1], u[k], dt)
        s = integrated(s[0], s[1], a, dt)
        out[k] = vec3(s[0], s[1], a)


@wp.kernel
def _tilt(limits: vec2, dt: real, target: wp.array(dtype=vec2), out: wp.array(dtype=vec3)) -> None:
    s = vec2()
    for k in range(target.shape[0]):
        a = limited_tilt(s[0], s[1], target[k][0], target[k][1], real(10.0), limits[0], limits[1], dt)
        s = integrated(s[0], s[1], a, dt)
        out[k] = vec3(s[0], s[1], a)


def run_high_pass(order: int, frequency: float, damping: float, u: np.ndarray) -> np.ndarray:
    """(n, 3) position, velocity and acceleration (the output) of the block driven by u (n,)."""
    block = HighPassParameters()
    block.order, block.frequency, block.damping = order, frequency, damping
    return _run(_high_pass, [block], wp.array(u, dtype=real))


def run_low_pass(frequency: float, damping: float, u: np.ndarray) -> np.ndarray:
    """(n, 3) position (the output), velocity and acceleration of the block driven by u (n,)."""
    return _run(_low_pass, [frequency, damping], wp.array(u, dtype=real))


def run_tilt(rate: float, acceleration: float, target: np.ndarray, target_rate: np.ndarray) -> np.ndarray:
    """(n, 3) angle, rate and acceleration of a limited tilt along a target (n,)."""
    pairs = np.column_stack([target, target_rate])
    return _run(_tilt, [vec2(rate, acceleration)], wp.array(pairs, dtype=vec2))


def _run(kernel, first: list, u) -> np.ndarray:
    out = wp.zeros(len(u), dtype=vec3, device="cpu")
    wp.launch(kernel, 1, inputs=[*first, DT, u], outputs=[out], device="cpu")
    return out.numpy().astype(float)
