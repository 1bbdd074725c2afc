"""Small splits for tests."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motion_cueing.baselines import NoMotion
from motion_cueing.evaluation.benchmark.splits import Split

from ...baselines.drives import trace, weave


def small_split(strength: float = 1.0, name: str = "small", drives: int = 2) -> Split:
    """Drives of 0.5 s and a little more."""
    return Split(
        name=name,
        version=1,
        description="weaves",
        definition={"strength": strength, "drives": drives},
        make=lambda: [
            trace(0.5 + 0.1 * k, lambda t, k=k: (1 + k) * strength * weave(t + 1.0), name=f"weave-{k}")
            for k in range(drives)
        ],
    )


class Push(NoMotion):
    """Pushes the carriage."""

    name = "push"

    def __init__(self, force: float = 0.5) -> None:
        self.force = force

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        action = np.zeros((len(observation), 9))
        action[:, 0] = self.force
        return action, state


class Tired(NoMotion):
    """Fails in drives of more than 0.55 s."""

    name = "tired"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        step = (state or 0) + 1
        if step > 55:
            raise RuntimeError("tired")
        return super().predict(observation)[0], step


def values_of(results, policy: str, platform: str = "paper") -> Mapping[str, float]:
    """J by drive of a policy of one run."""
    drives = results.platforms[platform][policy].runs[0].drives["small"]
    return {drive: values["cue_error"] for drive, values in drives.items()}
