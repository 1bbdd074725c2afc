"""Imitation of a controller, with dataset aggregation (DAgger; Ross, Gordon and Bagnell, AISTATS 2011).

Every round drives an episode in each environment. At every action the teacher says what it would do there,
whoever drives: the teacher in the first rounds, then more and more the pupil, so that the data hold the
states into which its own mistakes lead. All rounds' data are learned from, by least squares.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Final

import numpy as np
import torch
from pydantic import Field

from ..envs.car import drive_seeds
from ..envs.errors import ConfigurationError
from ..envs.settings import Positive, configuration, from_dict
from ..envs.task.batch import Batch
from ..envs.task.options import PositiveCount
from .actor import ACTIVATIONS, Actor
from .agent import Network
from .config import TrainingConfig
from .initial import begin
from .learner import Boundary, State, restoring
from .schedule import warm_cosine
from .standard import take_standard
from .teacher import Teacher

Share = Annotated[float, Field(ge=0.0, le=1.0)]

_SEED_OF_ORDER: Final = 1
"""Of the order of samples, beside the training's own seed."""


@configuration
class ImitationHyperparameters:
    """What an imitation is given.

    Args:
        teacher: Controller to imitate, by name or YAML file. One that plans a whole drive without looking, as
            ``optimum`` does, has to drive itself: ``teacher_drives: 1`` and ``teacher_share: 1``.
        teacher_drives: Share of the training after which the teacher no longer drives anything; before,
            its share of the environments falls linearly from 1.
        teacher_share: Least share of the environments that the teacher drives.
        updates: Steps of Adam after each round.
        batch_size: Samples of each.
        learning_rate: Largest, of Adam; it rises linearly in the first tenth and falls as a cosine.
        net_arch: Entries of each hidden layer.
        activation_fn: Of the hidden layers.
        max_grad_norm: Longer gradients are shortened to it.
    """

    teacher: str = "mpc"
    teacher_drives: Share = 0.3
    teacher_share: Share = 0.0
    updates: PositiveCount = 1000
    batch_size: PositiveCount = 1024
    learning_rate: Positive = 1e-3
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(ACTIVATIONS))] = "elu"
    max_grad_norm: Positive = 1.0


def make_learner(config: TrainingConfig) -> ImitationLearner:
    """The learner of a configuration."""
    return ImitationLearner(config)


