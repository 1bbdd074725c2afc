"""The environment's id in Gymnasium's registry."""

from __future__ import annotations

from typing import Final

import gymnasium

ENVIRONMENT_ID: Final = "motion_cueing/DrivingSimulator-v0"
"""What ``gymnasium.make`` and ``gymnasium.make_vec`` know the environment by."""


def register() -> None:
    """Register the environment, once; nothing of it is imported until it is made."""
    if ENVIRONMENT_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENVIRONMENT_ID,
            entry_point="motion_cueing.envs.task.environment:DrivingSimulator",
            vector_entry_point="motion_cueing.envs.task.vector:DrivingSimulatorVector",
        )
