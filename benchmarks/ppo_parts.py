"""What each part of the preset of PPO is worth: without it, three seeds, some minutes each.

    python -m benchmarks.ppo_parts --out results/ppo-parts.json
    python -m benchmarks.ppo_parts --seeds 0 --actions 400000

J is that of the deterministic policy at the end, on random drives that are never trained on. A training that
is in the file already is not repeated.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from motion_cueing.train.algorithms.sb3.sb3 import SB3Learner
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.validation import Validation

_PRESET: Final = load_config("ppo")
_PLAIN: Final = {**_PRESET.hyperparameters, "policy": "MlpPolicy"}

PARTS: Final[dict[str, dict[str, Any]]] = {
    "the preset": {},
    "a critic that sees the observation alone": {"hyperparameters": _PLAIN},
    "the same, whole episodes, `gae_lambda` 1": {
        "hyperparameters": _PLAIN | {"gae_lambda": 1.0, "n_steps": 250, "batch_size": 4000}
    },
    "the same, no groups but `reward.against_base`": {
        "hyperparameters": _PLAIN | {"gae_lambda": 1.0, "n_steps": 250, "batch_size": 4000},
        "group": 1,
    },
    "whole episodes": {"n_steps": 250, "batch_size": 4000},
    "no `critic_first`": {"critic_first": None},
    "a deviation that is learned, from 0.5": {
        "annealed_std": None,
        "policy_kwargs": {**_PRESET.hyperparameters["policy_kwargs"], "log_std_init": -0.7},  # type: ignore[dict-item]
    },
    "a fixed learning rate, 3e-4": {"adaptive_kl": None, "learning_rate": 3e-4},
    "actions within 1": {"task": {"action": {"bound": 1.0}}},
    "actions at once, not ramped": {"task": {"action": {"ramp": False}}},
    "travel charged from 80 % on": {"task": {"reward": {"stroke_margin": 0.8, "stroke_braking": None}}},
}
"""Parts by what is there instead: fields of a training, or hyperparameters that change."""


def configuration_of(part: str, seed: int, actions: int) -> TrainingConfig:
    """The preset with one part changed."""
    given = dict(PARTS[part])
    fields = {name: given.pop(name) for name in ("hyperparameters", "group", "task") if name in given}
    fields.setdefault("hyperparameters", {**_PRESET.hyperparameters, **given})
    task = {"episode": {"library_seed": 100 + seed}} | fields.pop("task", {})
    return load_config("ppo", task=task, seed=seed, steps=actions, validation={"drives": 24}, **fields)


def main() -> None:
    """Train each part with each seed, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--actions", type=int, default=1_600_000)
    parser.add_argument("--out", type=Path, default=Path("results/ppo-parts.json"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    runs: dict[str, dict[str, float]] = {}
    if given.out.exists():
        runs = json.loads(given.out.read_text(encoding="utf-8"))
    for seed in given.seeds:
        for part in PARTS:
            key = f"{part}/{seed}/{given.actions}"
            if key in runs:
                continue
            began = time.process_time()
            config = configuration_of(part, seed, given.actions)
            learner = SB3Learner(config)
            learner.learn(lambda: None)
            minutes = (time.process_time() - began) / 60.0
            score = Validation(config).score(learner.network().acting())
            runs[key] = {"J": score.cue_error, "minutes": minutes}
            print(f"{key}: J {score.cue_error:.2f}, {minutes:.1f} min", flush=True)
            given.out.parent.mkdir(parents=True, exist_ok=True)
            given.out.write_text(json.dumps(runs, indent=1), encoding="utf-8")
    print("\n| instead | J | mean | minutes |\n|---|---|---|---|")
    for part in PARTS:
        found = [runs[f"{part}/{seed}/{given.actions}"] for seed in given.seeds]
        spread = ", ".join(f"{one['J']:.2f}" for one in found)
        mean, minutes = (np.mean([one[name] for one in found]) for name in ("J", "minutes"))
        print(f"| {part} | {spread} | {mean:.2f} | {minutes:.1f} |")


if __name__ == "__main__":
    main()
