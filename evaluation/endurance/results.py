"""Endurance: its options, the result of every drive, summaries, kept files and tables.

A kept file holds the finished drives of one policy, so that a run that was stopped goes on, and can be made
longer.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field

from ...envs.car.vehicles import STANDARD_CARS
from ...envs.maneuvers import RandomDrives
from ...envs.maneuvers.roads import ORDINARY_KINDS
from ...envs.platform import Platform
from ...envs.settings import NonNegative, Positive, configuration, to_dict
from ...envs.simulator.simulator import TIME_STEP
from ...envs.storage import write_text
from ...envs.task import RandomizationOptions, TaskOptions
from ...envs.task.episode import machines_of
from ..reporting.text import NOTHING, TextTable, number, percent, plain_name
from ..results import Headed, load_drives_done, save_rows

NOMINAL: Final = "nominal"
"""Name of the condition with the machine as it should be."""
SLOWER: Final = "slower"
"""Name of the condition with machines whose actuators have a lag and a dead time."""


def compensated_name(known: float) -> str:
    """Name of the condition with slower machines and policies that know this share of the true lateness."""
    return "compensated" if known == 1.0 else f"compensated, known ×{known:g}"


_EVENLY: Final[dict[str, Any]] = dict.fromkeys(ORDINARY_KINDS, 1.0)
_EVERY_KIND: Final = RandomDrives(**_EVENLY, roughness=(0.0, 600.0), cars=STANDARD_CARS)


@configuration
class Endurance:
    """Drives and machines; each drive is driven on the machine as it should be and on a slower one.

    Lag and dead time reach to those of ``motion-cueing robustness``, both at once. Lags of 30 to 90 rad/s are
    5 to 14 Hz, the range of common motion bases (from memory).

    Args:
        drives: Distribution of the drives; default: every ordinary kind of road in every car without gears,
            equally often, smooth to rough.
        duration: Of a drive, s.
        friction: Range of a factor on the tires' friction.
        natural_frequency: Range of the actuators' lag, rad/s, drawn for each subsystem of a machine.
        dead_time: Range of their dead time, s, drawn alike.
        machines: Slower machines that drives draw from.
        known: Lateness that policies are given on the slower machines and compensate, over the true one; each
            is a condition of its own. None: policies know nothing of it.
    """

    drives: RandomDrives = _EVERY_KIND
    duration: Positive = 120.0
    friction: tuple[Positive, Positive] = (0.7, 1.0)
    natural_frequency: tuple[Positive, Positive] = (30.0, 90.0)
    dead_time: tuple[NonNegative, NonNegative] = (0.0, 0.05)
    machines: Annotated[int, Field(ge=1)] = 64
    known: tuple[Positive, ...] = ()

    @property
    def conditions(self) -> dict[str, float | None]:
        """Known lateness over the true one, by the name of a condition; None where it is unknown."""
        compensated = {compensated_name(factor): factor for factor in self.known}
        return {NOMINAL: None, SLOWER: None, **compensated}

    def about(self) -> dict[str, Any]:
        """What drives depend on, as plain values; as it was before there was compensation, without one."""
        values: dict[str, Any] = to_dict(self)
        if not self.known:
            del values["known"]
        return values

    def __post_init__(self) -> None:
        # The ranges are those of an environment, which checks them.
        assert self.randomization(SLOWER).platforms == self.machines

    def randomization(self, condition: str) -> RandomizationOptions:
        """The randomization of an environment under a condition."""
        if condition == NOMINAL:
            return RandomizationOptions()
        return RandomizationOptions(
            friction=self.friction,
            natural_frequency=self.natural_frequency,
            dead_time=self.dead_time,
            platforms=self.machines,
        )

    def machines_under(self, condition: str, platform: Platform) -> list[Platform]:
        """The machines of a condition: the platform, or the slower ones, the same for every batch."""
        return machines_of(TaskOptions(platform=platform, randomization=self.randomization(condition)))


SCHEMA: Final = 1
"""Version of ``endurance.json``."""


@configuration
class Endured:
    """One drive under one condition.

    Args:
        samples: Time steps, the start among them.
        cue_error: J; None where the machine's motion is not finite.
        perceived_cue_error: J of the perceived cues.
        at_limit: Share of time with any actuator held back by any limit.
        beyond: Samples at which the true motion is beyond any limit.
        exceeded: Samples by kind of limit, see :data:`~.run.KINDS`.
        actions_not_finite: Actions with an entry that is no finite number.
    """

    samples: int
    cue_error: float | None
    perceived_cue_error: float | None
    at_limit: float
    beyond: int
    exceeded: dict[str, int]
    actions_not_finite: int


@configuration
class EnduredDrive:
    """One drive.

    Args:
        name: Kind of road and seed.
        seed: Everything about the drive follows from it.
        car: Name of the car.
        friction: Factor on the friction of its tires.
        machine: Index of the slower machine.
        conditions: Result by condition.
    """

    name: str
    seed: int
    car: str
    friction: float
    machine: int
    conditions: dict[str, Endured]

    @property
    def kind(self) -> str:
        """Kind of road."""
        return self.name.rpartition("-")[0]


@configuration
class Extremes:
    """The closest that all drives under a condition came to the limits.

    Args:
        position: Largest share of a way to an end of travel.
        rate: Of a speed.
        acceleration: Of an acceleration.
        clearance: Least determinant of the hexapod's Jacobian over that at neutral; 0 in a singular pose.
    """

    position: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0
    clearance: float = 1.0

    def merged(self, others: Mapping[str, float]) -> Extremes:
        """The closer ones of these and others, by name."""
        largest = {
            name: max(getattr(self, name), others[name]) for name in ("position", "rate", "acceleration")
        }
        return Extremes(**largest, clearance=min(self.clearance, others["clearance"]))


@configuration
class PolicyEndurance:
    """The finished drives of a policy.

    Args:
        key: Hash of everything that drives depend on but their seeds; see :func:`~..results.drive_key`.
        drives: Finished drives.
        extremes: By condition; of all kept drives, also where fewer are requested.
    """

    key: str
    drives: tuple[EnduredDrive, ...] = ()
    extremes: dict[str, Extremes] = field(default_factory=dict)


@configuration
class EnduranceSummary:
    """A policy over many drives.

    Args:
        drives: Number of them.
        hours: Time they take, under each condition.
        worst: The drive with the largest J on the slower machine.
        worst_cue_error: Its J there.
        cue_error: Mean J on the machine as it should be; None where a drive has none.
        slower_cue_error: The same on the slower ones.
        perceived_cue_error: Mean perceived J.
        slower_perceived_cue_error: The same on the slower ones.
        at_limit: Mean share of time with any actuator at any limit, by condition.
        beyond: Samples beyond any limit, under all conditions.
        exceeded: The same by kind of limit.
        actions_not_finite: Under all conditions.
        compensated: Mean J on the slower machines, by condition with a known lateness.
    """

    drives: int
    hours: float
    worst: str
    worst_cue_error: float | None
    cue_error: float | None
    slower_cue_error: float | None
    perceived_cue_error: float | None
    slower_perceived_cue_error: float | None
    at_limit: dict[str, float]
    beyond: int
    exceeded: dict[str, int]
    actions_not_finite: int
    compensated: dict[str, float | None] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        """Mean J on slower machines over that on the machine as it should be."""
        return _ratio(self.slower_cue_error, self.cue_error)

    @property
    def perceived_ratio(self) -> float | None:
        """The same of the perceived J."""
        return _ratio(self.slower_perceived_cue_error, self.perceived_cue_error)

    @property
    def withstood(self) -> bool:
        """Whether no limit was exceeded and every action was finite."""
        return self.beyond == 0 and self.actions_not_finite == 0


@configuration
class EnduranceResults(Headed):
    """All policies: ``endurance.json``.

    Args:
        platform: Name of the machine.
        endurance: Options of the drives.
        finished: Whether all requested drives are done.
        summaries: By policy.
        policies: By name.
    """

    what = "the results of an endurance"
    version = SCHEMA

    platform: str
    endurance: Endurance
    finished: bool
    summaries: dict[str, EnduranceSummary]
    policies: dict[str, PolicyEndurance]

    def save_csv(self, path: str | Path) -> None:
        """Write one line a policy, drive and condition."""
        save_rows(list(self._rows()), path)

    def _rows(self) -> Iterator[dict[str, Any]]:
        for policy, endurance in self.policies.items():
            for drive in endurance.drives:
                about = {
                    name: getattr(drive, name) for name in ("name", "seed", "car", "friction", "machine")
                }
                for condition, endured in drive.conditions.items():
                    values = to_dict(endured)
                    values |= {f"exceeded_{kind}": n for kind, n in values.pop("exceeded").items()}
                    yield {"policy": policy, **about, "condition": condition, **values}


def summarized(drives: Sequence[EnduredDrive], time_step: float) -> EnduranceSummary:
    """Drives in one; at least one."""
    by_condition = {name: [drive.conditions[name] for drive in drives] for name in drives[0].conditions}
    nominal, slower = by_condition[NOMINAL], by_condition[SLOWER]
    every = [one for results in by_condition.values() for one in results]
    errors = [float("inf") if one.cue_error is None else one.cue_error for one in slower]
    worst = drives[errors.index(max(errors))]
    return EnduranceSummary(
        drives=len(drives),
        hours=sum(one.samples - 1 for one in nominal) * time_step / 3600.0,
        worst=worst.name,
        worst_cue_error=worst.conditions[SLOWER].cue_error,
        cue_error=_mean([one.cue_error for one in nominal]),
        slower_cue_error=_mean([one.cue_error for one in slower]),
        perceived_cue_error=_mean([one.perceived_cue_error for one in nominal]),
        slower_perceived_cue_error=_mean([one.perceived_cue_error for one in slower]),
        at_limit={
            name: sum(one.at_limit for one in results) / len(results)
            for name, results in by_condition.items()
        },
        beyond=sum(one.beyond for one in every),
        exceeded={kind: sum(one.exceeded[kind] for one in every) for kind in every[0].exceeded},
        actions_not_finite=sum(one.actions_not_finite for one in every),
        compensated={
            name: _mean([one.cue_error for one in results])
            for name, results in by_condition.items()
            if name not in (NOMINAL, SLOWER)
        },
    )


def by_kind(drives: Sequence[EnduredDrive]) -> dict[str, list[EnduredDrive]]:
    """Drives by kind of road, in the order they first come in."""
    kinds: dict[str, list[EnduredDrive]] = {}
    for drive in drives:
        kinds.setdefault(drive.kind, []).append(drive)
    return kinds


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _ratio(over: float | None, under: float | None) -> float | None:
    return over / under if over is not None and under else None


FOLDER: Final = "drives"
"""Within the folder of the results."""


class EnduranceStore:
    """Keeps the drives of one policy.

    Args:
        folder: Of the results.
        policy: Label of the policy.
        key: See :class:`PolicyEndurance`; drives of another key are not taken.
        fresh: Remove the finished drives.
    """

    def __init__(self, folder: Path, policy: str, key: str, fresh: bool = False) -> None:
        tag = hashlib.sha256(policy.encode()).hexdigest()[:6]
        self._path = folder / FOLDER / f"{plain_name(policy)}-{tag}.json"
        if fresh:
            self._path.unlink(missing_ok=True)
        empty = PolicyEndurance(key)
        kept = load_drives_done(PolicyEndurance, self._path, "an endurance") if self._path.exists() else empty
        self.kept = kept if kept.key == key else empty

    def missing(self, seeds: Sequence[int]) -> list[int]:
        """Those of the seeds whose drives are not done."""
        done = {drive.seed for drive in self.kept.drives}
        return [seed for seed in seeds if seed not in done]

    def keep(self, drives: Collection[EnduredDrive], extremes: Mapping[str, dict[str, float]]) -> None:
        """Write finished drives at once, whole or not at all."""
        before = self.kept
        merged = {
            condition: before.extremes.get(condition, Extremes()).merged(values)
            for condition, values in extremes.items()
        }
        self.kept = PolicyEndurance(before.key, (*before.drives, *drives), merged)
        write_text(self._path, json.dumps(to_dict(self.kept), allow_nan=False) + "\n")


_SHARES: Final = ("position", "rate", "acceleration")
_ERRORS: Final = ("J", "J slower", "J ratio", "perceived J", "perceived ratio", "at limit %", "slower %")


def tables(results: EnduranceResults) -> list[TextTable]:
    """Safety, errors, errors with compensation, and errors by kind of road, of every policy with a drive."""
    compensated = [_compensated(results)] if results.endurance.known else []
    return [_safety(results), _errors(results), *compensated, _kinds(results)]


def _safety(results: EnduranceResults) -> TextTable:
    header = ("policy", "drives", "hours", "samples beyond a limit", "not finite", *_SHARES, "clearance")
    rows = []
    for name, summary in results.summaries.items():
        extremes = list(results.policies[name].extremes.values())
        largest = [max(getattr(one, what) for one in extremes) for what in _SHARES]
        least = min(one.clearance for one in extremes)
        cells = (
            f"{summary.hours:.2f} × {len(results.endurance.conditions)}",
            f"{summary.beyond}",
            f"{summary.actions_not_finite}",
        )
        shares = tuple(f"{share:.4f}" for share in (*largest, least))
        rows.append((name, f"{summary.drives}", *cells, *shares))
    return TextTable("Limits: samples beyond them, largest use (1 is the limit)", header, tuple(rows))


def _errors(results: EnduranceResults) -> TextTable:
    rows = [
        (name, *_error_cells(summary), summary.worst, number(summary.worst_cue_error))
        for name, summary in results.summaries.items()
    ]
    title = "Cue errors, on the machine as it should be and on slower ones"
    return TextTable(title, ("policy", *_ERRORS, "worst drive", "its J slower"), tuple(rows))


def _compensated(results: EnduranceResults) -> TextTable:
    """J of policies that know a lateness, over J on the machine as it should be."""
    names = [name for name, known in results.endurance.conditions.items() if known is not None]
    header = ("policy", "J", "J slower", "ratio", *chain(*((name, "ratio", "at limit %") for name in names)))
    rows = []
    for policy, summary in results.summaries.items():
        cells = [number(summary.cue_error), number(summary.slower_cue_error), _ratio_cell(summary.ratio)]
        for name in names:
            error = summary.compensated[name]
            ratio = _ratio_cell(_ratio(error, summary.cue_error))
            cells += [number(error), ratio, percent(summary.at_limit[name])]
        rows.append((policy, *cells))
    return TextTable("Slower machines whose lateness is known", header, tuple(rows))


def _kinds(results: EnduranceResults) -> TextTable:
    rows = [
        (name, kind, f"{len(drives)}", *_error_cells(summarized(drives, TIME_STEP)))
        for name in results.summaries
        for kind, drives in by_kind(results.policies[name].drives).items()
    ]
    return TextTable("By kind of road", ("policy", "kind", "drives", *_ERRORS), tuple(sorted(rows)))


def _error_cells(summary: EnduranceSummary) -> tuple[str, ...]:
    return (
        number(summary.cue_error),
        number(summary.slower_cue_error),
        _ratio_cell(summary.ratio),
        number(summary.perceived_cue_error),
        _ratio_cell(summary.perceived_ratio),
        percent(summary.at_limit[NOMINAL]),
        percent(summary.at_limit[SLOWER]),
    )


def _ratio_cell(value: float | None) -> str:
    return NOTHING if value is None else f"×{value:.2f}"
