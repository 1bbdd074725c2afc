"""The search space of a washout, and the objective: mean J over drives, with a penalty for time at limits."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.settings import from_dict, to_dict
from ..washout.batch import WashoutBatch
from ..washout.families import AnyWashout, family_of

Floats = NDArray[np.float64]

_SIGNIFICANT: Final = 5
"""Digits of a parameter that a file needs: 0.001 % is far below what changes J."""


_TURNTABLE_SHARE: Final = "turntable_share"


class WashoutSpace:
    """The numbers of a parameter set that have an effect, as a unit cube.

    The orders of the filters, the blocks that are switched off, the start pose and what acts only after a
    limit was met stay those of the set the search begins with; so does the turntable's gain, which
    ``rate_scale`` makes superfluous. A machine without a turntable is given no share of the rotation.

    Args:
        start: The set a search begins with.
        platform: The machine; None for one with a turntable.
    """

    def __init__(self, start: AnyWashout, platform: Platform | None = None) -> None:
        self._values = to_dict(start)
        coordinates = family_of(start).coordinates
        if platform is not None and platform.turntable is None and _TURNTABLE_SHARE in self._values:
            self._values[_TURNTABLE_SHARE] = 0.0
            coordinates = tuple(c for c in coordinates if c.path != _TURNTABLE_SHARE)
        self.start = from_dict(type(start), self._values, "search space")
        self.coordinates = tuple(c for c in coordinates if _has_effect(self._values, c.path))

    def __len__(self) -> int:
        """How many numbers there are."""
        return len(self.coordinates)

    def encode(self, parameters: AnyWashout) -> Floats:
        """(dimension,) places of a set's values in [0, 1]; values out of range at the nearer end.

        Raises:
            ConfigurationError: the set has a block switched off that the start has.
        """
        values = to_dict(parameters)
        try:
            return np.array([c.place(_get(values, c.path)) for c in self.coordinates])
        except TypeError:
            raise ConfigurationError(
                f"{parameters.name} has other blocks than {self.start.name}; begin with {parameters.name}"
            ) from None

    def decode(self, places: Floats) -> AnyWashout:
        """The parameter set at (dimension,) places in [0, 1]."""
        if np.shape(places) != (len(self),) or not np.isfinite(places).all():
            raise ConfigurationError(f"places must be {len(self)} finite numbers, found {places!r}")
        values = to_dict(self.start)
        for coordinate, place in zip(self.coordinates, places, strict=True):
            _set(values, coordinate.path, coordinate.value(place))
        return from_dict(type(self.start), values, "search space")

    def result(self, places: Floats, name: str, description: str) -> AnyWashout:
        """The set at these places as a file holds it: five digits a number, with a name of its own."""
        values = to_dict(self.decode(places))
        for coordinate in self.coordinates:
            exact = _get(values, coordinate.path)
            _set(values, coordinate.path, float(f"{exact:.{_SIGNIFICANT}g}"))
        return from_dict(type(self.start), values | {"name": name, "description": description}, name)

    def at_bounds(self, parameters: AnyWashout, tolerance: float = 0.01) -> Iterator[str]:
        """Paths whose value lies at an end of its range, where wider bounds might give more."""
        for coordinate, place in zip(self.coordinates, self.encode(parameters), strict=True):
            if not tolerance < place < 1.0 - tolerance:
                yield coordinate.path


def _has_effect(values: dict[str, Any], path: str) -> bool:
    block, _, field = path.rpartition(".")
    if block.startswith(("tilt", "lpc")):
        return values[block.split(".")[0]] is not None
    if field not in ("frequency", "damping"):
        return True
    order = _get(values, f"{block}.order")
    return bool(order >= (1 if field == "frequency" else 2))


def _get(values: Any, path: str) -> Any:
    for part in path.split("."):
        values = values[int(part)] if part.isdigit() else values[part]
    return values


def _set(values: Any, path: str, value: float) -> None:
    parent, _, last = path.rpartition(".")
    inner = _get(values, parent) if parent else values
    inner[int(last) if last.isdigit() else last] = value


Measure = Literal["J", "perceived"]
"""J of the cues, or of the perceived cues."""

LIMIT_STEP: Final = 1.0
"""Added to J of a set that meets a limit where it may not, however briefly: a search keeps away from it."""
LIMIT_SLOPE: Final = 1000.0
"""Times the share of time at a limit, and added, too: 0.1 % costs 1, so that the way back is downhill."""
_BROKEN: Final = 1e9
"""Cost of a set whose J is not finite."""


@dataclass(frozen=True)
class Evaluation:
    """Means over drives of parameter sets, each (sets,).

    Args:
        cue_error: Mean J of the drives.
        perceived_error: Mean perceived J.
        at_limit: Share of time in which any limit is met.
        violation: Share of time at a limit in the drives in which none may be met.
        cost: Objective of the search.
        limited: (sets, drives) share of time at a limit in each drive; 0 in those that are exempt.
    """

    cue_error: Floats
    perceived_error: Floats
    at_limit: Floats
    violation: Floats
    cost: Floats
    limited: Floats


class Objective:
    """Mean cost of parameter sets over drives; every drive counts the same.

    Args:
        drives: Cue traces of the same time step.
        platform: The machine, without lag or dead time.
        measure: J, or perceived J.
        threads: Launches side by side.
        exempt: Drives in which limits may be met; there only J counts.

    Raises:
        ConfigurationError: there is no drive.
    """

    def __init__(
        self,
        drives: Sequence[CueTrace],
        platform: Platform,
        measure: Measure = "J",
        threads: int = 1,
        exempt: Collection[int] = (),
    ) -> None:
        if not drives:
            raise ConfigurationError("drives is empty; a search needs at least one drive")
        self.drives, self.platform, self.measure, self.threads = list(drives), platform, measure, threads
        self.exempt = frozenset(exempt)

    def evaluate(
        self, sets: Sequence[AnyWashout], drives: Sequence[int] | None = None, guards: Sequence[int] = ()
    ) -> Evaluation:
        """Drive every set through drives, in one launch.

        Args:
            sets: Parameter sets of one algorithm.
            drives: Indices of the drives that J is averaged over; default: all.
            guards: Indices of further drives in which no limit may be met.
        """
        counted = list(range(len(self.drives))) if drives is None else list(drives)
        driven = [*counted, *guards]
        batch = WashoutBatch(sets, [self.drives[i] for i in driven], self.platform)
        scores = batch.scores(threads=self.threads)
        cue = scores.cue_error[:, : len(counted)].mean(axis=1)
        perceived = scores.perceived_error[:, : len(counted)].mean(axis=1)
        hard = np.array([i not in self.exempt for i in driven])
        limited = np.where(hard, scores.at_limit, 0.0)
        violation = limited.sum(axis=1) / max(1, int(hard.sum()))
        cost = (cue if self.measure == "J" else perceived) + penalty(violation)
        cost = np.nan_to_num(cost, nan=_BROKEN, posinf=_BROKEN)
        return Evaluation(cue, perceived, scores.at_limit.mean(axis=1), violation, cost, limited)

    def hours(self, drives: Sequence[int] | None = None) -> float:
        """Simulated time of one set through drives, default all, h."""
        driven = self.drives if drives is None else [self.drives[i] for i in drives]
        return float(sum(len(drive) * drive.dt for drive in driven)) / 3600.0

    def draw(self, count: int, seed: tuple[int, int]) -> list[int]:
        """``count`` of the drives, or all if there are no more; the same for the same seed."""
        count = min(count, len(self.drives))
        drawn = np.random.default_rng(seed).choice(len(self.drives), size=count, replace=False)
        return sorted(int(i) for i in drawn)


def penalty(at_limit: Floats) -> Floats:
    """Penalty for time at a limit: a step and a slope; 0 without.

    J may gain more than that. So a search ranks its results first by violation, see ``Method.best``.
    """
    return np.asarray(np.where(at_limit > 0.0, LIMIT_STEP + LIMIT_SLOPE * at_limit, 0.0))
