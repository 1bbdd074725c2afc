"""Every policy on every maneuver; one that fails does not stop the others."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Console

from ..envs.cues import CueScale, CueTrace
from ..envs.errors import ConfigurationError, DataError, MotionCueingError, summary
from .metrics import Criteria, Metrics, measure
from .reporting.text import how_many, print_note
from .results import Failure
from .rollout import statistics_of
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..envs.platform import Platform


CueSource = Callable[[], CueTrace]
"""Makes the cues of a maneuver; called once, when it is its turn."""
Drive = Callable[[CueTrace], Trajectory]
"""One policy on the machine: takes the cues of a maneuver through it."""
Finish = Callable[[str, Mapping[str, Trajectory]], None]
"""Receives the trajectories of a maneuver by policy before they are dropped."""
OnDrive = Callable[[str, str], None]
"""Called with the maneuver and the policy before each drive."""

SETUP: Final = "cues"
"""Given to :data:`OnDrive` in place of a policy while the car drives the maneuver."""


@dataclass(eq=False)
class Outcome:
    """The results of a suite so far.

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
    progress: OnDrive = lambda maneuver, policy: None,
    criteria: Criteria | None = None,
    costly: bool = False,
) -> Outcome:
    """Drive every maneuver with every policy and measure it.

    Trajectories of one maneuver at a time are kept: long recordings are large.

    Args:
        maneuvers: Sources of cues by the name the maneuver has in the results.
        policies: Drives by the name the policy has in the results.
        finish: Called after each maneuver that at least one policy finished.
        progress: Called before the cues are made and before each drive.
        criteria: Thresholds of the metrics.
        costly: Whether costly metrics are measured, too.
    """
    outcome = Outcome()
    for maneuver, source in maneuvers.items():
        progress(maneuver, SETUP)
        try:
            cues = source()
        except Exception as error:
            outcome.failures.append(Failure(maneuver, None, explain(error)))
            continue
        drives: dict[str, Trajectory] = {}
        measured = outcome.maneuvers[maneuver] = {}
        for name, drive in policies.items():
            progress(maneuver, name)
            # A policy is a user's code: whatever it raises must not cost the other drives. Metrics are finite
            # numbers; a drive beyond all bounds has none.
            try:
                driven = replace(drive(cues), maneuver=maneuver, policy=name)
                measured[name] = measure(driven, criteria, costly)
            except Exception as error:
                outcome.failures.append(Failure(maneuver, name, explain(error)))
                continue
            drives[name] = driven
            outcome.metadata.setdefault(name, dict(driven.metadata))
            if statistics_of(driven.metadata):
                outcome.notes.setdefault(maneuver, {})[name] = statistics_of(driven.metadata)
        if drives:
            try:
                finish(maneuver, drives)
            except Exception as error:
                outcome.failures.append(Failure(maneuver, None, explain(error)))
    return outcome


def explain(error: Exception) -> str:
    """One line: the message of our own errors, the type as well for any other."""
    return " ".join(str(error).split()) if isinstance(error, MotionCueingError) else summary(error)


def labels(names: Sequence[str], stems: Sequence[str], reserved: Collection[str] = ()) -> dict[str, str]:
    """A label for each name: its stem, numbered where two stems are equal.

    Args:
        names: As the user wrote them; repeated ones count once.
        stems: A short label for each.
        reserved: Labels that only a name that is the same may have: a file is no shipped policy.
    """
    given: dict[str, str] = {}
    for name, stem in zip(names, stems, strict=True):
        if name in given:
            continue
        label, number = stem, 2
        while label in given.values() or (label in reserved and label != name):
            label, number = f"{stem}-{number}", number + 1
        given[name] = label
    return given


_TROUBLES: Final = {
    "mpc_failures": "without a plan (the machine braked)",
    "mpc_relaxed": "with a limit relaxed",
    "mpc_unconverged": "unconverged",
    "optimum_unconverged": "unconverged",
    "optimum_braked": "without a plan (the machine braked)",
}
"""Counts that should be 0, and what they count."""
_WHOLES: Final = {"mpc": ("mpc_solves", "solve"), "optimum": ("optimum_windows", "window")}
"""By the first word of a count: the count it is a part of, and of what."""
_MOST: Final = 3
"""Drives that are named; the others are counted."""

Notes = Mapping[str, Mapping[str, str]]
"""What a policy counted, by drive."""


def trouble_lines(notes: Iterable[tuple[str, str, Mapping[str, str]]]) -> dict[str, str]:
    """Solves that went wrong, in one line a policy; policies without any are missing.

    Args:
        notes: Policy, drive and what the policy counted there.
    """
    by_policy: dict[str, dict[str, Mapping[str, str]]] = {}
    for policy, drive, counted in notes:
        by_policy.setdefault(policy, {})[drive] = counted
    lines = {
        policy: "; ".join(text for trouble in _TROUBLES if (text := _trouble(trouble, drives)))
        for policy, drives in by_policy.items()
    }
    return {policy: line for policy, line in lines.items() if line}


