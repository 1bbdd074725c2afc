"""What algorithms of Stable-Baselines3 learn with their own defaults: ten minutes of one core, three seeds.

    python -m benchmarks.learning --out results/learning.json
    python -m benchmarks.learning --algorithms ppo --minutes 2 --task cueing

Each training is ``MlpPolicy`` with the default hyperparameters of its class, on 16 environments. J is that of
the deterministic policy on random drives that are never trained on, at the start and about every minute of
processor time. A training that is in the file already is not repeated.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import torch
from stable_baselines3.common.callbacks import BaseCallback

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.algorithms.sb3.policy import CLASSES
from motion_cueing.train.config import TrainingConfig, ValidationOptions
from motion_cueing.train.validation import Validation
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

ENVIRONMENTS: Final = 16
DRIVES: Final = ValidationOptions(drives=24)


class Validator(BaseCallback):
    """Measures J from time to time and stops after ``minutes`` of processor time, without validation."""

    def __init__(self, validation: Validation, minutes: float, every: float) -> None:
        super().__init__()
        self._validation, self._minutes, self._every = validation, minutes, every
        self.curve: list[dict[str, float]] = []
        self._spent, self._began = 0.0, 0.0

    def _on_training_start(self) -> None:
        self._began = time.process_time()

    def _now(self) -> float:
        return (time.process_time() - self._began - self._spent) / 60.0

    def _on_rollout_start(self) -> None:
        self._measure()

    def _on_step(self) -> bool:
        return self._now() < self._minutes

    def _on_training_end(self) -> None:
        self._measure(last=True)

    def _measure(self, last: bool = False) -> None:
        minutes = self._now()
        if not last and self.curve and minutes < self.curve[-1]["minutes"] + self._every:
            return
        began = time.process_time()
        score = self._validation.score(lambda seen: self.model.predict(seen, deterministic=True)[0])
        self._spent += time.process_time() - began
        self.curve.append(
            {
                "minutes": round(minutes, 2),
                "actions": self.model.num_timesteps,
                "J": round(score.cue_error, 4),
                "perceived_J": round(score.perceived_error, 4),
                "limited": round(score.limited, 5),
            }
        )
        print("  ", json.dumps(self.curve[-1]), flush=True)


def references(task: str) -> dict[str, float]:
    """J of the washout and of the controller that a training begins with, on the validation drives."""
    validation = Validation(_config("ppo", task, 0))
    return {
        "classical": validation.score_policy(ClassicalWashout()).cue_error,
        "start": validation.score_base().cue_error,
    }


def _config(algorithm: str, task: str, seed: int) -> TrainingConfig:
    chosen = load_task(task)
    episode = replace(chosen.episode, library_seed=100 + seed)
    return TrainingConfig(algo=algorithm, task=replace(chosen, episode=episode), seed=seed, validation=DRIVES)


def train(algorithm: str, task: str, seed: int, minutes: float, every: float) -> list[dict[str, float]]:
    """Train with defaults; returns the curve of its validations."""
    config = _config(algorithm, task, seed)
    envs = DrivingSimulatorVecEnv(ENVIRONMENTS, config.task, stagger=True)
    maker: Any = CLASSES[algorithm]
    model = maker("MlpPolicy", envs, seed=seed, device="cpu")
    validator = Validator(Validation(config), minutes, every)
    model.learn(10**9, callback=validator)
    return validator.curve


def table(results: dict[str, Any]) -> str:
    """The results as a table in Markdown."""
    lines = [
        "| Task | Algorithm | Seed | Actions, k | J at the start | lowest | highest after the start | "
        "at the end | change |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for key, curve in sorted(results["runs"].items()):
        task, algorithm, seed = key.split("/")
        start, values = results["references"][task]["start"], [point["J"] for point in curve]
        lines.append(
            f"| `{task}` | {algorithm} | {seed} | {curve[-1]['actions'] / 1000:.0f} | {start:.2f} | "
            f"{min(values):.2f} | {max(values[1:]):.2f} | {values[-1]:.2f} | "
            f"{100.0 * (values[-1] / start - 1.0):+.0f} % |"
        )
    return "\n".join(lines)


def main() -> None:
    """Train what is asked for, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--algorithms", nargs="+", default=["ppo", "sac", "tqc"], choices=sorted(CLASSES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--task", default="cueing-preview")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--every", type=float, default=1.0)
    parser.add_argument("--out", type=Path, default=Path("results/learning.json"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    results: dict[str, Any] = {"references": {}, "runs": {}}
    if given.out.exists():
        results = json.loads(given.out.read_text(encoding="utf-8"))
    results["references"].setdefault(given.task, references(given.task))
    for algorithm in given.algorithms:
        for seed in given.seeds:
            key = f"{given.task}/{algorithm}/{seed}"
            if key in results["runs"]:
                continue
            print(key, flush=True)
            results["runs"][key] = train(algorithm, given.task, seed, given.minutes, given.every)
            given.out.parent.mkdir(parents=True, exist_ok=True)
            given.out.write_text(json.dumps(results, indent=1), encoding="utf-8")
    print(f"J of classical: {results['references'][given.task]['classical']:.2f}\n")
    print(table(results))


if __name__ == "__main__":
    main()
