"""Imitation of a controller by dataset aggregation (DAgger; Ross, Gordon and Bagnell, AISTATS 2011).

Every round drives an episode in each environment. The teacher labels every action with its own, whoever
drives: the teacher in the first rounds, then more and more the pupil. So the data hold the states into which
the pupil's mistakes lead. The pupil is fitted to the data of all rounds by least squares.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ....baselines import make_policy
from ....baselines.policy import Policy
from ....envs.cues import CueTrace
from ....envs.errors import ConfigurationError
from ....envs.maneuvers import drive_seeds
from ....envs.platform.kernels.step import TURNTABLE
from ....envs.settings import Positive, configuration, from_dict
from ....envs.simulator.simulator import N_AXES
from ....envs.task.batch import Batch
from ....envs.task.environment import normalized
from ....envs.task.options import PositiveCount
from ...agents import Network
from ...config import TrainingConfig
from ...networks import TORCH_ACTIVATIONS, Actor, normalize_by
from ...registry import Boundary, Learner, State, restoring
from ...training import check_episodes, start_actor, warm_cosine

Floats = NDArray[np.float64]

_YAW = 2
"""Of the hexapod's Euler angles."""


class Teacher:
    """A controller that labels the states of a batch of episodes, which it may or may not drive.

    A controller that knows its drive is given the rest of it where the episode begins.

    Args:
        policy: Its name, or the YAML file of one.
        batch: The episodes; actions are accelerations, at every time step.

    Raises:
        UnknownNameError: no policy has this name.
        ConfigurationError: a library that it needs is missing, a field of the file is wrong, or the platform
            is randomized.
    """

    def __init__(self, policy: str, batch: Batch) -> None:
        if batch.options.randomization.platform is not None:
            raise ConfigurationError(
                f"the teacher {policy} is made for one machine; leave randomization.platform out"
            )
        self._batch = batch
        self._made = make_policy(policy, batch.platform)
        self._controllers: list[Policy] = []
        self._states: list[Any] = []
        self._begins = True

    def begin(self) -> None:
        """The batch has begun an episode everywhere."""
        if self._made.needs_drive:
            self._controllers = [self._made.for_drive(rest) for rest in self._rests()]
        else:
            self._controllers = [self._made]
        self._states = [None] * len(self._controllers)
        self._begins = True

    def _rests(self) -> list[CueTrace]:
        """What is left of the drive of each environment."""
        simulator = self._batch.simulator
        *_, drive_of, _ = simulator.constants
        pairs = zip(drive_of.numpy().tolist(), simulator.state["sample"].tolist(), strict=True)
        return [rest_of(self._batch.drives[drive], sample) for drive, sample in pairs]

    def __call__(self, rows: Floats) -> NDArray[np.float32]:
        """Actions (n, 9) in [-1, 1] of the task, for observations (n, OBSERVATION_SIZE).

        To be called once every time step, because the controller has a memory.
        """
        labels = np.zeros((len(rows), N_AXES))
        # One that knows its drive sees one environment, any other all of them.
        for i, (controller, own) in enumerate(
            zip(self._controllers, np.split(rows, len(self._controllers)), strict=True)
        ):
            begins = np.full(len(own), self._begins)
            action, self._states[i] = controller.predict(own, self._states[i], begins, deterministic=True)
            labels[i * len(own) : (i + 1) * len(own)] = np.reshape(action, (-1, N_AXES))
        self._begins = False
        return self._as_actions(labels)

    def _as_actions(self, accelerations: Floats) -> NDArray[np.float32]:
        batch = self._batch
        if batch.options.action.frame == "cab":
            motion = batch.simulator.state["setpoint"]
            turntable = np.asarray(motion["position"], dtype=np.float64)[:, TURNTABLE]
            yaw = np.asarray(motion["beta"], dtype=np.float64)[:, _YAW]
            accelerations = in_cab_frame(accelerations, turntable, yaw)
        return np.clip(normalized(accelerations, batch.scale), -1.0, 1.0)


def in_cab_frame(accelerations: Floats, turntable: Floats, yaw: Floats) -> Floats:
    """Accelerations (n, 9) of the axes in the cab's frame, see ``envs.task.kernels.observation``.

    Args:
        accelerations: (n, 9) in the machine's frame.
        turntable: (n,) its angle psi_T, rad.
        yaw: (n,) of the hexapod, psi_H, rad.
    """
    turned = np.array(accelerations)
    for first, angle in ((0, turntable + yaw), (2, turntable + yaw), (5, turntable)):
        x, y = accelerations[:, first], accelerations[:, first + 1]
        turned[:, first] = np.cos(angle) * x + np.sin(angle) * y
        turned[:, first + 1] = np.cos(angle) * y - np.sin(angle) * x
    return turned


