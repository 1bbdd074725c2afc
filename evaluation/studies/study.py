"""Studies: policies under several conditions, such as machines or disturbances, in the same drives.

A finished drive is kept, so that a study that was interrupted, or is extended, goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...baselines.policy import Policy
from ...envs.car import Car
from ...envs.cues import CueTrace
from ...envs.errors import MotionCueingError
from ...envs.platform import Platform
from ..metrics import Metrics, measure
from ..rollout import rollout, statistics_of
from ..suite import CueSource, explain
from .results import StudyFailure
from .store import KeptDrive, PairStore, drive_key, identity


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
