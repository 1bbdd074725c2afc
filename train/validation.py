"""Validation: cost of the policy on random drives that are never trained on, from neutral to the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import Policy
from ..envs.simulator.kernels.observation import OBSERVATION_SIZE
from ..envs.task import ActionOptions, TaskOptions
from ..envs.task.batch import Batch
from ..envs.task.environment import normalized
from ..envs.task.kernels.reward import N_TERMS, TERMS
from .agents.agent import base_policy
from .config import TrainingConfig, validation_task

Act = Callable[[NDArray[np.float32]], ArrayLike]
"""Actions (n, k) for observations (n, size)."""


@dataclass(frozen=True)
class Score:
    """Means over all drives and time.

    Args:
        cue_error: J.
        perceived_error: J of the perceived cues.
        reward: Of the task, an action.
        terms: Every term of the reward by name.
        tilt_rate_peak: Largest roll or pitch rate beyond the car's own at the ends of actions, rad/s.
    """

    cue_error: float
    perceived_error: float
    reward: float
    terms: dict[str, float]
    tilt_rate_peak: float

    @property
    def limited(self) -> float:
        """Share of actuators and time that a limit holds back."""
        return self.terms["limits"]

    def scalars(self) -> dict[str, float]:
        """As the log has them."""
        means = {
            "J": self.cue_error,
            "perceived_J": self.perceived_error,
            "reward": self.reward,
            "tilt_rate_peak_deg_s": float(np.degrees(self.tilt_rate_peak)),
        }
        return {f"validation/{name}": value for name, value in (means | self.terms).items()}


class Validation:
    """The validation drives of a training, all in one batch."""

    def __init__(self, config: TrainingConfig) -> None:
        self.task = validation_task(config)
        self._n = config.validation.drives
        base = base_policy(config.base, config.task)
        self._batch = Batch(self._n, self.task, base=base, device=config.device)

    def score(self, act: Act) -> Score:
        """Drive every drive from neutral to its end."""
        return _drive(self._batch, act)

    def score_policy(self, policy: Policy) -> Score:
        """The same of a policy that needs no environment's observation, as the washouts."""
        batch = Batch(self._n, _plain(self.task), device=str(self._batch.simulator.device))
        return _drive(batch, _Accelerations(policy, batch))


def _plain(task: TaskOptions) -> TaskOptions:
    """The same drives and reward, with accelerations at every time step."""
    return TaskOptions(
        platform=task.platform,
        vestibular=task.vestibular,
        action=ActionOptions(),
        reward=task.reward,
        episode=task.episode,
        randomization=task.randomization,
    )


class _Accelerations:
    """A policy's accelerations as actions; its memory goes from step to step."""

    def __init__(self, policy: Policy, batch: Batch) -> None:
        self._policy, self._batch = policy, batch
        self._state: Any = None
        self._begins = np.ones(batch.n, dtype=bool)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        core = self._batch.arrays.core.pull()[:, :OBSERVATION_SIZE]
        action, self._state = self._policy.predict(core, self._state, self._begins, deterministic=True)
        self._begins[...] = False
        return normalized(action, self._batch.scale)


def _drive(batch: Batch, act: Act) -> Score:
    everywhere, arrays = np.ones(batch.n, dtype=bool), batch.arrays
    batch.seed(everywhere, [0] * batch.n)
    each = np.arange(batch.n, dtype=np.int32)
    batch.begin(everywhere, each, each % len(batch.simulator.platforms))
    batch.observe(everywhere)
    running, played = everywhere.copy(), 0
    terms, reward, peak = np.zeros(N_TERMS), 0.0, 0.0
    while running.any():
        batch.write(act(arrays.observation.pull()))
        batch.step()
        # Drives are of one length; one that fails early stops counting.
        terms += arrays.terms.pull()[running].sum(axis=0)
        reward += float(arrays.reward.pull()[running].sum())
        peak = max(peak, float(tilt_rate(batch.simulator.state)[running].max()))
        played += int(running.sum())
        running &= ~(arrays.terminated.pull() | arrays.truncated.pull())
    means = dict(zip(TERMS, (terms / played).tolist(), strict=True))
    return Score(means["cue_error"], means["perceived_error"], reward / played, means, peak)


def tilt_rate(state: NDArray[Any]) -> NDArray[np.float64]:
    """(n,) roll and pitch rate of the simulator cue beyond the car's own, rad/s, of a simulator's state."""
    reference = np.asarray(state["reference_cue"]["rate"], dtype=np.float64)[:, :2]
    simulated = np.asarray(state["simulator_cue"]["rate"], dtype=np.float64)[:, :2]
    beyond = simulated - np.clip(simulated, np.minimum(reference, 0.0), np.maximum(reference, 0.0))
    return np.asarray(np.hypot(*beyond.T))
