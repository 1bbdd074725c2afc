"""Motion base, car, perception, simulator and environment: everything that is not a policy.

Importing this package registers the environment with Gymnasium; it is imported when it is made. The version
of the distribution is ``motion_cueing.envs.__version__``: ``motion_cueing`` itself is a namespace.
"""

from importlib.metadata import version
from typing import Final

import gymnasium

from .cues import GRAVITY, CueTrace

ENVIRONMENT_ID: Final = "motion_cueing/DrivingSimulator-v0"
"""What ``gymnasium.make`` and ``gymnasium.make_vec`` know the environment by."""

if ENVIRONMENT_ID not in gymnasium.registry:
    gymnasium.register(
        id=ENVIRONMENT_ID,
        entry_point="motion_cueing.envs.task.environment:DrivingSimulator",
        vector_entry_point="motion_cueing.envs.task.vector:DrivingSimulatorVector",
    )

__version__: str


def __getattr__(name: str) -> str:
    # Reading the metadata takes longer than the rest of the import.
    if name == "__version__":
        return version("motion-cueing-gym")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = ["ENVIRONMENT_ID", "GRAVITY", "CueTrace"]
