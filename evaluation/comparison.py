"""The share of the possible improvement that a policy reaches: 0 at the tuned washout, 1 at the optimum."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Final, Literal

from ..envs.settings import configuration
from .metrics import CUE_AXES, Metrics, References


@configuration
class Share:
    """Share of the gap between the washout at its best and the optimum; None where there is no such gap.

    Args:
        cue_error: (J of the baseline - J) / (J of the baseline - J of the optimum).
        perceived_cue_error: The same of the perceived J, whose optimum is another policy.
    """

    cue_error: float | None = None
    perceived_cue_error: float | None = None


def gap_share(value: float, baseline: float | None, ceiling: float | None) -> float | None:
    """How far a value is on its way from the baseline's down to the ceiling's.

    Args:
        value: J of the policy.
        baseline: J of the policy whose share is 0, if it was driven.
        ceiling: J of the policy whose share is 1, if it was driven.

    Returns:
        None where one of the two is missing, or where there is no gap because the baseline is not worse.
    """
    if baseline is None or ceiling is None or not baseline > ceiling:
        return None
    return (baseline - value) / (baseline - ceiling)


def shares(
    cue_error: Mapping[str, float], perceived: Mapping[str, float], references: References
) -> dict[str, Share]:
    """The share of each policy.

    Args:
        cue_error: J by policy, of one drive or a mean over the same drives.
        perceived: Perceived J of the same policies.
        references: Which policies are 0 and 1.
    """
    ends = (cue_error.get(references.baseline), cue_error.get(references.optimum))
    perceived_ends = (perceived.get(references.baseline), perceived.get(references.perceived_optimum))
    return {
        name: Share(gap_share(cue_error[name], *ends), gap_share(perceived[name], *perceived_ends))
        for name in cue_error
    }


# Which policy is better, by how much, and why.
#
# J is a sum over axes, and each axis's part a sum over what the simulator did wrong at the time: a
# false cue, a
# missing cue, or a cue there but of the wrong size or time ("shape"). The difference of two J is therefore a
# sum over axis and cause, and the largest terms are the reason.


Cause = Literal["false", "missing", "shape"]
CAUSES: Final[tuple[Cause, ...]] = ("false", "missing", "shape")
STILL: Final = "no-motion"
"""The policy that does nothing, which every other must beat."""

_WORDS: Final[Mapping[Cause, tuple[str, str]]] = {
    "false": ("fewer or smaller false cues", "false cues"),
    "missing": ("fewer missing cues", "missing cues"),
    "shape": ("cues nearer in size and time", "cues of the wrong size or time"),
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
        cause: What contributes most on this axis.
        worse_axis: The axis on which it loses most, if it loses on any.
        worse_cause: What it does wrong there.
    """

    over: str
    cue_error: float
    margin: float
    axis: str | None
    axis_share: float | None
    cause: Cause | None
    worse_axis: str | None
    worse_cause: Cause | None


