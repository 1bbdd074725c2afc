"""The folder of a training: configuration, sessions, log, checkpoints and agents.

A checkpoint is one file with a checksum, read without executing anything in it. A training goes on from the
last.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from ..envs import provenance
from ..envs.errors import ConfigurationError, DataError, reason
from ..envs.settings import load, save
from ..envs.storage import check_folder, replacing, write_text
from .config import TrainingConfig
from .registry import State

_MAGIC: Final = b"motion-cueing checkpoint 1\n"
_SUFFIX: Final = ".checkpoint"
_ARRAY: Final = "npy"


def checkpoint_file(folder: Path, steps: int) -> Path:
    """Where the checkpoint after so many actions lies; names sort by it."""
    return folder / f"step-{steps:012d}{_SUFFIX}"


def checkpoints_in(folder: Path) -> list[Path]:
    """The checkpoints in a folder, the oldest first."""
    return sorted(path for path in folder.glob(f"*{_SUFFIX}") if re.fullmatch(r"step-\d+", path.stem))


def write_checkpoint(path: Path, state: State) -> None:
    """Write a state, whole or not at all."""
    payload = io.BytesIO()
    torch.save(_packed(state), payload)
    data = payload.getbuffer()
    with replacing(path, "wb") as file:
        file.write(_MAGIC + hashlib.sha256(data).digest())
        file.write(data)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """A state that :func:`write_checkpoint` wrote.

    Raises:
        DataError: the file is missing, is none, or is damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror or error})") from None
    head = len(_MAGIC) + hashlib.sha256().digest_size
    if not data.startswith(_MAGIC):
        raise DataError(f"{path}: not a checkpoint of this version; {_advice(path)}")
    if hashlib.sha256(data[head:]).digest() != data[len(_MAGIC) : head]:
        raise DataError(f"{path}: damaged, its checksum does not match; {_advice(path)}")
    state: dict[str, Any] = _unpacked(torch.load(io.BytesIO(data[head:]), weights_only=True))
    return state


def _advice(path: Path) -> str:
    others = [other for other in checkpoints_in(path.parent) if other != path]
    if others:
        return f"delete it to go on from {others[-1].name}"
    return "there is no earlier one, begin anew"


def _packed(value: Any) -> Any:
    """Arrays, also those of structs, as the bytes of their own format: PyTorch takes only plain ones."""
    if isinstance(value, Mapping):
        return {name: _packed(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        payload = io.BytesIO()
        np.save(payload, value, allow_pickle=False)
        return {_ARRAY: torch.frombuffer(bytearray(payload.getvalue()), dtype=torch.uint8)}
    if value is not None and not isinstance(value, bool | int | float | str | torch.Tensor):
        raise ConfigurationError(
            f"checkpoints: a {type(value).__name__} cannot be kept in one, such as the memory of predictive "
            "control under an agent; set checkpoints.every to 0, or take another base"
        )
    return value


def _unpacked(value: Any) -> Any:
    if isinstance(value, dict) and value.keys() == {_ARRAY}:
        return np.load(io.BytesIO(value[_ARRAY].numpy().tobytes()), allow_pickle=False)
    if isinstance(value, dict):
        return {name: _unpacked(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_unpacked(item) for item in value]
    return value


_CONFIG: Final = "config.yaml"
_RECORD: Final = "run.json"
_DEFAULT_PARENT: Final = Path("runs")


class RunFolder:
    """A training's folder."""

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        self.path, self.config = path, config
        self.sessions: list[dict[str, Any]] = []

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig) -> RunFolder:
        """The folder of a new training, made when it begins; by default the next of ``runs/ALGO-1``, -2..."""
        return cls(free_folder(path, config.algo), config)

    @classmethod
    def open(cls, path: Path) -> RunFolder:
        """The folder of a training that was begun.

        Raises:
            DataError: there is none, or a file of it is broken.
        """
        if not (path / _CONFIG).exists():
            raise DataError(f"--out {path}: no training was begun there ({_CONFIG} is missing)")
        run = cls(path, load(TrainingConfig, path / _CONFIG))
        try:
            run.sessions = list(json.loads((path / _RECORD).read_text(encoding="utf-8"))["sessions"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path / _RECORD}: cannot be read ({reason(error)})") from None
        return run

    @classmethod
    def take_up(cls, path: Path, config: TrainingConfig) -> RunFolder:
        """The folder of a training that may have been begun: of a process that died, nobody knows."""
        run = cls.open(path) if (path / _RECORD).exists() else cls(path, config)
        run.config = config
        return run

    @property
    def checkpoints(self) -> Path:
        """The folder of checkpoints."""
        return self.path / "checkpoints"

    @property
    def best_agent(self) -> Path:
        """The agent that was best on the validation drives."""
        return self.path / "best.safetensors"

    @property
    def final_agent(self) -> Path:
        """The agent at the end."""
        return self.path / "final.safetensors"

    def begin(self, steps: int) -> None:
        """Note a start: configuration, command, versions, hardware, commit."""
        self.checkpoints.mkdir(parents=True, exist_ok=True)
        save(self.config, self.path / _CONFIG)
        session = {
            "command": provenance.command_line(),
            "begun": provenance.now(),
            "steps": steps,
            "versions": provenance.versions(),
            "hardware": provenance.hardware(self.config.device),
            "commit": provenance.commit(),
        }
        self.sessions.append(session)
        record = {"algo": self.config.algo, "seed": self.config.seed, "sessions": self.sessions}
        write_text(self.path / _RECORD, json.dumps(record, indent=2) + "\n")

    def changed_versions(self) -> list[str]:
        """What is installed in another version than in the first session."""
        first = self.sessions[0]["versions"] if self.sessions else {}
        now = provenance.versions()
        return [
            f"{name} was {was}, is {now.get(name)}" for name, was in first.items() if now.get(name) != was
        ]

    def extend(self, steps: int) -> None:
        """Train to another number of steps than was chosen at first."""
        self.config = replace(self.config, steps=steps)

    def save_checkpoint(self, steps: int, state: State) -> Path:
        """Write a checkpoint, and remove the oldest beyond the number kept."""
        path = checkpoint_file(self.checkpoints, steps)
        write_checkpoint(path, state)
        for old in checkpoints_in(self.checkpoints)[: -self.config.checkpoints.keep]:
            old.unlink()
        return path

    def last_checkpoint(self) -> dict[str, Any] | None:
        """The latest checkpoint's state; None where there is none yet."""
        checkpoints = checkpoints_in(self.checkpoints)
        return read_checkpoint(checkpoints[-1]) if checkpoints else None


def is_training(path: Path) -> bool:
    """Whether a folder is that of one training."""
    return (path / _RECORD).exists()


def free_folder(path: Path | None, name: str) -> Path:
    """A folder without anything in it: the one given, or the next of ``runs/NAME-1``, -2...

    Raises:
        ConfigurationError: there is something in the one given.
    """
    if path is None:
        number = 1
        while (_DEFAULT_PARENT / f"{name}-{number}").exists():
            number += 1
        path = _DEFAULT_PARENT / f"{name}-{number}"
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigurationError(f"--out {path}: there is something already; name a new folder")
    check_folder("--out", path)
    return path
