"""Policies on machines that they were not made for, as studies of machines need them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...baselines.washout import make_washout
from ...envs.car import Car
from ...envs.cues import CueTrace
from ...envs.errors import MotionCueingError
from ...envs.platform import Platform
from ..metrics import Metrics, measure
from ..policies import find_agent, is_agent, make_policy
from ..rollout import AnyPolicy, TaskPolicy, notes_of, rollout
from ..suite import CueSource, explain
from .results import StudyFailure
from .store import KeptDrive, PairStore, drive_key, identity


def policy_on(name: str, platform: Platform) -> AnyPolicy:
    """A policy by name or file on any machine.

    An agent is forced onto the machine, whatever it was trained on; what is not there does not answer.
    A washout on a machine without turntable yaws the cab with its hexapod (k_T = 0), as the paper's EST3.
    Any other policy is made for the machine.

    Args:
        name: Of the policy, or its file.
        platform: The machine.

    Raises:
        MotionCueingError: there is no such policy, or it cannot be made for the machine.
    """
    if is_agent(name):
        return find_agent(name).on(platform)
    policy: Any = make_policy(name, platform)
    parameters: Any = getattr(policy, "parameters", None)
    if platform.turntable is None and getattr(parameters, "turntable_share", 0.0) > 0.0:
        return make_washout(replace(parameters, turntable_share=0.0), platform.cab)
    return policy  # type: ignore[no-any-return]


def moved_to(policy: AnyPolicy, platform: Platform) -> AnyPolicy:
    """The policy of a machine, to be driven on another one that it knows nothing of.

    Args:
        policy: Made for a machine with the same subsystems.
        platform: The one it is driven on.
    """
    on = getattr(policy, "on", None)
    return on(platform) if isinstance(policy, TaskPolicy) and callable(on) else policy


# Policies under several conditions, such as machines or disturbances: every pair drives the same maneuvers.
#
# A drive that is done is kept, so that a study that was interrupted, or is extended, goes on where it was.


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
    study = _Running(folder, progress)
    for condition in conditions:
        study.drive(condition, policies)
    return study.outcome


@dataclass(frozen=True, eq=False)
class _Pair:
    """One policy under one condition, and where its drives are kept."""

    condition: Condition
    label: str
    policy: AnyPolicy
    who: Mapping[str, Any]
    store: PairStore

    def key(self, cues: CueTrace) -> str:
        condition = self.condition
        return drive_key(condition.platform, condition.car, condition.about, self.who, cues)

    def driven(self, key: str, cues: CueTrace) -> KeptDrive:
        drive = rollout(self.policy, cues, self.condition.platform, self.condition.car)
        return KeptDrive(key, measure(drive), notes_of(drive.metadata))


class _Running:
    """A study under way: what it found so far."""

    def __init__(self, folder: Path, progress: Callable[[str, str], None]) -> None:
        self.outcome = StudyOutcome()
        self._folder, self._progress = folder, progress

    def drive(self, condition: Condition, policies: Mapping[str, str]) -> None:
        """Every policy under a condition."""
        cues = self._cues(condition)
        metrics = self.outcome.metrics[condition.name] = {}
        left_out = self.outcome.left_out[condition.name] = {}
        for label, name in policies.items():
            try:
                policy = condition.make(name)
            except MotionCueingError as error:
                left_out[label] = str(error)
                for _ in condition.maneuvers:
                    self._progress(condition.name, label)
                continue
            store = PairStore(self._folder, condition.name, label)
            metrics[label] = self._drives(
                _Pair(condition, label, policy, identity(name, policy), store), cues
            )

    def _cues(self, condition: Condition) -> dict[str, CueTrace]:
        found: dict[str, CueTrace] = {}
        for maneuver, source in condition.maneuvers.items():
            try:
                found[maneuver] = source()
            except Exception as error:
                self.outcome.failures.append(StudyFailure(condition.name, None, maneuver, explain(error)))
        return found

    def _drives(self, pair: _Pair, cues: Mapping[str, CueTrace]) -> dict[str, Metrics]:
        """Metrics by maneuver."""
        name, label = pair.condition.name, pair.label
        found: dict[str, Metrics] = {}
        for maneuver in pair.condition.maneuvers:
            self._progress(f"{name}, {maneuver}", label)
            kept = self._kept(pair, maneuver, cues[maneuver]) if maneuver in cues else None
            if kept is None:
                continue
            found[maneuver] = kept.metrics
            if kept.notes:
                self.outcome.notes.setdefault(name, {}).setdefault(label, {})[maneuver] = kept.notes
        return found

    def _kept(self, pair: _Pair, maneuver: str, cues: CueTrace) -> KeptDrive | None:
        """A drive that is kept, or is now; None where it fails."""
        key = pair.key(cues)
        kept = pair.store.find(maneuver, key)
        if kept is not None:
            return kept
        # A policy is a user's code: whatever it raises must not cost the other drives.
        try:
            kept = pair.driven(key, cues)
        except Exception as error:
            self.outcome.failures.append(
                StudyFailure(pair.condition.name, pair.label, maneuver, explain(error))
            )
            return None
        pair.store.keep(maneuver, kept)
        self.outcome.driven += 1
        return kept