class ImitationLearner:
    """See :class:`~.learner.Learner`.

    Args:
        config: The training; ``task.episode.duration`` is the length of an episode.

    Raises:
        ConfigurationError: a hyperparameter is wrong, or the task is one that a teacher cannot act in.
        UnknownNameError: no policy has the teacher's name.
    """

    def __init__(self, config: TrainingConfig) -> None:
        self.given = from_dict(ImitationHyperparameters, dict(config.hyperparameters), "hyperparameters")
        _check(config)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self._total, n = config.steps, config.n_envs
        self._repeat = config.task.action.repeat
        # The teacher acts at every time step, the pupil's action is held.
        own_time_step = replace(config.task, action=replace(config.task.action, repeat=1))
        self.batch = Batch(n, own_time_step)
        self._everywhere = np.ones(n, dtype=bool)
        self.batch.seed(self._everywhere, drive_seeds(n, config.seed))
        duration = float(config.task.episode.duration or 0.0)
        self._length = round(duration / (self.batch.time_step * self._repeat))
        self.teacher = Teacher(self.given.teacher, self.batch)
        self.actor = Actor(
            self.batch.layout.size, self.batch.action_size, self.given.net_arch, self.given.activation_fn
        )
        begin(self.actor, self.batch, config)
        self._optimizer = torch.optim.Adam(self.actor.parameters(), lr=self.given.learning_rate)
        self._order = torch.Generator().manual_seed(config.seed + _SEED_OF_ORDER)
        self._seen: list[torch.Tensor] = []
        self._told: list[torch.Tensor] = []
        self._rounds = 0
        self._last: dict[str, float] = {}

    @property
    def steps(self) -> int:
        """Actions so far."""
        return self._rounds * self._length * self.batch.n

    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        while self.steps < self._total:
            boundary()
            self._drive()
            if self._rounds == 0:
                take_standard(self.actor, self._seen[0].numpy(), self._told[0].numpy())
            self._fit()
            self._rounds += 1

    def _drive(self) -> None:
        """An episode everywhere; keeps what was seen before each action, and what the teacher would do."""
        batch, arrays = self.batch, self.batch.arrays
        batch.begin(self._everywhere)
        batch.observe(self._everywhere)
        self.teacher.begin()
        by_teacher = np.arange(batch.n) < round(self._share() * batch.n)
        seen, told, costs = [], [], 0.0
        for _ in range(self._length):
            observation = torch.from_numpy(arrays.observation.pull().copy())
            with torch.no_grad():
                own = self.actor(observation).numpy()
            for step in range(self._repeat):
                answer = self.teacher(arrays.core.pull())
                if step == 0:
                    seen.append(observation)
                    told.append(torch.from_numpy(answer))
                batch.write(np.where(by_teacher[:, None], answer, own))
                batch.step()
                costs -= float(arrays.reward.pull().mean())
        self._seen.append(torch.cat(seen))
        self._told.append(torch.cat(told))
        self._last["rollout/reward"] = -costs / (self._length * self._repeat)
        self._last["rollout/teacher_share"] = float(by_teacher.mean())

    def _share(self) -> float:
        """Of the environments that the teacher drives in this round."""
        done, given = self.steps / self._total, self.given
        falling = 1.0 - done / given.teacher_drives if given.teacher_drives > 0.0 else 0.0
        return max(falling, given.teacher_share, 0.0)

    def _fit(self) -> None:
        """Steps of Adam over the data of all rounds."""
        given = self.given
        seen, told = torch.cat(self._seen), torch.cat(self._told)
        for group in self._optimizer.param_groups:
            group["lr"] = given.learning_rate * warm_cosine(self.steps / self._total)
        total = 0.0
        for _ in range(given.updates):
            chosen = torch.randint(len(seen), (given.batch_size,), generator=self._order)
            # Every axis by the reach of its own actions; far from the teacher's way answers are wild.
            reach = self.actor.reach
            loss = torch.nn.functional.smooth_l1_loss(self.actor(seen[chosen]) / reach, told[chosen] / reach)
            self._optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.actor.parameters(), given.max_grad_norm)
            self._optimizer.step()
            total += float(loss.detach())
        self._last["train/loss"] = total / given.updates
        self._last["train/samples"] = float(len(seen))

    def scalars(self) -> dict[str, float]:
        """Of the last round."""
        return {**self._last, "train/learning_rate": float(self._optimizer.param_groups[0]["lr"])}

    def network(self) -> Network:
        """The policy as it is now."""
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """Weights, optimizer, environments, data."""
        return {
            "actor": self.actor.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "batch": self.batch.snapshot(),
            "data": [list(self._seen), list(self._told)],
            "order": self._order.get_state(),
            "rounds": self._rounds,
            "last": dict(self._last),
        }

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            self.actor.load_state_dict(state["actor"])
            self._optimizer.load_state_dict(state["optimizer"])
            self.batch.restore(state["batch"])
            self._seen, self._told = (list(part) for part in state["data"])
            self._order.set_state(state["order"])
            self._rounds = int(state["rounds"])
            self._last = dict(state["last"])


def _check(config: TrainingConfig) -> None:
    task = config.task
    if task.episode.duration is None:
        raise ConfigurationError("task.episode.duration must say how long an episode of a round is, s")
    if task.episode.terminate_on_failure:
        raise ConfigurationError("task.episode.terminate_on_failure is of no use to dagger; leave it off")
    if task.action.mode != "acceleration":
        raise ConfigurationError(
            f"task.action.mode must be acceleration for dagger, found {task.action.mode}"
        )
    if config.normalize.observation or config.normalize.reward:
        raise ConfigurationError("normalize must be off for dagger: apg goes on from its agents")
    if not str(config.device).startswith("cpu"):
        raise ConfigurationError(f"device {config.device}: dagger runs on the CPU")
