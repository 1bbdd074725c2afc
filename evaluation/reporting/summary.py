"""The summary of an evaluation: which policy is best, by how much, how sure that is, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ..comparison import STILL, common_drives
from ..metrics import over_drives
from ..results import Results
from ..trajectory import Floats
from .text import how_many, microseconds, number

_RESAMPLES: Final = 10_000
_SEED: Final = 0
_CONFIDENCE: Final = 0.95
_LEAST: Final = 1e-3
"""Least J on the axis of the chart."""


@dataclass(frozen=True)
class Interval:
    """A mean over drives and its confidence interval; without one where there are fewer than three drives.

    Args:
        value: The mean.
        low: Lower end.
        high: Upper end.
    """

    value: float
    low: float | None = None
    high: float | None = None

    @property
    def text(self) -> str:
        """The mean with its interval."""
        return number(self.value) if self.low is None else f"{number(self.value)} ({self.ends})"

    @property
    def ends(self) -> str:
        """The interval alone."""
        return f"{number(self.low)} to {number(self.high)}"


@dataclass(frozen=True)
class PolicySummary:
    """One policy over all drives.

    Args:
        policy: Name.
        error: Mean J.
        excess: By how much its mean J is above the best policy's, as a share of its own; None for the best.
        step_mean: Mean time of a step, s.
        step_max: Longest step, s.
    """

    policy: str
    error: Interval
    excess: Interval | None
    step_mean: float | None
    step_max: float | None


def resampled_means(values: Floats) -> Floats:
    """Bootstrap over drives: (10,000, k) means of (n, k) values, whose rows are drawn with replacement.

    All columns share each draw, so that policies are compared over the same drives. The draws are the same
    at every call.
    """
    rows = np.random.default_rng(_SEED).integers(0, len(values), size=(_RESAMPLES, len(values)))
    return np.asarray(values[rows].mean(axis=1))


def summarize(results: Results) -> list[PolicySummary]:
    """Every policy over the drives that all policies finished, best first."""
    common = common_drives(results.maneuvers)
    if not common:
        return []
    policies = [score.policy for score in results.scores]
    errors = np.array([[drives[name].cue_error for name in policies] for drives in common.values()])
    means, draws = errors.mean(axis=0), resampled_means(errors)

    def interval(value: float, drawn: Floats) -> Interval:
        if len(errors) < 3:
            return Interval(value)
        tail = 50.0 * (1.0 - _CONFIDENCE)
        low, high = np.percentile(drawn, [tail, 100.0 - tail])
        return Interval(value, float(low), float(high))

    summaries = []
    for i, name in enumerate(policies):
        combined = over_drives([drives[name] for drives in common.values()])
        excess = None
        if i and means[i] > 0.0 and draws[:, i].min() > 0.0:
            excess = interval(float(1.0 - means[0] / means[i]), 1.0 - draws[:, 0] / draws[:, i])
        summaries.append(
            PolicySummary(
                policy=name,
                error=interval(float(means[i]), draws[:, i]),
                excess=excess,
                step_mean=combined["step_time_mean"],
                step_max=combined["step_time_max"],
            )
        )
    return summaries


def sentences(summaries: list[PolicySummary], drives: int) -> list[str]:
    """The summary in words."""
    if not summaries:
        return []
    best = summaries[0]
    sure = "" if best.error.low is None else f" (95 % confidence interval over drives: {best.error.ends})"
    lines = [
        f"{best.policy} is best: mean J = {number(best.error.value)} over {how_many(drives, 'drive')}{sure}."
    ]
    rivals = [s for s in summaries[1:2] if s.policy != STILL]
    rivals += [s for s in summaries[1:] if s.policy == STILL]
    for rival in rivals:
        if rival.excess is not None:
            lines.append(_over(rival))
    if best.step_mean is not None:
        lines.append(
            f"It takes {microseconds(best.step_mean)} µs a step on average, "
            f"and {microseconds(best.step_max)} µs at most."
        )
    return lines


def _over(rival: PolicySummary) -> str:
    excess = rival.excess
    assert excess is not None
    text = f"Its mean J is {100.0 * excess.value:.0f} % lower than that of {rival.policy}"
    if excess.low is None or excess.high is None:
        return f"{text}."
    text += f" ({100.0 * excess.low:.0f} to {100.0 * excess.high:.0f} %)"
    if excess.low <= 0.0:
        return f"{text}: over so few drives, either may be the better one."
    return f"{text}."


@dataclass(frozen=True)
class Chart:
    """Means and intervals on a logarithmic axis; places are in percent of its width.

    Args:
        points: Lower end, mean and upper end of each policy.
        marks: Places and values of its marks.
    """

    points: list[tuple[float, float, float]]
    marks: list[tuple[float, str]]


def chart(summaries: list[PolicySummary]) -> Chart:
    """The mean J of each policy, to draw."""
    spans = [
        (s.error.value, s.error.value)
        if s.error.low is None or s.error.high is None
        else (s.error.low, s.error.high)
        for s in summaries
    ]
    least = max(_LEAST, min((low for low, _ in spans), default=1.0))
    low, high = np.log10(0.9 * least), np.log10(1.1 * max([least, *(end for _, end in spans)]))

    def place(value: float) -> float:
        return round(float(100.0 * (np.log10(max(value, least)) - low) / (high - low)), 2)

    marks = [m * 10.0**exponent for exponent in range(-3, 9) for m in (1.0, 2.0, 5.0)]
    return Chart(
        points=[
            (place(a), place(s.error.value), place(b)) for s, (a, b) in zip(summaries, spans, strict=True)
        ],
        marks=[(place(m), f"{m:g}") for m in marks if low <= np.log10(m) <= high],
    )
