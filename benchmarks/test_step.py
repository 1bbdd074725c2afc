"""One step through Python: the kernel against the NumPy reference, alone and in batches, on one core.

``extra_info`` carries what the report needs: environments a call, steps a call, the kind of code.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from motion_cueing.envs.simulator.simulator import Simulator

from .workloads import commands, kernel, reference, repeated

SIZES = [1, 64, 1024]


def describe(benchmark: Any, case: str, code: str, environments: int, steps: int = 1, **more: float) -> None:
    benchmark.group = case
    benchmark.extra_info.update(code=code, environments=environments, steps=steps, **more)


@pytest.mark.parametrize("n", SIZES)
def test_kernel(benchmark, n):
    batch = kernel(n)
    describe(benchmark, f"step of {n}", "kernel", n, state_bytes=state_bytes(batch))
    benchmark(repeated(batch.step, commands(n)))
    assert not batch.state["limits"].any()


@pytest.mark.parametrize("n", SIZES)
def test_reference(benchmark, n):
    batch = reference(n)
    describe(benchmark, f"step of {n}", "NumPy", n)
    benchmark(repeated(batch.step, commands(n)))
    assert np.isfinite(batch.state.setpoint.position).all()


@pytest.mark.parametrize("n", [1, 1024])
def test_kernel_at_its_limits(benchmark, n):
    batch = kernel(n)
    describe(benchmark, f"step of {n}, at limits", "kernel", n)
    benchmark(repeated(batch.step, commands(n, scale=20.0)))


@pytest.mark.parametrize("n", [1, 1024])
def test_reference_at_its_limits(benchmark, n):
    batch = reference(n)
    describe(benchmark, f"step of {n}, at limits", "NumPy", n)
    benchmark(repeated(batch.step, commands(n, scale=20.0)))


def test_kernel_unchecked(benchmark):
    # What a policy in a kernel of its own pays: commands are already in the array.
    batch = kernel(1024)
    describe(benchmark, "step of 1024, commands in place", "kernel", 1024)
    benchmark(batch.advance)


def test_kernel_on_two_threads(benchmark):
    # Launches release the interpreter's lock, so two halves of a batch can run side by side.
    halves = [kernel(512), kernel(512)]
    describe(benchmark, "step of 2 x 512 on two threads", "kernel", 1024)
    with ThreadPoolExecutor(2) as pool:
        benchmark(lambda: list(pool.map(lambda half: half.advance(), halves)))


def state_bytes(batch: Simulator) -> float:
    """Bytes a batched environment holds: both copies of its state and delay line, and its command."""
    delay_line = batch.delay_array.strides[0]
    return float(2 * (batch.state_array.strides[0] + delay_line) + batch.action_array.strides[0])
