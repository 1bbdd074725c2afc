"""Policies under several conditions, such as machines or disturbances: every pair drives the same maneuvers.

A drive that is done is kept, so that a study that was interrupted, or is extended, goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.errors import MotionCueingError
from ..envs.platform import Platform
from .metrics import Metrics, measure
from .recording import notes_of
from .rollout import AnyPolicy, rollout
from .study_results import StudyFailure
from .study_store import KeptDrive, PairStore, drive_key, identity
from .suite import CueSource, explain


@dataclass(frozen=True, eq=False)
class Condition:
    """What differs from one part of a study to another.

    Args:
        name: In tables and file names.
        description: One line.
        platform: The machine that is driven.
        car: That is driven.
        maneuvers: Sources of cues by name.
        make: The policy of a name or file, for this condition; a MotionCueingError leaves it out.
        about: What else makes a drive what it is, as plain values: a drive that is kept is of the same.
    """

    name: str
    description: str
    platform: Platform
    car: Car
    maneuvers: Mapping[str, CueSource]
    make: Callable[[str], AnyPolicy]
    about: Mapping[str, Any] = field(default_factory=dict)


@dataclass(eq=False)
class StudyOutcome:
    """What a study found.

    Args:
        metrics: By condition, policy and maneuver.
        left_out: By condition and policy: why it is not driven there.
        failures: Drives that gave no result.
        notes: What policies counted, by condition, policy and maneuver, where they did.
        driven: Number of drives that were driven now; the others were kept.
    """

    metrics: dict[str, dict[str, dict[str, Metrics]]] = field(default_factory=dict)
    left_out: dict[str, dict[str, str]] = field(default_factory=dict)
    failures: list[StudyFailure] = field(default_factory=list)
    notes: dict[str, dict[str, dict[str, dict[str, str]]]] = field(default_factory=dict)
    driven: int = 0


def run_study(
    conditions: list[Condition],
    policies: Mapping[str, str],
    folder: Path,
    progress: Callable[[str, str], None] = lambda what, who: None,
) -> StudyOutcome:
    """Drive every policy under every condition, unless a drive is kept already.

    Args:
        conditions: Parts of the study.
        policies: Name or file by label.
        folder: Where drives are kept, one file a condition and policy.
        progress: Told before each drive.
    """
    outcome = StudyOutcome()
    for condition in conditions:
        cues = _cues(condition, outcome)
        outcome.metrics[condition.name] = {}
        outcome.left_out[condition.name] = {}
        for label, name in policies.items():
            try:
                policy = condition.make(name)
            except MotionCueingError as error:
                outcome.left_out[condition.name][label] = str(error)
                for _ in condition.maneuvers:
                    progress(condition.name, label)
                continue
            store = PairStore(folder, condition.name, label)
            found = _drive_all(condition, label, name, policy, cues, store, outcome, progress)
            outcome.metrics[condition.name][label] = found
    return outcome


def _cues(condition: Condition, outcome: StudyOutcome) -> dict[str, CueTrace]:
    found: dict[str, CueTrace] = {}
    for maneuver, source in condition.maneuvers.items():
        try:
            found[maneuver] = source()
        except Exception as error:
            outcome.failures.append(StudyFailure(condition.name, None, maneuver, explain(error)))
    return found


def _drive_all(
    condition: Condition,
    label: str,
    name: str,
    policy: AnyPolicy,
    cues: Mapping[str, CueTrace],
    store: PairStore,
    outcome: StudyOutcome,
    progress: Callable[[str, str], None],
) -> dict[str, Metrics]:
    """One policy under one condition: metrics by maneuver."""
    who = identity(name, policy)
    found: dict[str, Metrics] = {}
    for maneuver, trace in cues.items():
        progress(f"{condition.name}, {maneuver}", label)
        key = drive_key(condition.platform, condition.car, condition.about, who, trace)
        kept = store.find(maneuver, key)
        if kept is None:
            # A policy is a user's code: whatever it raises must not cost the other drives.
            try:
                drive = rollout(policy, trace, condition.platform, condition.car)
                kept = KeptDrive(key, measure(drive), notes_of(drive.metadata))
            except Exception as error:
                outcome.failures.append(StudyFailure(condition.name, label, maneuver, explain(error)))
                continue
            store.keep(maneuver, kept)
            outcome.driven += 1
        found[maneuver] = kept.metrics
        if kept.notes:
            outcome.notes.setdefault(condition.name, {}).setdefault(label, {})[maneuver] = kept.notes
    return found