@configuration
class Verdict:
    """The order of the policies on one maneuver, or over the suite.

    Args:
        maneuver: Name, or "all" for the mean over the suite.
        ranking: Policies, best first, by J.
        cue_error: J of the best.
        perceived_best: Best by the perceived J.
        advantages: Of the best over the second and, if another one, over no motion.
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
        lines = [f"{self.best} is best with J = {self.cue_error:.3g}."]
        lines += [_explain(self.best, advantage) for advantage in self.advantages]
        if self.perceived_best != self.best:
            lines.append(f"By the perceived J, {self.perceived_best} is best.")
        return lines


@configuration
class Standing:
    """One policy over the suite.

    Args:
        policy: Name.
        maneuvers: Number of maneuvers in the means: those that every policy finished.
        cue_error: Mean J over them.
        perceived_cue_error: Mean perceived J.
        wins: Maneuvers on which its J is lowest.
        worst_maneuver: Where its J is highest.
        share: Of the gap between the references' means; None where one of them is missing.
        perceived_share: The same of the perceived J.
    """

    policy: str
    maneuvers: int
    cue_error: float
    perceived_cue_error: float
    wins: int
    worst_maneuver: str
    share: float | None = None
    perceived_share: float | None = None


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
    return Advantage(
        over=name,
        cue_error=theirs,
        margin=total / theirs,
        axis=best,
        axis_share=by_axis[best] / total,
        cause=_extreme(gain, best, 1.0),
        worse_axis=worst if loses else None,
        worse_cause=_extreme(gain, worst, -1.0) if loses else None,
    )


def _extreme(gain: Terms, axis: str, sign: float) -> Cause:
    """The cause with the largest gain (sign 1) or loss (sign -1) on an axis."""
    signed: dict[Cause, float] = {cause: sign * gain[axis, cause] for cause in CAUSES}
    return max(signed, key=signed.__getitem__)


def judge(maneuver: str, policies: Mapping[str, Metrics]) -> Verdict:
    """The verdict on one maneuver from the metrics of each policy (at least one)."""
    perceived = {name: metrics.perceived_cue_error for name, metrics in policies.items()}
    return _judge(maneuver, {name: terms(metrics) for name, metrics in policies.items()}, perceived)


def judge_suite(
    maneuvers: Mapping[str, Mapping[str, Metrics]], references: References | None = None
) -> tuple[Verdict | None, list[Standing]]:
    """The verdict on the mean J and each policy's standing, best first.

    Only maneuvers that every policy finished count, so that all means are over the same drives.

    Args:
        maneuvers: Metrics by maneuver and policy.
        references: Policies between which the share of the gap is measured.

    Returns:
        None and an empty list where there is no such maneuver.
    """
    common = common_drives(maneuvers)
    if not common:
        return None, []
    names = sorted(next(iter(common.values())))
    perceived = {
        name: _mean(drives[name].perceived_cue_error for drives in common.values()) for name in names
    }
    verdict = _judge("all", {name: _mean_terms(common, name) for name in names}, perceived)
    winners = [judge(maneuver, drives).best for maneuver, drives in common.items()]
    errors = {name: _mean(drives[name].cue_error for drives in common.values()) for name in names}
    gap = shares(errors, perceived, references or References())
    standings = [_standing(name, common, winners.count(name), gap[name]) for name in verdict.ranking]
    return verdict, standings


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


def _standing(name: str, drives: Mapping[str, Mapping[str, Metrics]], wins: int, share: Share) -> Standing:
    return Standing(
        policy=name,
        maneuvers=len(drives),
        cue_error=_mean(policies[name].cue_error for policies in drives.values()),
        perceived_cue_error=_mean(policies[name].perceived_cue_error for policies in drives.values()),
        wins=wins,
        worst_maneuver=max(drives, key=lambda maneuver: drives[maneuver][name].cue_error),
        share=share.cue_error,
        perceived_share=share.perceived_cue_error,
    )


def _mean_terms(drives: Mapping[str, Mapping[str, Metrics]], name: str) -> Terms:
    every = [terms(policies[name]) for policies in drives.values()]
    return {key: _mean(parts[key] for parts in every) for key in product(CUE_AXES, CAUSES)}


def _mean(values: Iterable[float]) -> float:
    listed = list(values)
    return sum(listed) / len(listed)


def _explain(best: str, why: Advantage) -> str:
    if why.axis is None or why.axis_share is None or why.cause is None:
        return f"{why.over} is level with it (J = {why.cue_error:.3g})."
    gained = why.axis_share * why.margin * why.cue_error
    text = (
        f"Its J is {why.margin:.0%} below that of {why.over} ({why.cue_error:.3g}), mainly by "
        f"{gained:.3g} less on {why.axis}: {_WORDS[why.cause][0]}."
    )
    if why.worse_axis is not None and why.worse_cause is not None:
        text += f" {best} is the worse of the two on {why.worse_axis}: {_WORDS[why.worse_cause][1]}."
    return text