def rest_of(drive: CueTrace, sample: int) -> CueTrace:
    """A drive from one of its samples on."""
    return CueTrace(
        drive.name,
        drive.time[sample:] - drive.time[sample],
        drive.specific_force[sample:],
        drive.angular_velocity[sample:],
        angular_acceleration=drive.angular_acceleration[sample:],
    )


Share = Annotated[float, Field(ge=0.0, le=1.0)]

_SEED_OF_ORDER: Final = 1
"""Of the order of samples, beside the training's own seed."""


@configuration
class DaggerHyperparameters:
    """Hyperparameters of the imitation.

    Args:
        teacher: Controller to imitate, by name or YAML file. One that plans a whole drive without looking, as
            ``optimum`` does, has to drive itself: ``teacher_drives: 1`` and ``teacher_share: 1``.
        teacher_drives: Share of the training after which the teacher no longer drives anything; before,
            its share of the environments falls linearly from 1.
        teacher_share: Least share of the environments that the teacher drives.
        updates: Steps of Adam after each round.
        batch_size: Samples of each.
        learning_rate: Largest, of Adam; it rises linearly in the first tenth and falls as a cosine.
        net_arch: Units of each hidden layer.
        activation_fn: Of the hidden layers.
        max_grad_norm: Longer gradients are clipped to it.
    """

    teacher: str = "mpc"
    teacher_drives: Share = 0.3
    teacher_share: Share = 0.0
    updates: PositiveCount = 1000
    batch_size: PositiveCount = 1024
    learning_rate: Positive = 1e-3
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(TORCH_ACTIVATIONS))] = "elu"
    max_grad_norm: Positive = 1.0


class DaggerLearner(Learner):
    """See :class:`~...registry.Learner`.

    Args:
        config: The training; ``task.episode.duration`` is the length of an episode.
    """

    def __init__(self, config: TrainingConfig) -> None:
        self.given = from_dict(DaggerHyperparameters, dict(config.hyperparameters), "hyperparameters")
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
        start_actor(self.actor, self.batch, config)
        self._optimizer = torch.optim.Adam(self.actor.parameters(), lr=self.given.learning_rate)
        self._order = torch.Generator().manual_seed(config.seed + _SEED_OF_ORDER)
        self._observations: list[torch.Tensor] = []
        self._labels: list[torch.Tensor] = []
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
                normalize_by(self.actor, self._observations[0].numpy(), self._labels[0].numpy())
            self._fit()
            self._rounds += 1

    def _drive(self) -> None:
        """An episode everywhere; keeps the observation before each action, and the teacher's label."""
        batch, arrays = self.batch, self.batch.arrays
        batch.begin(self._everywhere)
        batch.observe(self._everywhere)
        self.teacher.begin()
        by_teacher = np.arange(batch.n) < round(self._share() * batch.n)
        observations, labels, costs = [], [], 0.0
        for _ in range(self._length):
            observation = torch.from_numpy(arrays.observation.pull().copy())
            with torch.no_grad():
                own = self.actor(observation).numpy()
            for step in range(self._repeat):
                label = self.teacher(arrays.core.pull())
                if step == 0:
                    observations.append(observation)
                    labels.append(torch.from_numpy(label))
                batch.write(np.where(by_teacher[:, None], label, own))
                batch.step()
                costs -= float(arrays.reward.pull().mean())
        self._observations.append(torch.cat(observations))
        self._labels.append(torch.cat(labels))
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
        observations, labels = torch.cat(self._observations), torch.cat(self._labels)
        for group in self._optimizer.param_groups:
            group["lr"] = given.learning_rate * warm_cosine(self.steps / self._total)
        total = 0.0
        for _ in range(given.updates):
            chosen = torch.randint(len(observations), (given.batch_size,), generator=self._order)
            # Every axis relative to its own scale. Huber loss: far from the teacher's path labels are wild.
            reach = self.actor.reach
            loss = torch.nn.functional.smooth_l1_loss(
                self.actor(observations[chosen]) / reach, labels[chosen] / reach
            )
            self._optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.actor.parameters(), given.max_grad_norm)
            self._optimizer.step()
            total += float(loss.detach())
        self._last["train/loss"] = total / given.updates
        self._last["train/samples"] = float(len(observations))

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
            "data": [list(self._observations), list(self._labels)],
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
            self._observations, self._labels = (list(part) for part in state["data"])
            self._order.set_state(state["order"])
            self._rounds = int(state["rounds"])
            self._last = dict(state["last"])


def _check(config: TrainingConfig) -> None:
    check_episodes(config, "apg goes on from its agents")
    task = config.task
    if task.episode.terminate_on_failure:
        raise ConfigurationError("task.episode.terminate_on_failure is of no use to dagger; leave it off")
    if task.action.mode != "acceleration":
        raise ConfigurationError(
            f"task.action.mode must be acceleration for dagger, found {task.action.mode}"
        )
