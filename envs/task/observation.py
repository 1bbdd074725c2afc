"""The environment's observation: its rows, where they lie, and what an action of 1 stands for.

``python -m motion_cueing.envs.task.observation`` prints every row as a table in Markdown.
"""

from __future__ import annotations

from .kernels.action import acceleration_scale, action_scale, velocity_scale
from .kernels.observation import (
    ADDED,
    MACHINE,
    Layout,
    ObservationOptions,
    abilities,
    ability_of,
    layout_of,
    observation_table,
)

__all__ = [
    "ADDED",
    "MACHINE",
    "Layout",
    "ObservationOptions",
    "abilities",
    "ability_of",
    "acceleration_scale",
    "action_scale",
    "layout_of",
    "observation_table",
    "velocity_scale",
]

if __name__ == "__main__":
    print(observation_table())
