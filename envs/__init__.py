"""Motion base, car, perception, simulator and environment: everything that is not a policy.

Importing this package registers the environment with Gymnasium; it is imported when it is made. The version
of the distribution is ``motion_cueing.envs.__version__``: ``motion_cueing`` itself is a namespace.
"""

from importlib.metadata import version
from typing import Final

import gymnasium

from .cues import GRAVITY, CueTrace

ENVIRONMENT_ID: Final = "motion_cueing/DrivingSimulator-v0"
"""The raw task: nine accelerations at 100 Hz."""

ENVIRONMENTS: Final = {
    ENVIRONMENT_ID: {},
    "motion_cueing/Cueing-v0": {"task": "cueing"},
    "motion_cueing/CueingPreview-v0": {"task": "cueing-preview"},
}
"""What ``gymnasium.make`` and ``gymnasium.make_vec`` know the environments by, and their arguments."""

for _id, _arguments in ENVIRONMENTS.items():
    if _id not in gymnasium.registry:
        gymnasium.register(
            id=_id,
            entry_point="motion_cueing.envs.task.environment:DrivingSimulator",
            vector_entry_point="motion_cueing.envs.task.vector:DrivingSimulatorVector",
            kwargs=_arguments,
        )

__version__: str


def __getattr__(name: str) -> str:
    # Reading the metadata takes longer than the rest of the import.
    if name == "__version__":
        return version("motion-cueing-gym")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = ["ENVIRONMENT_ID", "GRAVITY", "CueTrace"]
