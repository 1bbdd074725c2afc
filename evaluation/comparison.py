"""Comparison of policies: which is better, by how much, and why.

Normalized score: 0 is the reference washout, 1 is the optimum, as in papers on reinforcement learning.

J is a sum over axes, and each axis has a sum over causes: a false cue, a missing cue, or a cue of the wrong
size or time ("shape"). The difference of two J is therefore a sum over axis and cause. Its largest terms are
the reason why one policy is better than another.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from typing import Final, Literal

from ..envs.settings import configuration, renamed
from .metrics import CUE_AXES, Metrics, References, mean


@configuration
class NormalizedScore:
    """The normalized score of one policy; None where a reference is missing or no better than the baseline.

    Args:
        cue_error: (J of the baseline - J) / (J of the baseline - J of the optimum).
        perceived_cue_error: The same of the perceived J, whose optimum is another policy.
    """

    cue_error: float | None = None
    perceived_cue_error: float | None = None


def normalized_score(value: float, baseline: float | None, optimum: float | None) -> float | None:
    """The place of a J between those of the baseline (0) and of the optimum (1).

    Args:
        value: J of the policy.
        baseline: J of the policy whose score is 0, if it was driven.
        optimum: J of the policy whose score is 1, if it was driven.

    Returns:
        None where one of the two is missing, where the baseline is not the worse of the two, or where their
        gap is too small for a number.
    """
    if baseline is None or optimum is None or not baseline > optimum:
        return None
    score = (baseline - value) / (baseline - optimum)
    return score if math.isfinite(score) else None


def normalized_scores(
    cue_error: Mapping[str, float], perceived: Mapping[str, float], references: References
) -> dict[str, NormalizedScore]:
    """The score of each policy.

    Args:
        cue_error: J by policy, of one drive or a mean over the same drives.
        perceived: Perceived J of the same policies.
        references: The policies with scores 0 and 1.
    """
    ends = (cue_error.get(references.baseline), cue_error.get(references.optimum))
    perceived_ends = (perceived.get(references.baseline), perceived.get(references.perceived_optimum))
    return {
        name: NormalizedScore(
            normalized_score(cue_error[name], *ends), normalized_score(perceived[name], *perceived_ends)
        )
        for name in cue_error
    }


Cause = Literal["false", "missing", "shape"]
CAUSES: Final[tuple[Cause, ...]] = ("false", "missing", "shape")
STILL: Final = "no-motion"
"""The policy that does nothing. Every other one must beat it."""

_GAINS: Final[Mapping[Cause, str]] = {
    "false": "fewer or smaller false cues",
    "missing": "fewer missing cues",
    "shape": "cues nearer in size and time",
}
_LOSSES: Final[Mapping[Cause, str]] = {
    "false": "false cues",
    "missing": "missing cues",
    "shape": "cues of the wrong size or time",
}

Terms = Mapping[tuple[str, Cause], float]
"""Parts of J by axis and cause; they add up to J."""


@configuration
class Advantage:
    """Why one policy's J is lower than another's.

    Args:
        over: The policy it is compared with.
        cue_error: J of that policy.
        margin: By how much J is lower, as a share of that J.
        axis: The axis that contributes most to the difference.
        axis_share: Its part of the difference; above 1 where other axes are worse.
        cause: The cause that contributes most on this axis.
        worse_axis: The axis on which it loses most, if it loses on any.
        worse_cause: The cause of the loss there.
    """

    over: str
    cue_error: float
    margin: float
    axis: str | None
    axis_share: float | None
    cause: Cause | None
    worse_axis: str | None
    worse_cause: Cause | None

    @property
    def sentence(self) -> str:
        """The advantage in words; "it" is the better policy."""
        if self.axis is None or self.axis_share is None or self.cause is None:
            return f"{self.over} has the same J ({self.cue_error:.3g})."
        gained = self.axis_share * self.margin * self.cue_error
        text = (
            f"Its J is {self.margin:.0%} lower than that of {self.over} ({self.cue_error:.3g}). "
            f"It gains most on {self.axis} ({gained:.3g}): {_GAINS[self.cause]}."
        )
        if self.worse_axis is not None and self.worse_cause is not None:
            text += f" It is worse on {self.worse_axis}: {_LOSSES[self.worse_cause]}."
        return text


@configuration
class Verdict:
    """The order of the policies on one maneuver, or over the suite.

    Args:
        maneuver: Name, or "all" for the mean over the suite.
        ranking: Policies, best first, by J.
        cue_error: J of the best.
        perceived_best: Best by the perceived J.
        advantages: Of the best over the second and, if that is another one, over no motion.
    """

    maneuver: str
    ranking: tuple[str, ...]
    cue_error: float
    perceived_best: str
    advantages: tuple[Advantage, ...]

    @property
    def best(self) -> str:
        """The policy with the lowest J."""
        return self.ranking[0]

    @property
    def sentences(self) -> list[str]:
        """The verdict in words."""
        lines = [f"{self.best} is best: J = {self.cue_error:.3g}."]
        lines += [advantage.sentence for advantage in self.advantages]
        if self.perceived_best != self.best:
            lines.append(f"By the perceived J, {self.perceived_best} is best.")
        return lines


@configuration
class SuiteScore:
    """One policy over the suite: the maneuvers that every policy finished.

    Args:
        policy: Name.
        maneuvers: Number of maneuvers in the means.
        cue_error: Mean J over them.
        perceived_cue_error: Mean perceived J.
        wins: Maneuvers on which its J is lowest.
        worst_maneuver: The one with its highest J.
        normalized_score: Of the mean J; None where a reference is missing.
        perceived_normalized_score: The same of the perceived J.
    """

    policy: str
    maneuvers: int
    cue_error: float
    perceived_cue_error: float
    wins: int
    worst_maneuver: str
    normalized_score: float | None = renamed("normalized_score", "share", default=None)
    perceived_normalized_score: float | None = renamed(
        "perceived_normalized_score", "perceived_share", default=None
    )


def terms(metrics: Metrics) -> Terms:
    """J by axis and cause."""
    parts: dict[tuple[str, Cause], float] = {}
    for axis, values in metrics.axes.items():
        parts[axis, "false"] = values.cue_error_false
        parts[axis, "missing"] = values.cue_error_missing
        parts[axis, "shape"] = values.cue_error - values.cue_error_false - values.cue_error_missing
    return parts


def advantage(of: Terms, name: str, over: Terms) -> Advantage:
    """Why the J of the terms ``of`` is lower than that of ``over``, which belongs to the policy ``name``."""
    gain = {key: over[key] - of[key] for key in over}
    by_axis = {axis: sum(gain[axis, cause] for cause in CAUSES) for axis in CUE_AXES}
    total, theirs = sum(gain.values()), sum(over.values())
    if total <= 0.0:
        return Advantage(name, theirs, 0.0, None, None, None, None, None)
    best, worst = max(by_axis, key=by_axis.__getitem__), min(by_axis, key=by_axis.__getitem__)
    loses = by_axis[worst] < 0.0

    def largest(axis: str, sign: float) -> Cause:
        """The cause with the largest gain (sign 1) or loss (sign -1) on an axis."""
        signed: dict[Cause, float] = {cause: sign * gain[axis, cause] for cause in CAUSES}
        return max(signed, key=signed.__getitem__)

    return Advantage(
        over=name,
        cue_error=theirs,
        margin=total / theirs,
        axis=best,
        axis_share=by_axis[best] / total,
        cause=largest(best, 1.0),
        worse_axis=worst if loses else None,
        worse_cause=largest(worst, -1.0) if loses else None,
    )


def judge(maneuver: str, policies: Mapping[str, Metrics]) -> Verdict:
    """The verdict on one maneuver from the metrics of each policy (at least one)."""
    perceived = {name: metrics.perceived_cue_error for name, metrics in policies.items()}
    return _judge(maneuver, {name: terms(metrics) for name, metrics in policies.items()}, perceived)


def judge_suite(
    maneuvers: Mapping[str, Mapping[str, Metrics]], references: References | None = None
) -> tuple[Verdict | None, list[SuiteScore]]:
    """The verdict on the mean J and each policy's score, best first.

    Only maneuvers that every policy finished count, so that all means are over the same drives.

    Args:
        maneuvers: Metrics by maneuver and policy.
        references: Policies between which the normalized score is measured.

    Returns:
        None and an empty list where there is no such maneuver.
    """
    common = common_drives(maneuvers)
    if not common:
        return None, []
    drives = {name: [policies[name] for policies in common.values()] for name in next(iter(common.values()))}
    errors = {name: mean([m.cue_error for m in each]) for name, each in drives.items()}
    perceived = {name: mean([m.perceived_cue_error for m in each]) for name, each in drives.items()}
    means = {}
    for name, each in drives.items():
        parts = [terms(metrics) for metrics in each]
        means[name] = {key: mean([one[key] for one in parts]) for key in product(CUE_AXES, CAUSES)}
    verdict = _judge("all", means, perceived)
    winners = [judge(maneuver, policies).best for maneuver, policies in common.items()]
    scores = normalized_scores(errors, perceived, references or References())
    return verdict, [
        SuiteScore(
            policy=name,
            maneuvers=len(common),
            cue_error=errors[name],
            perceived_cue_error=perceived[name],
            wins=winners.count(name),
            worst_maneuver=max(common, key=lambda maneuver: common[maneuver][name].cue_error),
            normalized_score=scores[name].cue_error,
            perceived_normalized_score=scores[name].perceived_cue_error,
        )
        for name in verdict.ranking
    ]


def common_drives(maneuvers: Mapping[str, Mapping[str, Metrics]]) -> dict[str, Mapping[str, Metrics]]:
    """The maneuvers that every policy finished."""
    names = {policy for drives in maneuvers.values() for policy in drives}
    return {maneuver: drives for maneuver, drives in maneuvers.items() if drives and set(drives) == names}


def _judge(maneuver: str, policies: Mapping[str, Terms], perceived: Mapping[str, float]) -> Verdict:
    errors = {name: sum(parts.values()) for name, parts in policies.items()}
    ranking = tuple(sorted(errors, key=lambda name: (errors[name], name)))
    best = ranking[0]
    rivals = list(dict.fromkeys([*ranking[1:2], *([STILL] if STILL in ranking[1:] else [])]))
    return Verdict(
        maneuver=maneuver,
        ranking=ranking,
        cue_error=errors[best],
        perceived_best=min(perceived, key=lambda name: (perceived[name], name)),
        advantages=tuple(advantage(policies[best], name, policies[name]) for name in rivals),
    )
