"""Agreement: whether a metric orders the policies as J does, by rank correlations over the drives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .comparison import common_drives
from .metrics import METRICS, Metric, Metrics, over_drives

if TYPE_CHECKING:
    import pandas as pd

LEAST_POLICIES: Final = 3
"""Fewer policies have no order worth a correlation."""
_NO_RIVALS: Final = ("cue_error", "worst_second_time")
"""Metrics of the table of what people feel that order no policies beside J."""


def compared_metrics() -> dict[str, Metric]:
    """The metrics of what people feel that are compared with J, by name."""
    return {name: one for name, one in METRICS.items() if "feel" in one.tables and name not in _NO_RIVALS}


def agreement(maneuvers: Mapping[str, Mapping[str, Metrics]]) -> pd.DataFrame:
    """One row a metric and reading: its rank correlations with J about the order of the policies.

    A metric is read as its value, of which less is better. A ratio to the car's is also read as its distance
    from 1: a dose prefers a machine that stands still, fidelity prefers the car's dose. Correlations are
    computed for each drive over its policies, then averaged over the drives in which they are defined.

    Columns: ``metric``; ``reading`` ("value" or "distance from 1"); ``drives``, the number of drives; mean
    ``spearman`` and ``kendall`` (tau b); ``lowest``, the lowest Spearman's rho of a drive, and ``lowest_on``,
    that drive; and ``spearman_overall``, of the values over all drives, as each metric combines them.

    Args:
        maneuvers: Metrics by maneuver and policy. Drives that not every policy finished are left out.
    """
    import pandas as pd

    common = common_drives(maneuvers)
    policies = list(next(iter(common.values()), {}))
    overall = [over_drives([drives[policy] for drives in common.values()]) for policy in policies]
    by_drive = {
        name: [{metric: getattr(drives[policy], metric) for metric in METRICS} for policy in policies]
        for name, drives in common.items()
    }
    rows = []
    for name, one in compared_metrics().items():
        for reading, order in _readings(one).items():
            found = {drive: _correlations(each, name, order) for drive, each in by_drive.items()}
            defined = {drive: pair for drive, pair in found.items() if pair is not None}
            lowest = min(defined, key=lambda drive: defined[drive][0], default=None)
            whole = _correlations(overall, name, order)
            rows.append(
                {
                    "metric": name,
                    "reading": reading,
                    "drives": len(defined),
                    "spearman": float(np.mean([rho for rho, _ in defined.values()])) if defined else None,
                    "kendall": float(np.mean([tau for _, tau in defined.values()])) if defined else None,
                    "lowest": None if lowest is None else defined[lowest][0],
                    "lowest_on": lowest,
                    "spearman_overall": None if whole is None else whole[0],
                }
            )
    return pd.DataFrame(rows)


def _readings(one: Metric) -> dict[str, Callable[[float], float]]:
    """The ways in which a metric orders policies, best first by the lowest number."""
    if one.better == "higher":
        return {"value": lambda value: -value}
    readings: dict[str, Callable[[float], float]] = {"value": float}
    if one.better == "one":
        readings["distance from 1"] = lambda value: abs(value - 1.0)
    return readings


def _correlations(
    policies: Sequence[Mapping[str, Any]], name: str, order: Callable[[float], float]
) -> tuple[float, float] | None:
    """Spearman's rho and Kendall's tau of a metric and J; None where they are undefined."""
    from scipy.stats import kendalltau, spearmanr

    pairs = [(each["cue_error"], order(each[name])) for each in policies if each[name] is not None]
    if len(pairs) < LEAST_POLICIES:
        return None
    errors, values = np.array(pairs).T
    if np.ptp(errors) == 0.0 or np.ptp(values) == 0.0:
        return None
    return float(spearmanr(errors, values).statistic), float(kendalltau(errors, values).statistic)
