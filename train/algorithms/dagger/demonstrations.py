"""Drives of a controller as data to learn from: a folder of ``.npz`` files and an index.

The format is documented in docs/guides/record-demonstrations.md. A drive is written whole, then the index
that names it; so a folder is valid at any time, and an interrupted recording goes on where it stopped.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ....envs.errors import DataError, reason
from ....envs.limits import LARGEST_RESULTS, parse_json, read_arrays, read_bytes
from ....envs.simulator.kernels.observation import OBSERVATION_SIZE
from ....envs.simulator.simulator import N_AXES
from ....envs.storage import write_bytes, write_text

Floats = NDArray[np.float64]

FORMAT: Final = 2
"""Version of the format; a reader refuses others. 1 did not name the drive."""

INDEX: Final = "index.json"

_COLUMNS: Final = {
    "time": (),
    "observation": (OBSERVATION_SIZE,),
    "action": (N_AXES,),
    "force": (3,),
    "rate": (3,),
    "position": (N_AXES,),
    "velocity": (N_AXES,),
}


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A drive of n steps. Row k of the first three is what led from sample k to k + 1.

    Args:
        name: Of the drive.
        time: (n,) s.
        observation: (n, OBSERVATION_SIZE) what a policy sees, see
        ``envs.simulator.kernels.observation``; unclipped.
        action: (n, 9) accelerations of the axes, m/s^2 and rad/s^2.
        force: (n, 3) specific force of the car at the cab, m/s^2.
        rate: (n, 3) angular velocity of the car, rad/s.
        position: (n, 9) of the axes, m and rad from neutral.
        velocity: (n, 9) of the axes, m/s and rad/s.
    """

    name: str
    time: Floats
    observation: Floats
    action: Floats
    force: Floats
    rate: Floats
    position: Floats
    velocity: Floats

    def __post_init__(self) -> None:
        n = len(self.time)
        for name, tail in _COLUMNS.items():
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.shape != (n, *tail) or not np.all(np.isfinite(values)):
                raise DataError(
                    f"demonstration {self.name}: {name} must be finite, of shape {(n, *tail)}, "
                    f"found {values.shape}"
                )
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class DriveEntry:
    """What the index says about a drive.

    Args:
        name: Of the drive.
        file: In the folder.
        sha256: Of the file.
        source: Where the cues come from.
        cues: ``CueTrace.digest`` of the cues, at the time step of the drive.
        steps: Time steps.
        cue_error: J of the drive.
        perceived_cue_error: Perceived J of the drive.
        at_limit: Share of samples with any actuator at a limit.
        notes: What the controller counted.
    """

    name: str
    file: str
    sha256: str
    source: str
    cues: str
    steps: int
    cue_error: float
    perceived_cue_error: float
    at_limit: float
    notes: dict[str, str]


@dataclass(frozen=True)
class Index:
    """A folder's table of contents.

    Args:
        setting: What all drives have in common: policy, its parameters, car, machine, perception, time step.
        provenance: Command, commit, versions and time of the recording's beginning.
        drives: Those recorded, in order.
    """

    setting: dict[str, Any]
    provenance: dict[str, Any]
    drives: tuple[DriveEntry, ...] = field(default=())

    def with_drive(self, entry: DriveEntry) -> Index:
        """With one more drive; one of the same name is replaced."""
        others = [drive for drive in self.drives if drive.name != entry.name]
        return Index(self.setting, self.provenance, (*others, entry))

    def save(self, folder: Path) -> None:
        """Write the index, whole or not at all."""
        write_text(folder / INDEX, json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n")


def load_index(folder: str | Path) -> Index:
    """The index of a folder of demonstrations.

    Raises:
        DataError: there is none, it is broken, or of another format.
    """
    path = Path(folder) / INDEX
    try:
        values = parse_json(read_bytes(path, LARGEST_RESULTS).decode("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    except ValueError as error:
        raise DataError(f"{path}: not JSON ({error})") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise DataError(
            f"{path}: not an index of demonstrations of format {FORMAT}; record them into another folder"
        )
    try:
        drives = tuple(DriveEntry(**drive) for drive in values["drives"])
        return Index(dict(values["setting"]), dict(values["provenance"]), drives)
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"{path}: an entry is missing or unknown ({error})") from None


def save_drive(folder: Path, file: str, drive: Demonstration) -> str:
    """Write a drive, whole or not at all; returns the file's SHA-256."""
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {name: getattr(drive, name) for name in _COLUMNS}
    np.savez_compressed(buffer, **arrays)
    content = buffer.getvalue()
    write_bytes(folder / file, content)
    return hashlib.sha256(content).hexdigest()


def is_kept(folder: Path, entry: DriveEntry) -> bool:
    """Whether the file of a drive is there, to the bit."""
    try:
        return hashlib.sha256((folder / entry.file).read_bytes()).hexdigest() == entry.sha256
    except OSError:
        return False


def load_demonstrations(folder: str | Path) -> Iterator[Demonstration]:
    """The drives of a folder, one after another.

    Raises:
        DataError: the index or a drive is missing, damaged or of another format.
    """
    for entry in load_index(folder).drives:
        path = Path(folder) / entry.file
        if not is_kept(Path(folder), entry):
            raise DataError(f"{path}: missing or damaged; record it anew with motion-cueing demonstrate")
        try:
            arrays = read_arrays(path)
            columns = {name: arrays[name] for name in _COLUMNS}
        except (KeyError, DataError) as error:
            raise DataError(f"{path}: not a demonstration ({error})") from None
        yield Demonstration(entry.name, **columns)
