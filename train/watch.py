"""What a person should know while a training runs: references beside its J, and warnings in plain words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from .validation import Score

_ENDS: Final = 0.05
"""Share of the time at an end of travel from which the machine drifts there."""

_WORSE: Final = 1.1
"""J over that of the start from which a training does harm."""

_BETTER: Final = 0.99
"""J over that of the start from which something is learned."""

_LONG: Final = 5
"""Validations without anything learned that are long."""


@dataclass(frozen=True)
class References:
    """J on the validation drives of what an agent is compared with; None where it was not measured.

    Args:
        washout: Of the classical washout.
        standing: Of standing still.
        start: Of the controller the training begins with: the base policy alone, or the first network.
    """

    washout: float | None = None
    standing: float | None = None
    start: float | None = None

    def shown(self) -> dict[str, float]:
        """Those there are, by the names that people read."""
        named = {"washout": self.washout, "still": self.standing, "start": self.start}
        return {name: value for name, value in named.items() if value is not None}


class Watch:
    """Looks at every validation; each warning is given once, and again when its cause was gone meanwhile."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._count, self._best = 0, math.inf

    def look(self, score: Score, references: References) -> list[str]:
        """Warnings that are new with this validation.

        Args:
            score: The validation's.
            references: What it is compared with.
        """
        self._best = min(self._best, score.cue_error)
        causes = self._causes(score, references.start)
        self._count += 1
        new = [sentence for name, sentence in causes.items() if name not in self._told]
        self._told = set(causes)
        return new

    def _causes(self, score: Score, start: float | None) -> dict[str, str]:
        j, causes = score.cue_error, dict[str, str]()
        if score.at_ends > _ENDS:
            causes["ends"] = (
                f"the machine drifts to its ends: it is at one {100.0 * score.at_ends:.0f} % of the time. "
                "Charge travel early (task.reward.stroke_margin, stroke_braking) or look further ahead"
            )
        if score.noise is not None and score.noise > j:
            causes["noise"] = (
                f"exploring costs more than the error itself: J {j:.3g}, with it {j + score.noise:.3g}. "
                "Explore less (log_std_init, noise_std), or make an action smaller (task.action)"
            )
        if start is None:
            return causes
        if j > _WORSE * start:
            causes["worse"] = (
                f"J is {j:.3g}, {100.0 * (j / start - 1.0):.0f} % above that of the controller it began with "
                f"({start:.3g}). Take a smaller learning rate, look further ahead (gamma), or explore less"
            )
        if self._count >= _LONG and self._best > _BETTER * start:
            causes["nothing"] = (
                f"nothing is learned yet: after {self._count} validations the best J is {self._best:.3g}, "
                f"that of the controller it began with {start:.3g}. See the guide to training, 'What you see'"
            )
        return causes

    def state(self) -> dict[str, Any]:
        """For :meth:`restore`."""
        return {"told": sorted(self._told), "count": self._count, "best": self._best}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self._told, self._count, self._best = set(state["told"]), state["count"], state["best"]
