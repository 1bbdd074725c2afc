"""The table of an evaluation: each policy over the same drives, from no motion to the optimum."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ..comparison import common_drives
from ..metrics import CUE_AXES, METRICS, mean, over_drives
from ..reporting.tables import at_scale, policy_table
from ..reporting.text import TextTable, how_many, save_markdown
from ..results import Results, save_frame

if TYPE_CHECKING:
    import pandas as pd

BENCHMARK_POLICIES: Final = (
    "no-motion",
    "classical",
    "classical-tuned",
    "classical-per-maneuver",
    "optimal-washout",
    "optimal-washout-tuned",
    "adaptive",
    "adaptive-tuned",
    "mpc",
    "mpc-tuned",
    "nmpc",
    "learned-ppo-now",
    "learned-any-now",
    "learned-perceived",
    "learned",
    "learned-controls",
    "learned-road",
    "mpc-preview",
    "nmpc-preview",
    "mpc-full",
    "learned-ppo",
    "learned-any",
    "learned-preview",
    "optimum-perceived",
    "optimum",
)
"""Policies in order: washouts, controllers without and with preview, and the optimum."""

OLD_COLUMNS: Final = {"share": "normalized_score", "perceived_share": "perceived_normalized_score"}
"""Columns of ``ladder.csv``, the ``benchmark.csv`` of earlier versions, with their names of today."""


def benchmark_policies(known: Iterable[str]) -> list[str]:
    """The policies of the benchmark among those known, in its order."""
    names = set(known)
    return [name for name in BENCHMARK_POLICIES if name in names]


def benchmark(results: Results) -> pd.DataFrame:
    """One row a policy, in SI units, over the drives that every policy finished.

    The policies of the benchmark come first, in its order, then the others, best first. Columns: the metrics
    of a drive, each combined as it declares; the normalized scores of the mean J; and the axis with the
    largest mean part of J, with that part as a share of the mean J.
    """
    import pandas as pd

    common = common_drives(results.maneuvers)
    scores = {score.policy: score for score in results.scores}
    rows = []
    for policy in dict.fromkeys([*benchmark_policies(scores), *scores]):
        score, drives = scores[policy], [policies[policy] for policies in common.values()]
        parts = {axis: mean([m.axes[axis].cue_error for m in drives]) for axis in CUE_AXES}
        worst = max(parts, key=parts.__getitem__)
        rows.append(
            {
                "policy": policy,
                "maneuvers": score.maneuvers,
                "normalized_score": score.normalized_score,
                "perceived_normalized_score": score.perceived_normalized_score,
                "worst_axis": worst,
                "worst_axis_part": parts[worst] / score.cue_error if score.cue_error > 0.0 else None,
                **over_drives(drives),
            }
        )
    # A metric that no drive has is a column of NaN.
    return pd.DataFrame(rows).astype({name: float for name in METRICS if rows})


def benchmark_table(results: Results) -> TextTable:
    """Every policy over the suite, in the order of the benchmark; the best by J is stressed."""
    rows = benchmark(results)
    count = how_many(rows["maneuvers"].iloc[0] if len(rows) else 0, "drive")
    return policy_table(f"Benchmark, means over {count}{at_scale(results)}", rows, "benchmark")


def save_benchmark(results: Results, folder: Path) -> None:
    """Write ``benchmark.csv`` (SI units) and ``benchmark.md`` (the table, and the skipped policies)."""
    save_frame(benchmark(results), folder / "benchmark.csv")
    skipped = [f"Skipped: {policy}: {reason}" for policy, reason in results.skipped.items()]
    save_markdown(folder / "benchmark.md", benchmark_table(results), *skipped)


def load_benchmark(path: str | Path) -> pd.DataFrame:
    """Read ``benchmark.csv``, or the ``ladder.csv`` of an earlier version."""
    import pandas as pd

    # Read as text: pandas 2 does not read floats back exactly.
    rows = pd.read_csv(path, dtype=str).rename(columns=OLD_COLUMNS)
    types = {name: float for name in rows if name not in ("policy", "worst_axis")}
    return rows.astype({**types, "maneuvers": int})
