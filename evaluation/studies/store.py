"""Drives of a study that are done, in files: one a condition and policy."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ...envs.car import Car
from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.platform import Platform
from ...envs.settings import configuration, from_dict, to_dict
from ...envs.storage import write_text
from ..metrics import Metrics
from ..provenance import package_version
from ..reporting.text import plain_name

_FOLDER: Final = "pairs"


@configuration
class KeptDrive:
    """One drive.

    Args:
        key: Of everything that made it what it is; see :func:`drive_key`.
        metrics: What it came to.
        notes: What the policy counted.
    """

    key: str
    metrics: Metrics
    notes: dict[str, str]


@configuration
class KeptPair:
    """The drives of one policy under one condition.

    Args:
        condition: Name of the condition.
        policy: Name of the policy.
        drives: By maneuver.
    """

    condition: str
    policy: str
    drives: dict[str, KeptDrive]


class PairStore:
    """Keeps the drives of one policy under one condition.

    Args:
        folder: Of the study; the files lie in ``pairs`` in it.
        condition: Name of the condition.
        policy: Name of the policy.
    """

    def __init__(self, folder: Path, condition: str, policy: str) -> None:
        tag = hashlib.sha256(f"{condition}\n{policy}".encode()).hexdigest()[:6]
        name = f"{plain_name(condition)}--{plain_name(policy)}-{tag}.json"
        self._path = folder / _FOLDER / name
        self._pair = self._load(condition, policy)

    def _load(self, condition: str, policy: str) -> KeptPair:
        if not self._path.exists():
            return KeptPair(condition, policy, {})
        return _read(self._path)

    def find(self, maneuver: str, key: str) -> KeptDrive | None:
        """A drive that is done, if nothing about it has changed."""
        kept = self._pair.drives.get(maneuver)
        return kept if kept is not None and kept.key == key else None

    def keep(self, maneuver: str, drive: KeptDrive) -> None:
        """Write a drive down at once, whole or not at all."""
        self._pair.drives[maneuver] = drive
        write_text(self._path, json.dumps(to_dict(self._pair), allow_nan=False) + "\n")


def forget_kept(folder: Path) -> None:
    """Remove the drives of a study, and nothing else that lies there.

    Args:
        folder: Of the study.
    """
    for path in _files(folder):
        path.unlink()


def _files(folder: Path) -> list[Path]:
    return sorted((folder / _FOLDER).glob("*.json"))


def _read(path: Path) -> KeptPair:
    try:
        return from_dict(KeptPair, json.loads(path.read_text(encoding="utf-8")), str(path))
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError:
        # Which of its many numbers is wrong helps nobody.
        raise DataError(f"{path}: damaged, not the drives of a study; delete it, or add --fresh") from None


def check_kept(folder: Path) -> None:
    """Refuse damaged files of drives, all at once.

    Args:
        folder: Of the study.

    Raises:
        DataError: files are damaged.
    """
    damaged = [path for path in _files(folder) if not _readable(path)]
    if damaged:
        names = ", ".join(map(str, damaged))
        raise DataError(f"{names}: damaged, not the drives of a study; delete them, or add --fresh")


def _readable(path: Path) -> bool:
    try:
        _read(path)
    except DataError:
        return False
    return True


def identity(name: str, policy: Any) -> dict[str, Any]:
    """What a policy is, as plain values: its name or the content of its file, and its parameters."""
    # Of a class in a file, `file.py:Class`, the file.
    path = Path(name.rpartition(".py:")[0] + ".py" if ".py:" in name else name)
    parameters = getattr(policy, "parameters", None)
    return {
        "name": name,
        "file": hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None,
        "parameters": None if parameters is None else to_dict(parameters),
    }


def drive_key(
    platform: Platform, car: Car, about: Mapping[str, Any], policy: Mapping[str, Any], cues: CueTrace
) -> str:
    """A hash of all that makes a drive what it is.

    The version of the package is in it, changes to its code within a version are not.

    Args:
        platform: The machine.
        car: The car.
        about: Of the condition.
        policy: Of :func:`identity`.
        cues: The drive.
    """
    whole = {
        "version": package_version(),
        "platform": to_dict(platform),
        "car": to_dict(car),
        "about": dict(about),
        "policy": dict(policy),
        "cues": cues.digest(),
    }
    return hashlib.sha256(json.dumps(whole, sort_keys=True, default=str).encode()).hexdigest()
