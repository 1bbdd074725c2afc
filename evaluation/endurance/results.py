"""What a policy withstood, drive by drive and in all; as JSON and CSV."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, Final

from ...envs.settings import configuration
from ..saved import Headed
from ..spreadsheet import save_rows
from .options import NOMINAL, SLOWER, Endurance

SCHEMA: Final = 1
"""Version of ``endurance.json``."""


@configuration
class Endured:
    """One drive under one condition.

    Args:
        samples: Time steps, the start among them.
        cue_error: J; None where the machine's motion is not finite.
        perceived_cue_error: J of the sensed signals.
        at_limit: Share of time with any actuator held back by any limit.
        beyond: Samples at which the true motion is beyond any limit.
        exceeded: Samples by what is exceeded, see ``limits.KINDS``.
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
        seed: All about the drive follows from it.
        car: Name of the car.
        friction: Factor on the friction of its tires.
        machine: Index of the slower machine.
        conditions: What came of it, by condition.
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
    """The nearest that all drives under a condition came to limits.

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

    def with_found(self, found: dict[str, float]) -> Extremes:
        """These, or what was found where that is nearer."""
        largest = {
            name: max(getattr(self, name), found[name]) for name in ("position", "rate", "acceleration")
        }
        return Extremes(**largest, clearance=min(self.clearance, found["clearance"]))


@configuration
class PolicyEndurance:
    """What a policy withstood.

    Args:
        key: Of all that makes drives what they are; see ``store.endurance_key``.
        drives: Those that are done.
        extremes: By condition; of all drives that are kept, also where fewer are asked for.
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
        beyond: Samples beyond any limit, under both conditions.
        exceeded: The same by what is exceeded.
        actions_not_finite: Under both conditions.
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
        endurance: What policies were put through.
        finished: Whether all drives that were asked for are done.
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
        for policy, found in self.policies.items():
            for drive in found.drives:
                about = {
                    name: getattr(drive, name) for name in ("name", "seed", "car", "friction", "machine")
                }
                for condition, endured in drive.conditions.items():
                    yield {"policy": policy, **about, "condition": condition, **_flat(endured)}


def summarised(drives: Sequence[EnduredDrive], time_step: float) -> EnduranceSummary:
    """Drives in one; at least one.

    Args:
        drives: The drives.
        time_step: s.
    """
    nominal, slower = ([drive.conditions[name] for drive in drives] for name in (NOMINAL, SLOWER))
    both = [*nominal, *slower]
    worst = max(drives, key=lambda drive: _or_inf(drive.conditions[SLOWER].cue_error))
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
            name: sum(one.at_limit for one in found) / len(found)
            for name, found in ((NOMINAL, nominal), (SLOWER, slower))
        },
        beyond=sum(one.beyond for one in both),
        exceeded={kind: sum(one.exceeded[kind] for one in both) for kind in both[0].exceeded},
        actions_not_finite=sum(one.actions_not_finite for one in both),
    )


def by_kind(drives: Sequence[EnduredDrive]) -> dict[str, list[EnduredDrive]]:
    """Drives by kind of road, in the order they first come in."""
    found: dict[str, list[EnduredDrive]] = {}
    for drive in drives:
        found.setdefault(drive.kind, []).append(drive)
    return found


def _flat(endured: Endured) -> dict[str, Any]:
    exceeded = {f"exceeded_{kind}": count for kind, count in endured.exceeded.items()}
    plain = ("samples", "cue_error", "perceived_cue_error", "at_limit", "beyond", "actions_not_finite")
    return {**{name: getattr(endured, name) for name in plain}, **exceeded}


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _or_inf(value: float | None) -> float:
    return float("inf") if value is None else value


def _ratio(over: float | None, under: float | None) -> float | None:
    return over / under if over is not None and under else None