def _trouble(trouble: str, drives: Notes) -> str:
    """One kind of trouble: how many of how many, and in which drives, most first."""
    whole, noun = _WHOLES[trouble.partition("_")[0]]
    counts = {name: _number(counted, trouble) for name, counted in drives.items()}
    counts = {name: count for name, count in counts.items() if count > 0}
    if not counts:
        return ""
    totals = {name: _number(counted, whole) for name, counted in drives.items()}
    order = sorted(counts, key=lambda name: -counts[name])
    named = ", ".join(f"{name} {counts[name]} of {totals[name]}" for name in order[:_MOST])
    more = f", and {how_many(len(order) - _MOST, 'more drive')}" if len(order) > _MOST else ""
    total = how_many(sum(totals.values()), noun)
    return f"{sum(counts.values())} of {total} {_TROUBLES[trouble]} ({named}{more})"


def _number(counted: Mapping[str, str], name: str) -> int:
    """A count; 0 where a user's policy has something else under this name."""
    text = counted.get(name, "0")
    return int(text) if text.isdecimal() else 0


def print_troubles(console: Console, notes: Iterable[tuple[str, str, Mapping[str, str]]]) -> None:
    """Show :func:`trouble_lines`."""
    for policy, line in trouble_lines(notes).items():
        print_note(console, "counted", f"{policy}: {line}")


FOLLOWED: Final = "loop_followed"
"""Metadata of a controller's log: first row and end of each stretch that the policy moved, as JSON."""

DRIVEN: Final = "driven"
"""What the recorded drive is called beside policies that drive the same cues."""


def load_drives(files: Sequence[Path], platform: Platform) -> tuple[dict[str, Trajectory], dict[str, str]]:
    """Recorded drives by label (the names of their files), and what is left out of them.

    The log of a controller has waiting and braking in it, which the policy did not decide. Each stretch that
    the policy moved becomes a drive of its own, numbered from the second on.

    Args:
        files: Saved trajectories.
        platform: The machine they must have been driven on.

    Raises:
        DataError: a file is missing, broken or no trajectory, or the log of a machine that never moved.
        ConfigurationError: a drive is of another machine.
    """
    drives: dict[str, Trajectory] = {}
    stems: dict[str, str] = {}
    left_out: dict[str, str] = {}
    for file in dict.fromkeys(files):
        drive = Trajectory.load(file)
        if drive.platform != platform.name:
            raise ConfigurationError(
                f"{file.stem} was driven on the motion base {drive.platform!r}, not {platform.name!r}; "
                "name it with --platform"
            )
        stretches = _followed(drive, file)
        rest = len(drive) - sum(end - begin for begin, end in stretches)
        if rest:
            left_out[file.name] = f"{rest * drive.dt:.1f} s in which the policy did not move the machine"
        for begin, end in stretches:
            name = f"{file} from {begin}"
            drives[name], stems[name] = drive.part(begin, end), file.stem
    names = labels([*stems], [*stems.values()])
    return {label: drives[name] for name, label in names.items()}, left_out


def _followed(drive: Trajectory, file: Path) -> list[tuple[int, int]]:
    """First row and end of each stretch that the policy moved, those of a single row left out."""
    if FOLLOWED not in drive.metadata:
        return [(0, len(drive))]
    stretches = [(begin, end) for begin, end in json.loads(drive.metadata[FOLLOWED]) if end - begin > 1]
    if not stretches:
        raise DataError(f"{file}: the policy never moved the machine in it; send cues to the controller")
    return stretches


def cue_sources(drives: Mapping[str, Trajectory]) -> dict[str, CueSource]:
    """The cues of each drive, to drive them again."""
    return {label: partial(cues_of, drive, label) for label, drive in drives.items()}


def scale_of(drives: Mapping[str, Trajectory]) -> CueScale:
    """The motion scale of recorded drives; neutral without any.

    Raises:
        ConfigurationError: they have several.
    """
    scales = {label: drive.scale for label, drive in drives.items()}
    if len(set(scales.values())) > 1:
        each = ", ".join(f"{label} {scale}" for label, scale in scales.items())
        raise ConfigurationError(f"the drives are at different motion scales ({each}); evaluate each apart")
    return next(iter(scales.values()), CueScale())


def at_scale(sources: Mapping[str, CueSource], scale: CueScale) -> dict[str, CueSource]:
    """The cues of each drive at a motion scale."""
    return {label: partial(_scaled, source, scale) for label, source in sources.items()}


def _scaled(source: CueSource, scale: CueScale) -> CueTrace:
    return source().scaled(scale)


def cues_of(drive: Trajectory, name: str) -> CueTrace:
    """The reference cues of a drive."""
    return CueTrace(
        name,
        drive.time,
        drive.f_reference,
        drive.w_reference,
        source=f"as driven by {drive.policy}",
        scale=drive.scale,
    )
