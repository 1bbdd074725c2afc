"""What a washout remembers, step by step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motion_cueing.baselines.interface import Observer
from motion_cueing.envs import CueTrace
from motion_cueing.envs.platform import Platform
from motion_cueing.envs.simulator.simulator import Simulator


def memories(
    policy, cues: CueTrace, platform: Platform, gains: Mapping[str, np.ndarray] | None = None
) -> np.ndarray:
    """(steps,) the policy's memory after each step of a drive.

    ``gains`` replace the adaptive washout's own after the first step.
    """
    simulator = Simulator(platform, cues)
    simulator.reset()
    observe, state, kept = Observer(simulator), None, []
    for _ in range(len(cues) - 1):
        action, state = policy.predict(observe(), state)
        if not kept:
            for kind, values in (gains or {}).items():
                state["gains"][kind][0] = values
        kept.append(state.copy())
        simulator.step(action)
    return np.concatenate(kept)
