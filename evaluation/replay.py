"""Drives that were driven already, such as those of `motion-cueing serve`, in an evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from .suite import CueSource, labels
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..envs.platform import Platform

DRIVEN: Final = "driven"
"""What the recorded drive is called beside policies that drive the same cues."""


def load_drives(files: Sequence[Path], platform: Platform) -> dict[str, Trajectory]:
    """Recorded drives by label: the names of their files.

    Args:
        files: Saved trajectories.
        platform: The machine they must have been driven on.

    Raises:
        DataError: a file is missing, broken or no trajectory.
        ConfigurationError: a drive is of another machine.
    """
    names = labels([str(file) for file in files], [file.stem for file in files])
    drives = {label: Trajectory.load(name) for name, label in names.items()}
    for label, drive in drives.items():
        if drive.platform != platform.name:
            raise ConfigurationError(
                f"{label} was driven on the motion base {drive.platform!r}, not {platform.name!r}; "
                "name it with --platform"
            )
    return drives


def cue_sources(drives: Mapping[str, Trajectory]) -> dict[str, CueSource]:
    """The cues of each drive, to drive them again."""
    return {label: partial(cues_of, drive, label) for label, drive in drives.items()}


def cues_of(drive: Trajectory, name: str) -> CueTrace:
    """The cues that were wanted in a drive."""
    return CueTrace(name, drive.time, drive.f_wanted, drive.w_wanted, source=f"as driven by {drive.policy}")
