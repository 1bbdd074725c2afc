"""The folder of a training: configuration, provenance, log, checkpoints and agents."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ..envs.errors import ConfigurationError, DataError
from ..envs.settings import load, save
from ..envs.storage import write_text
from ..envs.targets import check_folder
from . import provenance
from .checkpoint import checkpoint_file, checkpoints_in, read_checkpoint, write_checkpoint
from .config import TrainingConfig
from .learner import State

_CONFIG: Final = "config.yaml"
_RECORD: Final = "run.json"
_DEFAULT_PARENT: Final = Path("runs")


@dataclass(frozen=True)
class Session:
    """One start of a training, the first or one that resumes.

    Args:
        command: The command line.
        begun: When, ISO 8601.
        steps: Actions there were already.
        versions: Of this package and the libraries.
        hardware: What it runs on.
        commit: Of the sources, if they are in git.
    """

    command: str
    begun: str
    steps: int
    versions: dict[str, str] = field(default_factory=provenance.versions)
    hardware: str = ""
    commit: str | None = field(default_factory=provenance.commit)


class RunFolder:
    """A training's folder.

    Args:
        path: Where it is.
        config: What is trained.
    """

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        self.path, self.config = path, config
        self.sessions: list[dict[str, Any]] = []

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig) -> RunFolder:
        """The folder of a new training, made when it begins; by default the next of ``runs/ALGO-1``, -2...

        Raises:
            ConfigurationError: the folder is not empty.
        """
        return cls(free_folder(path, config.algo), config)

    @classmethod
    def open(cls, path: Path) -> RunFolder:
        """The folder of a training that was begun.

        Raises:
            DataError: there is none, or a file of it is broken.
        """
        if not (path / _CONFIG).exists():
            raise DataError(f"--resume {path}: no training was begun there ({_CONFIG} is missing)")
        run = cls(path, load(TrainingConfig, path / _CONFIG))
        try:
            run.sessions = list(json.loads((path / _RECORD).read_text(encoding="utf-8"))["sessions"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path / _RECORD}: cannot be read ({error})") from None
        return run

    @classmethod
    def take_up(cls, path: Path, config: TrainingConfig) -> RunFolder:
        """The folder of a training that may have been begun: of a process that died, nobody knows.

        Raises:
            DataError: a file of it is broken.
        """
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
        hardware = provenance.hardware(self.config.device)
        session = Session(provenance.command_line(), provenance.now(), steps, hardware=hardware)
        self.sessions.append(asdict(session))
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
        """The latest checkpoint's state; None where there is none yet.

        Raises:
            DataError: it is damaged.
        """
        found = checkpoints_in(self.checkpoints)
        return read_checkpoint(found[-1]) if found else None


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
        hint = f"use --resume {path} to go on with it" if (path / _CONFIG).exists() else "name a new one"
        raise ConfigurationError(f"--out {path}: there is something already; {hint}")
    check_folder("--out", path)
    return path
