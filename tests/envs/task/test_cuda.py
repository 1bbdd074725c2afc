"""The environment's kernels compile for CUDA, which needs no GPU; nothing here runs on one.

The step that ``play`` has between its parts is compiled by ``tests/envs/simulator/test_cuda.py``.
"""

from __future__ import annotations

import pytest
import warp as wp

from motion_cueing.envs.arrays import vec9
from motion_cueing.envs.platform.kernels.step import Machine
from motion_cueing.envs.simulator.kernels.step import State
from motion_cueing.envs.task.kernels.episode import Arrays, Rules, commanded, forget, judge, look

from ..cuda import ptx_of


@wp.kernel(enable_backward=False, module="unique")
def act_and_judge(
    rules: Rules,
    a: Arrays,
    machines: wp.array(dtype=Machine),
    state: wp.array(dtype=State),
    acceleration: wp.array(dtype=vec9),
):
    i = wp.tid()
    acceleration[i] = commanded(rules, a, 0, state[i], i, 1)
    judge(rules, a, machines[0], state[i], i, 1)


@pytest.mark.parametrize("kernel", [act_and_judge, look, forget], ids=lambda k: k.key)
def test_a_kernel_compiles_to_ptx(kernel):
    assert ".entry" in ptx_of(kernel)
