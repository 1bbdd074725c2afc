"""The objective of a search: mean J over drives, with a penalty for time at a limit of the machine."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ..washout.batch import WashoutBatch
from ..washout.families import AnyWashout

Floats = NDArray[np.float64]
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
        self,
        sets: Sequence[AnyWashout],
        drives: Sequence[int] | None = None,
        guards: Sequence[int] = (),
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
