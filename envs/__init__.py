"""Motion base, car, perception, simulator and environment: everything that is not a policy.

Importing this package registers the environments with Gymnasium. The version of the distribution is
``motion_cueing.envs.__version__``: ``motion_cueing`` itself is a namespace.
"""

from importlib.metadata import version

from .cues import GRAVITY, CueTrace
from .registration import ENVIRONMENT_ID, register

register()

__version__: str


def __getattr__(name: str) -> str:
    # Reading the metadata takes longer than the rest of the import.
    if name == "__version__":
        return version("motion-cueing-gym")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = ["ENVIRONMENT_ID", "GRAVITY", "CueTrace"]
