"""Stable-Baselines3's vector environment over the batch: no processes, and no loop over environments."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.simulator.simulator import Snapshot
from ..envs.task.batch import Batch
from ..envs.task.environment import (
    action_space,
    frames_per_second,
    normalized,
    observation_space,
    pictures_of,
    rendered,
    task_options,
)
from ..envs.task.kernels.reward import N_TERMS, TERMS
from ..envs.task.options import TaskOptions


class DrivingSimulatorVecEnv(VecEnv):
    """A batch of driving simulators; environment i is the single environment with seed ``seed + i``.

    An environment that ends begins anew in the same step, and says in its info:
    ``terminal_observation``; ``TimeLimit.truncated``; ``episode`` with return ``r``, length ``l`` and time
    ``t`` as ``Monitor`` has them; ``terms`` with the mean of each term of the reward over the episode.

    Args:
        num_envs: Environments.
        task: Everything that can be chosen, or the name or file of a task; default: all defaults.
        drives: Cue traces to drive instead of those of ``task.episode``.
        base: The base policy of the action modes "residual" and "gains", by name or file too; default:
            ``action.base``.
        group: Consecutive environments that share a seed, and so all that is drawn: drive, start, machine.
            Their returns differ by their actions alone. The reward of each is then relative to the mean of
            the others (``reward.against_base`` is off), as in GRPO: most of a reward is the road's, and that
            is gone. ``episode`` in ``infos`` has the return before that.
        stagger: Whether the first episodes end one after another, not all at once.
        device: "cpu" or a CUDA device of Warp.
        render_mode: "rgb_array", "human" (a window that shows the first environment), or None.
        render_size: Width and height of a frame, pixels; default: 960 x 540, of a window 1280 x 720.
        **fields: Fields of ``TaskOptions`` to replace, as dataclasses or dictionaries.

    Raises:
        ConfigurationError: an option is unknown, of the wrong type or out of range, or ``num_envs`` is no
            multiple of ``group``.
    """

    def __init__(
        self,
        num_envs: int,
        task: TaskOptions | str | Path | None = None,
        *,
        drives: Sequence[CueTrace] | None = None,
        base: Any = None,
        group: int = 1,
        stagger: bool = False,
        device: str = "cpu",
        render_mode: str | None = None,
        render_size: tuple[int, int] | None = None,
        **fields: Any,
    ) -> None:
        if group < 1 or num_envs % group:
            raise ConfigurationError(f"num_envs {num_envs} must be a multiple of group {group}")
        self.task = task_options(task, fields)
        if group > 1:
            self.task = replace(self.task, reward=replace(self.task.reward, against_base=False))
        self.group, self._stagger = group, stagger
        self.batch = Batch(num_envs, self.task, drives=drives, base=base, device=device)
        self._pictures = pictures_of(self.batch, render_mode, render_size)
        self.render_mode = render_mode
        super().__init__(num_envs, observation_space(self.batch), action_space(self.batch))
        self.metadata: dict[str, Any] = self.metadata | {"render_fps": frames_per_second(self.batch)}
        self._seeded = False
        self._began = time.perf_counter()
        self._returns = np.zeros(num_envs)
        self._sums = np.zeros((num_envs, N_TERMS))
        self._steps = np.zeros(num_envs, dtype=np.int64)
        # Of the groups' mean rewards: number, sum, sum of squares; and the sum of the variances within.
        self._groups = np.zeros(4)

    def action_of(self, acceleration: ArrayLike) -> NDArray[np.float32]:
        """Actions of the mode "acceleration" for accelerations (..., 9), m/s^2 and rad/s^2."""
        return normalized(acceleration, self.batch.scale)

    def reset(self) -> NDArray[np.float32]:
        """Begin new episodes, with the seeds and options given since the last reset."""
        everywhere = np.ones(self.num_envs, dtype=bool)
        if not self._seeded and self._seeds[0] is None:
            self.seed()
        if self._seeds[0] is not None:
            self.batch.seed(everywhere, [int(seed or 0) for seed in self._seeds])
            self._seeded = True
        drives = [options.get("drive") for options in self._options]
        given = [drive for drive in drives if drive is not None]
        if given and len(given) < self.num_envs:
            raise ConfigurationError("option drive must be given for every environment or for none")
        self._begin(everywhere, self.batch.drive_indices(given) if given else None)
        if self._stagger:
            self._shorten()
        self._reset_seeds()
        self._reset_options()
        return self.batch.arrays.observation.pull().copy()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds for the next reset: ``seed``, ``seed + 1``... for the groups; default: at random.

        Returns:
            (num_envs) seeds.
        """
        super().seed(seed)
        self._seeds = [self._seeds[i // self.group] for i in range(self.num_envs)]
        return self._seeds

    def _begin(self, mask: NDArray[np.bool_], drive: NDArray[np.int32] | None = None) -> None:
        self.batch.begin(mask, drive)
        self.batch.observe(mask)
        if self._pictures is not None:
            self._pictures.begin(mask)
        self._returns[mask], self._sums[mask], self._steps[mask] = 0.0, 0.0, 0

    def _shorten(self) -> None:
        """Let the episodes that have just begun end one after another, group by group."""
        batch, repeat = self.batch, self.task.action.repeat
        groups = self.num_envs // self.group
        share = np.repeat((1.0 + np.arange(groups)) / groups, self.group)
        first, episode = batch.simulator.state["sample"], batch.arrays.episode
        actions = np.ceil(share * (episode.view["last"] - first) / repeat).astype(np.int64)
        episode.view["last"] = np.minimum(first + np.maximum(actions, 1) * repeat, episode.view["last"])
        episode.push()

    def step_async(self, actions: ArrayLike) -> None:
        """Take actions (n, k), which :meth:`step_wait` plays.

        Raises:
            ActionError: a wrong shape, or a value that is not finite.
        """
        self.batch.write(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; an ended environment returns the first observation of its next episode."""
        batch, arrays = self.batch, self.batch.arrays
        batch.step()
        reward = arrays.reward.pull().astype(np.float32)
        terminated, truncated = arrays.terminated.pull().copy(), arrays.truncated.pull().copy()
        self._returns += reward
        self._sums += arrays.terms.pull()
        self._steps += 1
        if self._pictures is not None:
            self._pictures.follow(np.ones(self.num_envs, dtype=bool))
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = terminated | truncated
        if ended.any():
            for i in np.flatnonzero(ended).tolist():
                infos[i] = self._final_info(i, bool(truncated[i] and not terminated[i]))
            self._begin(ended)
        if self.group > 1:
            grouped = reward.reshape(-1, self.group)
            mean = grouped.mean(axis=1)
            self._groups += [len(mean), mean.sum(), np.square(mean).sum(), grouped.var(axis=1, ddof=1).sum()]
            reward = self.relative(reward)
        return arrays.observation.pull().copy(), reward, ended, infos

    def relative(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values (n, ...), a row an environment, less the mean of the others in the group."""
        grouped = values.reshape(-1, self.group, *values.shape[1:])
        own = grouped - grouped.mean(axis=1, keepdims=True)
        return np.asarray(own * (self.group / (self.group - 1.0)), dtype=np.float32).reshape(values.shape)

    def take_drive_share(self) -> float | None:
        """Share of the variance of rewards that a group has in common since the last call, and begin anew.

        It is the road's, the machine's and the start's: no action had a part in it. What the members differ
        by is taken off (one-way analysis of variance).

        Returns:
            0 to 1; None without groups, or where nothing was played.
        """
        count, total, squares, within = self._groups.tolist()
        self._groups[:] = 0.0
        if count < 2:
            return None
        within /= count
        common = max((squares - total * total / count) / (count - 1) - within / self.group, 0.0)
        return common / (common + within) if common + within > 0.0 else None

    def _final_info(self, i: int, truncated: bool) -> dict[str, Any]:
        elapsed = round(time.perf_counter() - self._began, 6)
        means = (self._sums[i] / self._steps[i]).tolist()
        return {
            "terminal_observation": self.batch.arrays.observation.pull()[i].copy(),
            "TimeLimit.truncated": truncated,
            "episode": {"r": float(self._returns[i]), "l": int(self._steps[i]), "t": elapsed},
            "terms": dict(zip(TERMS, means, strict=True)),
        }

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A frame of each environment; None of each without the mode "rgb_array"."""
        frames = None if self._pictures is None else self._pictures.render()
        return [None] * self.num_envs if frames is None else frames

    def render(self, mode: str | None = None) -> NDArray[np.uint8] | None:
        """Frames of all environments in one picture; in the mode "human" steps show themselves."""
        if self.render_mode == "human":
            rendered(self._pictures)
            return None
        return super().render(mode)

    def snapshot(self) -> Snapshot:
        """Everything that changes, for :meth:`restore` of environments made alike."""
        sums = {"returns": self._returns.copy(), "sums": self._sums.copy(), "steps": self._steps.copy()}
        episodes = {f"episode.{name}": array for name, array in sums.items()}
        return {**self.batch.snapshot(), **episodes, "groups": self._groups.copy()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot: the same actions then give the same bits, without a reset.

        Raises:
            DataError: it is of another batch or version.
        """
        self.batch.restore(snapshot)
        for name, array in (("returns", self._returns), ("sums", self._sums), ("steps", self._steps)):
            array[...] = snapshot[f"episode.{name}"]
        # Snapshots of early versions have none.
        self._groups[:] = snapshot.get("groups", 0.0)
        self._seeded = True
        self._reset_seeds()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._pictures is not None:
            self._pictures.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute, the same for every environment."""
        value = getattr(self, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute for all environments.

        Raises:
            ConfigurationError: only some are named; they share one batch.
        """
        self._refuse_some(indices)
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method once, for all environments.

        Raises:
            ConfigurationError: only some are named; they share one batch.
        """
        self._refuse_some(indices)
        value = getattr(self, method_name)(*method_args, **method_kwargs)
        return [value] * self.num_envs

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """True for ``Monitor`` alone: ``info`` reports episodes as it does."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]

    def _refuse_some(self, indices: VecEnvIndices) -> None:
        if len(list(self._get_indices(indices))) != self.num_envs:
            raise ConfigurationError("indices must be None: the environments of a batch share attributes")
