"""The kernels compile for CUDA, which needs no GPU; nothing here runs on one."""

from __future__ import annotations

import pytest
import warp as wp

from motion_cueing.envs.simulator.kernels.observation import observe_forward
from motion_cueing.envs.simulator.kernels.step import reset_forward, step_kernel

from ..cuda import ptx_of

pytestmark = pytest.mark.slow

# Loops kept as loops and little optimization: the same code, faster to compile.
step_in_loops = wp.kernel(
    step_kernel,
    enable_backward=False,
    module="unique",
    module_options={"max_unroll": 4, "optimization_level": 1},
)


@pytest.mark.parametrize("kernel", [step_in_loops, reset_forward, observe_forward], ids=lambda k: k.key)
def test_a_kernel_compiles_to_ptx(kernel):
    text = ptx_of(kernel)
    assert ".entry" in text
    assert ".f64" in text
