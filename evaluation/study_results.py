"""What a study found, over the drives that every pair finished; as JSON and CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from ..envs.settings import configuration, to_dict
from .criteria import Criteria
from .metrics import Metrics
from .saved import Headed
from .share import shares
from .spreadsheet import save_rows

SCHEMA: Final = 1
"""Version of ``study.json``."""


@configuration
class StudyFailure:
    """A drive without a result.

    Args:
        condition: Under which it was tried.
        policy: Whose it is; None where the maneuver itself could not be made.
        maneuver: That was driven.
        message: What went wrong.
    """

    condition: str
    policy: str | None
    maneuver: str
    message: str


@configuration
class Summary:
    """One policy under one condition, over the drives that every pair finished.

    Args:
        cue_error: Mean J.
        perceived_cue_error: Mean perceived J.
        share: Of the gap between the references under this condition; None where one is missing.
        perceived_share: The same of the perceived J.
        ratio: Mean J over that under the first condition; None where that is missing or 0.
        false_cues: Mean share of time with a false cue.
        tilt_rate_peak: Largest of all drives, rad/s.
        at_limit: Mean share of time with any actuator at any limit.
        most_limited: Largest share of time at a limit of a drive.
    """

    cue_error: float
    perceived_cue_error: float
    share: float | None
    perceived_share: float | None
    ratio: float | None
    false_cues: float
    tilt_rate_peak: float
    at_limit: float
    most_limited: float


@configuration
class StudyResults(Headed):
    """A study: ``study.json``.

    Args:
        conditions: One line about each condition, by name; the first is what others are compared with.
        policies: Names.
        maneuvers: In the means.
        summaries: By condition and policy.
        left_out: By condition and policy: why it was not driven there.
        failures: Drives without a result.
        metrics: By condition, policy and maneuver.
        notes: What policies counted, by condition, policy and maneuver, where they did.
        criteria: The thresholds the metrics were measured with.
    """

    what = "a study"
    version = SCHEMA

    conditions: dict[str, str]
    policies: tuple[str, ...]
    maneuvers: tuple[str, ...]
    summaries: dict[str, dict[str, Summary]]
    left_out: dict[str, dict[str, str]]
    failures: tuple[StudyFailure, ...]
    metrics: dict[str, dict[str, dict[str, Metrics]]]
    notes: dict[str, dict[str, dict[str, dict[str, str]]]]
    criteria: Criteria

    @property
    def driven(self) -> tuple[str, ...]:
        """Policies with a result under any condition; the rest was left out or failed everywhere."""
        found = {policy for policies in self.summaries.values() for policy in policies}
        return tuple(policy for policy in self.policies if policy in found)

    def told_left_out(self) -> list[str]:
        """A line for each policy and reason why it was left out, with the conditions where not under all."""
        reasons: dict[tuple[str, str], list[str]] = {}
        for condition, policies in self.left_out.items():
            for policy, reason in policies.items():
                reasons.setdefault((policy, reason), []).append(condition)
        return [
            f"{policy}{'' if len(under) == len(self.conditions) else ', ' + ', '.join(under)}: {reason}"
            for (policy, reason), under in reasons.items()
        ]

    def save_csv(self, path: Path) -> None:
        """Write ``study.csv``: a row a condition and policy, with the reason where it was left out."""
        save_rows(list(self._rows()), path)

    def _rows(self) -> Iterator[Mapping[str, Any]]:
        empty = dict.fromkeys(Summary.__dataclass_fields__)
        for condition in self.conditions:
            for policy in self.policies:
                found = self.summaries.get(condition, {}).get(policy)
                numbers = empty if found is None else to_dict(found)
                reason = self.left_out.get(condition, {}).get(policy)
                yield {"condition": condition, "policy": policy, **numbers, "left_out": reason}


def common_maneuvers(metrics: Mapping[str, Mapping[str, Mapping[str, Metrics]]]) -> tuple[str, ...]:
    """Maneuvers that every pair finished that finished any."""
    pairs = [drives for policies in metrics.values() for drives in policies.values() if drives]
    return tuple(name for name in (pairs[0] if pairs else ()) if all(name in drives for drives in pairs))


def summarise(
    metrics: Mapping[str, Mapping[str, Mapping[str, Metrics]]], criteria: Criteria | None = None
) -> dict[str, dict[str, Summary]]:
    """Each policy under each condition, over the common maneuvers.

    Args:
        metrics: By condition, policy and maneuver; the first condition is what others are compared with.
        criteria: For the references of the share.
    """
    common = common_maneuvers(metrics)
    if not common:
        return {}
    nominal: dict[str, float] = {}
    found: dict[str, dict[str, Summary]] = {}
    for i, (condition, policies) in enumerate(metrics.items()):
        chosen = {name: [drives[m] for m in common] for name, drives in policies.items() if drives}
        errors = {name: _mean([m.cue_error for m in drives]) for name, drives in chosen.items()}
        nominal = errors if i == 0 else nominal
        found[condition] = _condition(chosen, errors, nominal, criteria or Criteria())
    return found


def _condition(
    drives: Mapping[str, list[Metrics]],
    errors: Mapping[str, float],
    nominal: Mapping[str, float],
    criteria: Criteria,
) -> dict[str, Summary]:
    perceived = {name: _mean([m.perceived_cue_error for m in each]) for name, each in drives.items()}
    gap = shares(errors, perceived, criteria.references)
    return {
        name: Summary(
            cue_error=errors[name],
            perceived_cue_error=perceived[name],
            share=gap[name].cue_error,
            perceived_share=gap[name].perceived_cue_error,
            ratio=errors[name] / nominal[name] if nominal.get(name) else None,
            false_cues=_mean([m.false_cues for m in each]),
            tilt_rate_peak=max(m.tilt_rate_peak for m in each),
            at_limit=_mean([m.at_limit for m in each]),
            most_limited=max(m.at_limit for m in each),
        )
        for name, each in drives.items()
    }


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)
