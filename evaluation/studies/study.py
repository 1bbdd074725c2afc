"""Studies: policies under several conditions, such as machines or disturbances, in the same drives.

A finished drive is kept, so that a study that was interrupted, or is extended, goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ...baselines.policy import Policy
from ...envs.car import Car
from ...envs.cues import CueTrace
from ...envs.errors import DataError, MotionCueingError
from ...envs.platform import Platform
from ...envs.provenance import package_version
from ...envs.settings import configuration, from_dict, to_dict
from ...envs.storage import write_text
from ..metrics import Metrics, measure
from ..reporting.text import plain_name
from ..rollout import rollout, statistics_of
from ..suite import CueSource, explain
from .results import StudyFailure

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
        self._pair = _read(self._path) if self._path.exists() else KeptPair(condition, policy, {})

    def find(self, maneuver: str, key: str) -> KeptDrive | None:
        """A drive that is done, if nothing about it has changed."""
        kept = self._pair.drives.get(maneuver)
        return kept if kept is not None and kept.key == key else None

    def keep(self, maneuver: str, drive: KeptDrive) -> None:
        """Write a drive down at once, whole or not at all."""
        self._pair.drives[maneuver] = drive
        write_text(self._path, json.dumps(to_dict(self._pair), allow_nan=False) + "\n")


def forget_kept(folder: Path) -> None:
    """Remove the drives of a study from its folder, and nothing else that lies there."""
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
    """Refuse damaged files of drives in the folder of a study, all at once."""
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


def identity(given: Any, policy: Policy) -> dict[str, Any]:
    """What a policy is, as plain values: its name or the content of its file, and its parameters.

    Args:
        given: Its name or file, or the policy itself.
        policy: The policy.
    """
    name = given if isinstance(given, str) else policy.name
    # Of a class in a file, `file.py:Class`, the file.
    path = Path(name.rpartition(".py:")[0] + ".py" if ".py:" in name else name)
    return {
        "name": name,
        "file": hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None,
        "parameters": None if policy.parameters is None else to_dict(policy.parameters),
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


@dataclass(frozen=True, eq=False)
class Condition:
    """What differs from one part of a study to another.

    Args:
        name: In tables and file names.
        description: One line.
        platform: The machine that is driven.
        car: That is driven.
        maneuvers: Sources of cues by name.
        make: The policy for this condition, of a name or file or a policy itself; a MotionCueingError skips
            it.
        about: What else makes a drive what it is, as plain values: a drive that is kept is of the same.
    """

    name: str
    description: str
    platform: Platform
    car: Car
    maneuvers: Mapping[str, CueSource]
    make: Callable[[Any], Policy]
    about: Mapping[str, Any] = field(default_factory=dict)


@dataclass(eq=False)
class StudyOutcome:
    """The result of a study.

    Args:
        metrics: By condition, policy and maneuver.
        skipped: By condition and policy: why it is not driven there.
        failures: Drives that gave no result.
        statistics: What policies counted, by condition, policy and maneuver, where they did.
        driven: Number of drives that were driven now; the others were kept.
    """

    metrics: dict[str, dict[str, dict[str, Metrics]]] = field(default_factory=dict)
    skipped: dict[str, dict[str, str]] = field(default_factory=dict)
    failures: list[StudyFailure] = field(default_factory=list)
    statistics: dict[str, dict[str, dict[str, dict[str, str]]]] = field(default_factory=dict)
    driven: int = 0


@dataclass(frozen=True, eq=False)
class _Pair:
    """One policy under one condition, and where its drives are kept."""

    condition: Condition
    label: str
    policy: Policy
    identity: Mapping[str, Any]
    store: PairStore


class _Study:
    """A study under way: drives pairs, and collects the outcome."""

    def __init__(self, folder: Path, progress: Callable[[str, str], None]) -> None:
        self.outcome = StudyOutcome()
        self._folder, self._progress = folder, progress

    def drive(self, condition: Condition, policies: Mapping[str, Any]) -> None:
        """Every policy under a condition."""
        cues = self._cues(condition)
        metrics = self.outcome.metrics[condition.name] = {}
        skipped = self.outcome.skipped[condition.name] = {}
        for label, given in policies.items():
            try:
                policy = condition.make(given)
            except MotionCueingError as error:
                skipped[label] = str(error)
                for _ in condition.maneuvers:
                    self._progress(condition.name, label)
                continue
            store = PairStore(self._folder, condition.name, label)
            pair = _Pair(condition, label, policy, identity(given, policy), store)
            metrics[label] = self._drive_pair(pair, cues)

    def _cues(self, condition: Condition) -> dict[str, CueTrace]:
        cues: dict[str, CueTrace] = {}
        for maneuver, source in condition.maneuvers.items():
            try:
                cues[maneuver] = source()
            except Exception as error:
                self.outcome.failures.append(StudyFailure(condition.name, None, maneuver, explain(error)))
        return cues

    def _drive_pair(self, pair: _Pair, cues: Mapping[str, CueTrace]) -> dict[str, Metrics]:
        """Metrics by maneuver."""
        condition, label = pair.condition.name, pair.label
        metrics: dict[str, Metrics] = {}
        for maneuver in pair.condition.maneuvers:
            self._progress(f"{condition}, {maneuver}", label)
            if maneuver not in cues:
                continue
            # A policy is a user's code: whatever it raises must not cost the other drives.
            try:
                kept = self._drive(pair, maneuver, cues[maneuver])
            except Exception as error:
                self.outcome.failures.append(StudyFailure(condition, label, maneuver, explain(error)))
                continue
            metrics[maneuver] = kept.metrics
            if kept.notes:
                by_policy = self.outcome.statistics.setdefault(condition, {})
                by_policy.setdefault(label, {})[maneuver] = kept.notes
        return metrics

    def _drive(self, pair: _Pair, maneuver: str, cues: CueTrace) -> KeptDrive:
        """A drive that is kept, or is driven now."""
        condition = pair.condition
        key = drive_key(condition.platform, condition.car, condition.about, pair.identity, cues)
        kept = pair.store.find(maneuver, key)
        if kept is not None:
            return kept
        drive = rollout(pair.policy, cues, condition.platform, condition.car)
        kept = KeptDrive(key, measure(drive), statistics_of(drive.metadata))
        pair.store.keep(maneuver, kept)
        self.outcome.driven += 1
        return kept


def run_study(
    conditions: list[Condition],
    policies: Mapping[str, Any],
    folder: Path,
    progress: Callable[[str, str], None] = lambda what, who: None,
) -> StudyOutcome:
    """Drive every policy under every condition, unless a drive is kept already.

    Args:
        conditions: Parts of the study.
        policies: By label: a name or file, or a policy itself.
        folder: Where drives are kept, one file a condition and policy.
        progress: Called before each drive.
    """
    study = _Study(folder, progress)
    for condition in conditions:
        study.drive(condition, policies)
    return study.outcome
