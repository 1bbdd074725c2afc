"""Validation: cost of the policy on random drives that are never trained on, from neutral to the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import Policy
from ..envs.platform.kernels.step import CARRIAGE, END_OF_TRAVEL, LEGS
from ..envs.platform.machines import actuator_limits
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
        carriage_travel: Largest share of the carriage's travel used on a drive, mean over the drives.
        leg_travel: The same of the hexapod's legs.
        at_ends: Share of the time with an actuator at an end of its travel.
        by_drive: J of each drive.
        noise: What the noise of exploration adds to J; None where it was not measured.
    """

    cue_error: float
    perceived_error: float
    reward: float
    terms: dict[str, float]
    tilt_rate_peak: float
    carriage_travel: float = 0.0
    leg_travel: float = 0.0
    at_ends: float = 0.0
    by_drive: tuple[float, ...] = ()
    noise: float | None = None

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
            "carriage_travel": self.carriage_travel,
            "leg_travel": self.leg_travel,
            "at_ends": self.at_ends,
        }
        if self.noise is not None:
            means |= {"noise_cost": self.noise, "noisy_J": self.cue_error + self.noise}
        return {f"validation/{name}": value for name, value in (means | self.terms).items()}


_NOISY: Final = 8
"""Drives, the first ones, on which the noise is measured at most: it is for a person to see, not a rating."""


class Validation:
    """The validation drives of a training, all in one batch."""

    def __init__(self, config: TrainingConfig) -> None:
        self.task = validation_task(config)
        self._n = config.validation.drives
        self._base = base_policy(config.base, config.task)
        self._batch = Batch(self._n, self.task, base=self._base, device=config.device)
        self.noisy_drives = min(self._n, _NOISY)
        self._noisy: Batch | None = None

    def score(self, act: Act) -> Score:
        """Drive every drive from neutral to its end."""
        return _drive(self._batch, act)

    def score_base(self) -> Score:
        """The same of the base policy alone: an action of zero."""
        return self.score(lambda seen: np.zeros((len(seen), self._batch.action_size), dtype=np.float32))

    def with_noise(self, score: Score, act: Act) -> Score:
        """A score with the cost of noise.

        Args:
            score: Of the same policy without noise.
            act: With noise, for :attr:`noisy_drives` environments.
        """
        if self._noisy is None:
            whole, alone = self._batch, replace(self.task.reward, against_base=False)
            self._noisy = Batch(
                self.noisy_drives,
                replace(self.task, reward=alone),
                drives=whole.drives[: self.noisy_drives],
                platforms=whole.simulator.platforms,
                base=self._base,
                device=str(whole.simulator.device),
            )
        noisy = _drive(self._noisy, act)
        cost = np.mean(noisy.by_drive) - np.mean(score.by_drive[: self.noisy_drives])
        return replace(score, noise=float(cost))

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
        reward=replace(task.reward, against_base=False),
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


_J: Final = TERMS.index("cue_error")


def _drive(batch: Batch, act: Act) -> Score:
    everywhere, arrays = np.ones(batch.n, dtype=bool), batch.arrays
    batch.seed(everywhere, [0] * batch.n)
    each = np.arange(batch.n, dtype=np.int32)
    batch.begin(everywhere, each, each % len(batch.simulator.platforms))
    batch.observe(everywhere)
    running, played, ends = everywhere.copy(), 0, _ends_of_travel(batch)
    terms, reward, peak, at_ends = np.zeros(N_TERMS), 0.0, 0.0, 0
    costs, counts, used = np.zeros(batch.n), np.zeros(batch.n), np.zeros((batch.n, 9))
    while running.any():
        batch.write(act(arrays.observation.pull()))
        batch.step()
        # Drives are of one length; one that fails early stops counting.
        means, state = arrays.terms.pull(), batch.simulator.state
        terms += means[running].sum(axis=0)
        costs[running] += means[running, _J]
        counts += running
        reward += float(arrays.reward.pull()[running].sum())
        peak = max(peak, float(tilt_rate(state)[running].max()))
        used[running] = np.maximum(used[running], _travel_used(state, *ends)[running])
        at_ends += int(np.count_nonzero(state["limits"][running] & np.uint64(END_OF_TRAVEL)))
        played += int(running.sum())
        running &= ~(arrays.terminated.pull() | arrays.truncated.pull())
    named = dict(zip(TERMS, (terms / played).tolist(), strict=True))
    return Score(
        cue_error=named["cue_error"],
        perceived_error=named["perceived_error"],
        reward=reward / played,
        terms=named,
        tilt_rate_peak=peak,
        carriage_travel=float(used[:, CARRIAGE].max(axis=1).mean()),
        leg_travel=float(used[:, LEGS].max(axis=1).mean()),
        at_ends=at_ends / played,
        by_drive=tuple((costs / counts).tolist()),
    )


def _ends_of_travel(batch: Batch) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 9) least and greatest positions of the actuators, for the machine of each environment."""
    ends = [actuator_limits(platform) for platform in batch.simulator.platforms]
    of = batch.simulator.platform_of
    return np.array([e["position_min"] for e in ends])[of], np.array([e["position_max"] for e in ends])[of]


def _travel_used(
    state: NDArray[Any], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, 9) where each actuator is, as a share of the way from neutral to the end ahead of it."""
    position = np.asarray(state["motion"]["position"], dtype=np.float64)
    end = np.where(position < 0.0, low, high)
    return np.divide(position, end, out=np.zeros_like(position), where=end != 0.0)


def tilt_rate(state: NDArray[Any]) -> NDArray[np.float64]:
    """(n,) roll and pitch rate of the simulator cue beyond the car's own, rad/s, of a simulator's state."""
    reference = np.asarray(state["reference_cue"]["rate"], dtype=np.float64)[:, :2]
    simulated = np.asarray(state["simulator_cue"]["rate"], dtype=np.float64)[:, :2]
    beyond = simulated - np.clip(simulated, np.minimum(reference, 0.0), np.maximum(reference, 0.0))
    return np.asarray(np.hypot(*beyond.T))
