"""Runs every policy on every maneuver; one that fails does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from ..envs.cues import CueTrace
from ..envs.errors import MotionCueingError
from .criteria import Criteria
from .metrics import Metrics, measure
from .recording import notes_of
from .results import Failure
from .trajectory import Trajectory

CueSource = Callable[[], CueTrace]
"""Makes the cues of a maneuver; called once, when it is its turn."""
Drive = Callable[[CueTrace], Trajectory]
"""One policy on the machine: takes the cues of a maneuver through it."""
Finish = Callable[[str, Mapping[str, Trajectory]], None]
"""Receives the trajectories of a maneuver by policy before they are dropped."""
Progress = Callable[[str, str], None]
"""Told the maneuver and the policy before each drive."""

SETUP: Final = "cues"
"""Given to :data:`Progress` in place of a policy while the car drives the maneuver."""


@dataclass(eq=False)
class Outcome:
    """What a suite found so far.

    Args:
        maneuvers: Metrics by maneuver and policy, in the order they were run.
        metadata: The metadata of each policy's first trajectory.
        failures: Drives without a result.
        notes: What policies counted, by maneuver and policy, where they did.
    """

    maneuvers: dict[str, dict[str, Metrics]] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)
    notes: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)


def run_suite(
    maneuvers: Mapping[str, CueSource],
    policies: Mapping[str, Drive],
    finish: Finish,
    progress: Progress = lambda maneuver, policy: None,
    criteria: Criteria | None = None,
) -> Outcome:
    """Drive every maneuver with every policy and measure it.

    Trajectories of one maneuver at a time are kept: long recordings are large.

    Args:
        maneuvers: Sources of cues by the name the maneuver has in the results.
        policies: Drives by the name the policy has in the results.
        finish: Called after each maneuver that at least one policy finished.
        progress: Called before the cues are made and before each drive.
        criteria: Thresholds of the metrics.
    """
    outcome = Outcome()
    for maneuver, source in maneuvers.items():
        progress(maneuver, SETUP)
        try:
            cues = source()
        except Exception as error:
            outcome.failures.append(Failure(maneuver, None, explain(error)))
            continue
        drives = _drive_all(maneuver, cues, policies, progress, outcome)
        measured = _measure_all(maneuver, drives, criteria, outcome)
        outcome.maneuvers[maneuver] = measured
        drives = {name: drives[name] for name in measured}
        for name, drive in drives.items():
            outcome.metadata.setdefault(name, dict(drive.metadata))
            if notes_of(drive.metadata):
                outcome.notes.setdefault(maneuver, {})[name] = notes_of(drive.metadata)
        if drives:
            try:
                finish(maneuver, drives)
            except Exception as error:
                outcome.failures.append(Failure(maneuver, None, explain(error)))
    return outcome


def _measure_all(
    maneuver: str, drives: Mapping[str, Trajectory], criteria: Criteria | None, outcome: Outcome
) -> dict[str, Metrics]:
    measured: dict[str, Metrics] = {}
    for name, drive in drives.items():
        # Metrics are finite numbers; a drive beyond all bounds has none, and must not cost the others.
        try:
            measured[name] = measure(drive, criteria)
        except Exception as error:
            outcome.failures.append(Failure(maneuver, name, explain(error)))
    return measured


def _drive_all(
    maneuver: str, cues: CueTrace, policies: Mapping[str, Drive], progress: Progress, outcome: Outcome
) -> dict[str, Trajectory]:
    drives: dict[str, Trajectory] = {}
    for name, drive in policies.items():
        progress(maneuver, name)
        # A policy is a user's code: whatever it raises must not cost the other drives.
        try:
            drives[name] = replace(drive(cues), maneuver=maneuver, policy=name)
        except Exception as error:
            outcome.failures.append(Failure(maneuver, name, explain(error)))
    return drives


def explain(error: Exception) -> str:
    """One line: the message of our own errors, the type as well for any other."""
    text = " ".join(str(error).split())
    if isinstance(error, MotionCueingError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def labels(names: Sequence[str], stems: Sequence[str], reserved: Collection[str] = ()) -> dict[str, str]:
    """A label for each of the names asked for: its stem, numbered where two stems are equal.

    Args:
        names: As the user wrote them; repeated ones count once.
        stems: A short label for each.
        reserved: Labels that only a name that is the same may have: a file is no shipped policy.
    """
    found: dict[str, str] = {}
    for name, stem in zip(names, stems, strict=True):
        if name in found:
            continue
        label, number = stem, 2
        while label in found.values() or (label in reserved and label != name):
            label, number = f"{stem}-{number}", number + 1
        found[name] = label
    return found
