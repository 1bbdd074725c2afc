"""The share of the possible improvement that a policy reaches: 0 at the tuned washout, 1 at the optimum."""

from __future__ import annotations

from collections.abc import Mapping

from ..envs.settings import configuration
from .criteria import References


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
