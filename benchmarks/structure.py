"""What structure and horizon are worth to the gradient through the machine: short trainings, some seeds each.

Run it with `python -m benchmarks.structure --out runs/structure`; a training of it that was stopped goes on.
docs/notes/training.md has what it found.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from motion_cueing.evaluation.reporting.text import TextTable, number, print_table, table_console
from motion_cueing.train.config import load_config, merge
from motion_cueing.train.logs import read_log
from motion_cueing.train.run import RunFolder
from motion_cueing.train.training import Training

STEPS = 1_200_000
EVERY = 120_000

BASE: dict[str, Any] = {
    "n_envs": 24,
    "steps": STEPS,
    "log_every": EVERY,
    "task": {
        "observation": {"memory": [0.1, 0.5, 2.0, 8.0], "frame": "cab"},
        "action": {"frame": "cab", "authority": 1.0, "repeat": 2},
        "reward": {
            "weights": {"stroke": 10.0, "tilt_rate": 0.05},
            "stroke_margin": 0.75,
            "stroke_braking": 0.3,
        },
        "episode": {
            "random": {"urban": 0.2, "rural": 0.1, "track": 0.3, "hilly": 0.1, "strip": 0.15, "cones": 0.15},
            "library": 128,
            "duration": 20.0,
            "platform_offset": 0.2,
            "random_start": True,
        },
    },
    "hyperparameters": {
        "learning_rate": 6.0e-4,
        "window": 10.0,
        "outlier": 3.0,
        "offset": 1.0,
        "standardize": True,
    },
    "validation": {"every": EVERY, "drives": 24},
    "checkpoints": {"every": STEPS // 2},
}
"""The variant `base`: from springs and relative to what they do, in the cab's frame, with memory."""

VARIANTS: dict[str, dict[str, Any]] = {
    "base": {},
    "machine-frame": {"task": {"observation": {"frame": "machine"}, "action": {"frame": "machine"}}},
    "no-memory": {"task": {"observation": {"memory": []}}},
    "preview": {"task": {"observation": {"preview": 10}}},
    "unscaled": {"hyperparameters": {"standardize": False}},
    "from-washout": {},
    "from-washout-window-2s": {"hyperparameters": {"window": 2.0}},
    "from-washout-window-2s-value": {"hyperparameters": {"window": 2.0, "value": {}}},
    "from-washout-muon": {"hyperparameters": {"hidden_rate": 0.1}},
}
"""What each changes."""

WASHOUT: dict[str, Any] = merge(
    {key: BASE[key] for key in ("n_envs", "task")},
    {"steps": 10_800_000, "hyperparameters": {"population": 15}, "task": {"episode": {"duration": 30.0}}},
)
"""The linear washout that the variants `from-washout` begin with."""


def trained(folder: Path, algo: str, fields: dict[str, Any]) -> Training:
    """A training that is over."""
    training = Training(RunFolder.take_up(folder, load_config(algo, None, **fields)))
    training.train()
    return training


def fields_of(variant: str, seed: int, out: Path) -> dict[str, Any]:
    """The configuration of a variant's seed; a washout it begins with is trained first."""
    fields = merge(merge(BASE, VARIANTS[variant]), {"seed": seed})
    if variant.startswith("from-washout"):
        washout = trained(out / f"washout-{seed}", "linear", {**WASHOUT, "seed": seed})
        fields["initial"] = str(washout.run.best_agent)
    return fields


def main() -> None:
    """Train, and print the lowest and the last validation J of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=list(VARIANTS))
    given = parser.parse_args()
    rows = []
    for variant in given.variants:
        best, last = [], []
        for seed in range(given.seeds):
            folder = given.out / f"{variant}-{seed}"
            training = trained(folder, "apg", fields_of(variant, seed, given.out))
            best.append(math.inf if training.status.best is None else training.status.best)
            last.append(read_log(folder)[-1].get("validation/J", math.inf))
            print(f"{variant}, seed {seed}: {best[-1]:.3g}, at the end {last[-1]:.3g}", flush=True)
        rows.append((variant, *spread(best), *spread(last)))
    header = ("variant", "best", "lowest to highest", "at the end", "lowest to highest")
    print_table(table_console(), TextTable("Validation J", header, tuple(rows)))


def spread(values: list[float]) -> tuple[str, str]:
    """Mean, and lowest to highest."""
    return number(sum(values) / len(values)), f"{number(min(values))} to {number(max(values))}"


if __name__ == "__main__":
    main()
