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
from ...envs.settings import configuration, to_dict
from ...envs.storage import write_text
from ..metrics import Metrics, measure
from ..reporting.text import plain_name
from ..results import drive_key, load_drives_done
from ..rollout import rollout, statistics_of
from ..suite import CueSource, explain
from .results import StudyFailure

_FOLDER: Final = "pairs"


@configuration
class KeptDrive:
    """One drive.

    Args:
        key: Of everything that it depends on; see :func:`~..results.drive_key`.
        metrics: What it came to.
        notes: What the policy counted.
    """

    key: str
    metrics: Metrics
    notes: dict[str, str]


@configuration
class KeptPair:
    """The drives of one policy under one condition."""

    condition: str
    policy: str
    drives: dict[str, KeptDrive]


class PairStore:
    """Keeps the drives of one policy under one condition, in ``pairs`` of the folder of a study."""

    def __init__(self, folder: Path, condition: str, policy: str) -> None:
        tag = hashlib.sha256(f"{condition}\n{policy}".encode()).hexdigest()[:6]
        name = f"{plain_name(condition)}--{plain_name(policy)}-{tag}.json"
        self._path = folder / _FOLDER / name
        empty = KeptPair(condition, policy, {})
        self._pair = load_drives_done(KeptPair, self._path, "a study") if self._path.exists() else empty

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


def check_kept(folder: Path) -> None:
    """Refuse damaged files of drives in the folder of a study, all at once."""
    damaged = []
    for path in _files(folder):
        try:
            load_drives_done(KeptPair, path, "a study")
        except DataError:
            damaged.append(str(path))
    if damaged:
        raise DataError(
            f"{', '.join(damaged)}: damaged, not the drives of a study; delete them, or add --fresh"
        )


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
        about: Everything else that a drive depends on, as plain values.
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
            metrics[label] = {}
            store = PairStore(self._folder, condition.name, label)
            about = {
                "platform": to_dict(condition.platform),
                "car": to_dict(condition.car),
                "about": dict(condition.about),
                "policy": identity(given, policy),
            }
            for maneuver in condition.maneuvers:
                self._progress(f"{condition.name}, {maneuver}", label)
                if maneuver not in cues:
                    continue
                # A policy is a user's code: whatever it raises must not cost the other drives.
                try:
                    key = drive_key(**about, cues=cues[maneuver].digest())
                    done = store.find(maneuver, key)
                    if done is None:
                        drive = rollout(policy, cues[maneuver], condition.platform, condition.car)
                        done = KeptDrive(key, measure(drive), statistics_of(drive.metadata))
                        store.keep(maneuver, done)
                        self.outcome.driven += 1
                except Exception as error:
                    failure = StudyFailure(condition.name, label, maneuver, explain(error))
                    self.outcome.failures.append(failure)
                    continue
                metrics[label][maneuver] = done.metrics
                if done.notes:
                    by_policy = self.outcome.statistics.setdefault(condition.name, {})
                    by_policy.setdefault(label, {})[maneuver] = done.notes

    def _cues(self, condition: Condition) -> dict[str, CueTrace]:
        cues: dict[str, CueTrace] = {}
        for maneuver, source in condition.maneuvers.items():
            try:
                cues[maneuver] = source()
            except Exception as error:
                self.outcome.failures.append(StudyFailure(condition.name, None, maneuver, explain(error)))
        return cues


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
