"""The benchmark: policies over fixed, versioned drives, with intervals; and the table of an evaluation.

``motion-cueing benchmark`` runs it; docs/guides/benchmark.md explains it.
"""

from .compare import compare, comparison_table
from .results import BenchmarkResults, PolicyResult, RunResult, SplitResult, Summary
from .run import BenchmarkRequest, Entrant, run_benchmark
from .splits import BENCHMARK_VERSION, SPLITS, Split, get_split
from .statistics import Estimate, worst_tenth
from .table import (
    BENCHMARK_POLICIES,
    benchmark,
    benchmark_policies,
    benchmark_table,
    load_benchmark,
    save_benchmark,
)

__all__ = [
    "BENCHMARK_POLICIES",
    "BENCHMARK_VERSION",
    "SPLITS",
    "BenchmarkRequest",
    "BenchmarkResults",
    "Entrant",
    "Estimate",
    "PolicyResult",
    "RunResult",
    "Split",
    "SplitResult",
    "Summary",
    "benchmark",
    "benchmark_policies",
    "benchmark_table",
    "compare",
    "comparison_table",
    "get_split",
    "load_benchmark",
    "run_benchmark",
    "save_benchmark",
    "worst_tenth",
]
