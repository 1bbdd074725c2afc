"""What a search minimizes: J over drives, in which no limit of the machine is met."""

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
"""What is averaged over the drives: J, or J of what the driver senses."""

LIMIT_STEP: Final = 1.0
"""Added to J of a set that meets a limit where it may not, however briefly: a search keeps away from it."""
LIMIT_SLOPE: Final = 1000.0
"""Times the share of time at a limit, and added, too: 0.1 % costs 1, so that the way back is downhill."""
_BROKEN: Final = 1e9
"""In place of a J that is not finite."""


@dataclass(frozen=True)
class Judgement:
    """What was found about parameter sets, each (sets,).

    Args:
        cue_error: Mean J of the drives.
        perceived_error: Mean perceived J.
        at_limit: Share of time in which any limit is met.
        violation: The same of the drives in which none may be met.
        cost: What the search minimizes.
        limited: (sets, drives) the same of each drive; 0 in those that are spared.
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
        measure: What is minimized.
        threads: Launches side by side.
        spared: Drives in which limits may be met: what that does to J is all it costs.

    Raises:
        ConfigurationError: there is no drive.
    """

    def __init__(
        self,
        drives: Sequence[CueTrace],
        platform: Platform,
        measure: Measure = "J",
        threads: int = 1,
        spared: Collection[int] = (),
    ) -> None:
        if not drives:
            raise ConfigurationError("drives is empty; a search needs at least one drive")
        self.drives, self.platform, self.measure, self.threads = list(drives), platform, measure, threads
        self.spared = frozenset(spared)

    def judge(
        self,
        sets: Sequence[AnyWashout],
        drives: Sequence[int] | None = None,
        guards: Sequence[int] = (),
    ) -> Judgement:
        """Every set through drives, in one launch.

        Args:
            sets: Parameter sets of one algorithm.
            drives: Which drives J is averaged over; default: all.
            guards: Further drives in which no limit may be met either.
        """
        counted = list(range(len(self.drives))) if drives is None else list(drives)
        driven = [*counted, *guards]
        batch = WashoutBatch(sets, [self.drives[i] for i in driven], self.platform)
        scores = batch.scores(threads=self.threads)
        cue = scores.cue_error[:, : len(counted)].mean(axis=1)
        perceived = scores.perceived_error[:, : len(counted)].mean(axis=1)
        hard = np.array([i not in self.spared for i in driven])
        limited = np.where(hard, scores.at_limit, 0.0)
        violation = limited.sum(axis=1) / max(1, int(hard.sum()))
        cost = (cue if self.measure == "J" else perceived) + penalty(violation)
        cost = np.nan_to_num(cost, nan=_BROKEN, posinf=_BROKEN)
        return Judgement(cue, perceived, scores.at_limit.mean(axis=1), violation, cost, limited)

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
    """What time at a limit costs: nothing without, else a step and a slope.

    J may gain more than that. The result of a search is protected otherwise: see :attr:`.method.Method.best`.
    """
    return np.asarray(np.where(at_limit > 0.0, LIMIT_STEP + LIMIT_SLOPE * at_limit, 0.0))
