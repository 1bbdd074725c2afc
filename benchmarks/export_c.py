"""Exports in C against Python over all standard maneuvers: differences, and the time of a step.

``python -m benchmarks.export_c`` prints the tables of docs/results/real-time.md; it needs a C compiler.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from motion_cueing.envs.maneuvers import get_maneuver, maneuver_names
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime.export import make_source
from motion_cueing.realtime.export.check import compare, compile_shared

CASES = [
    ("classical", "paper"),
    ("adaptive", "24-inch"),
    ("optimal-washout", "nads-1"),
    ("linear-washout", "paper"),
    ("learned", "paper"),
    ("learned-preview", "paper"),
    ("learned-any", "24-inch"),
    ("learned-ppo-now", "paper"),
    ("learned-ppo", "paper"),
]


def main() -> None:
    """Print a row for each policy."""
    drives = [get_maneuver(name).drive() for name in maneuver_names()]
    print("| policy | machine | export | double | single | median, us | p99, us |")
    print("|---|---|---|---|---|---|---|")
    for name, machine in CASES:
        platform = get_platform(machine)
        policy = make_policy(name, platform)
        for export, where in (("by itself", None), ("to set-points", platform)):
            found = {}
            for single in (False, True):
                with tempfile.TemporaryDirectory() as folder:
                    library = compile_shared(make_source(policy, where, single=single), Path(folder))
                    found[single] = [compare(library, policy, platform, drive) for drive in drives]
            largest = {single: max(one.difference for one in all_) for single, all_ in found.items()}
            seconds = 1e6 * np.concatenate([one.seconds for one in found[False]])
            p50, p99 = np.percentile(seconds, [50, 99])
            print(
                f"| `{name}` | {machine} | {export} | {largest[False]:.0e} | {largest[True]:.0e} "
                f"| {p50:.2f} | {p99:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
