"""The best linear washout for random drives, by CMA-ES: a few gains, not a network's thousands of weights.

Every generation tries its candidates at once, each in the same episodes. The agent is a network whose hidden
layers are silent, so that ``apg`` can go on from it. The washout is linear in the observation.

In the cab's frame, with the errors of specific force f and angular velocity omega, the low-passes f_j of the
car's specific force (the observation's memory), and the acceleration a of the action before:

    carriage   a <- (1 - leak) a + force_gain (f_car - f)
                    + (leak + force_gain) (sum_j c_j f_j - 2 D w xdot - w^2 x)
    hexapod    the same without c_j, with gains of its own for surge and sway, and for heave
    pitch      a <- rate_gain (omega_car - omega) + stiffness ((t_0 f_car + sum_j t_j f_j) / g - theta)
    roll       the same with -f_y
    turntable  a <- yaw_gain (omega_car - omega)

The hexapod's yaw is led back to neutral, critically damped. It high-passes what carriage and hexapod can
follow and tilts for what lasts, as any washout, and corrects itself by the simulator's cue.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import cma
import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ....envs.cues import GRAVITY
from ....envs.errors import ConfigurationError
from ....envs.maneuvers import drive_seeds
from ....envs.platform.kernels.step import AXES
from ....envs.settings import Positive, configuration, from_dict
from ....envs.simulator.kernels.observation import SCALES
from ....envs.task.batch import Batch
from ....envs.task.kernels.observation import Layout
from ....envs.task.options import PositiveCount
from ...agents import Network
from ...config import TrainingConfig
from ...networks import TORCH_ACTIVATIONS, Actor, as_shown, start_linear
from ...registry import Boundary, Learner, State, restoring
from ...training import check_episodes

Floats = NDArray[np.float64]

CARRIAGE, HEXAPOD, HEAVE, TILT, YAW, TURNTABLE = (0, 1), (2, 3, 4), 4, (5, 6), 7, 8
"""Axes in the order of ``AXES``."""

_POSITIVE: Final = (
    "carriage_frequency",
    "carriage_damping",
    "leak",
    "force_gain",
    "hexapod_frequency",
    "hexapod_gain",
    "heave_frequency",
    "heave_gain",
    "rate_gain",
    "stiffness",
    "yaw_gain",
)
_CUES: Final = 6
"""Entries of the memory a time constant: specific force, angular velocity."""


@configuration
class LinearWashout:
    """The gains. Defaults are for an action of 20 ms, and where a search begins.

    Args:
        carriage_frequency: w of the carriage's way back, rad/s.
        carriage_damping: D of it.
        leak: Share of the last acceleration of carriage and hexapod that is given up at each action.
        force_gain: Share of the horizontal force's error that the carriage makes up for at each action.
        hexapod_frequency: w of the hexapod's way back from surge, sway and yaw, rad/s.
        hexapod_gain: Share of the horizontal force's error that the hexapod makes up for.
        heave_frequency: w of its way back from heave, rad/s.
        heave_gain: Share of the vertical force's error.
        rate_gain: From the error of roll and pitch rate to tilt acceleration, 1/s.
        stiffness: From the error of the tilt angle to tilt acceleration, 1/s^2.
        yaw_gain: From the error of the yaw rate to the turntable's acceleration, 1/s.
        carriage_shares: c_j, one for each time constant of the memory.
        tilt_share: t_0.
        tilt_shares: t_j.
    """

    carriage_frequency: Positive = 0.8
    carriage_damping: Positive = 1.0
    leak: Positive = 0.1
    force_gain: Positive = 0.2
    hexapod_frequency: Positive = 2.0
    hexapod_gain: Positive = 0.05
    heave_frequency: Positive = 1.0
    heave_gain: Positive = 0.1
    rate_gain: Positive = 15.0
    stiffness: Positive = 5.0
    yaw_gain: Positive = 15.0
    carriage_shares: tuple[float, ...] = ()
    tilt_share: float = 0.0
    tilt_shares: tuple[float, ...] = ()


def coordinates(washout: LinearWashout, memories: int) -> Floats:
    """The gains as coordinates of a search: logarithms of the positive ones, then the shares.

    Args:
        washout: The gains; shares that are not given are 0.
        memories: Time constants of the memory.
    """
    shares = []
    for name in ("carriage_shares", "tilt_shares"):
        given = getattr(washout, name)
        if len(given) > memories:
            raise ConfigurationError(
                f"{name} has {len(given)} entries, but the observation's memory {memories} time constants"
            )
        shares.append([*given, *[0.0] * (memories - len(given))])
    logarithms = [np.log(getattr(washout, name)) for name in _POSITIVE]
    return np.array([*logarithms, washout.tilt_share, *shares[0], *shares[1]])


def washout_at(point: Floats) -> LinearWashout:
    """The gains at coordinates."""
    n = len(_POSITIVE)
    values = dict(zip(_POSITIVE, np.exp(point[:n]).tolist(), strict=True))
    carriage, tilt = np.split(point[n + 1 :], 2)
    return LinearWashout(
        **values,
        tilt_share=float(point[n]),
        carriage_shares=tuple(carriage.tolist()),
        tilt_shares=tuple(tilt.tolist()),
    )


def gains(washout: LinearWashout, layout: Layout, scale: Floats) -> Floats:
    """(9, frame) from an observation to an action before its squashing; 0 for axes that do not move.

    Args:
        washout: The gains.
        layout: Of the observation, in the cab's frame.
        scale: (9,) accelerations that an action of 1 stands for, m/s^2 and rad/s^2.
    """
    return _Writer(layout, scale).written(washout)


class _Writer:
    """Puts gains in SI units where they belong."""

    def __init__(self, layout: Layout, scale: Floats) -> None:
        self._layout, self._scale = layout, scale
        self._rows = {row.name: row for row in layout.rows}
        self._gains = np.zeros((len(AXES), layout.frame))

    def written(self, washout: LinearWashout) -> Floats:
        """The matrix."""
        self._carriage(washout)
        self._hexapod(washout)
        self._tilt(washout)
        self._add(TURNTABLE, "rate_error", 2, washout.yaw_gain)
        moving = self._scale > 0.0
        self._gains[moving] /= self._scale[moving, None]
        self._gains[~moving] = 0.0
        return self._gains

    def _add(self, axis: int, row: str, entry: int, gain: float) -> None:
        """A gain from SI units to SI units."""
        self._gains[axis, self._layout.first(row) + entry] += gain * self._rows[row].scale

    def _keep(self, axis: int, share: float) -> None:
        """A share of the last acceleration."""
        self._gains[axis, self._layout.first("last_action") + axis] += share * self._scale[axis]

    def _remember(self, axis: int, force: int, shares: tuple[float, ...], gain: float) -> None:
        """Low-passed specific force."""
        for j, share in enumerate(shares):
            entry = self._layout.first("memory") + _CUES * j + force
            self._gains[axis, entry] += gain * share * SCALES["reference_force"]

    def _carriage(self, w: LinearWashout) -> None:
        lead = w.leak + w.force_gain
        for k, axis in enumerate(CARRIAGE):
            self._keep(axis, 1.0 - w.leak)
            self._add(axis, "force_error", k, w.force_gain)
            self._spring(axis, "carriage", "carriage_rate", k, w.carriage_frequency, w.carriage_damping, lead)
            self._remember(axis, k, w.carriage_shares, lead)

    def _hexapod(self, w: LinearWashout) -> None:
        for k, axis in enumerate(HEXAPOD):
            heave = axis == HEAVE
            gain = w.heave_gain if heave else w.hexapod_gain
            frequency = w.heave_frequency if heave else w.hexapod_frequency
            self._keep(axis, 1.0 - w.leak)
            self._add(axis, "force_error", k, gain)
            self._spring(axis, "displacement", "velocity", k, frequency, 1.0, w.leak + gain)
        self._spring(YAW, "beta", "beta_rate", 2, w.hexapod_frequency, 1.0, 1.0)

    def _tilt(self, w: LinearWashout) -> None:
        for k, axis in enumerate(TILT):
            # Roll answers to -f_y, pitch to f_x.
            force, per_force = (1, -w.stiffness / GRAVITY) if k == 0 else (0, w.stiffness / GRAVITY)
            self._add(axis, "rate_error", k, w.rate_gain)
            self._add(axis, "beta", k, -w.stiffness)
            self._add(axis, "reference_force", force, per_force * w.tilt_share)
            self._remember(axis, force, w.tilt_shares, per_force)

    def _spring(
        self, axis: int, position: str, rate: str, k: int, frequency: float, damping: float, strength: float
    ) -> None:
        """The way back to neutral."""
        self._add(axis, position, k, -(frequency**2) * strength)
        self._add(axis, rate, k, -2.0 * damping * frequency * strength)


@configuration
class LinearHyperparameters:
    """Hyperparameters of the search.

    Args:
        start: The gains it begins with.
        sigma: Standard deviation of its first generation, in logarithms of gains and in shares.
        population: Candidates of a generation.
        offset: The cost of an episode counts as log(offset + cost), as for apg.
        net_arch: Units of each hidden layer of the network, which are silent.
        activation_fn: Of the hidden layers.
    """

    start: LinearWashout = LinearWashout()
    sigma: Positive = 0.3
    population: Annotated[int, Field(ge=4)] = 12
    offset: Positive = 0.2
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(TORCH_ACTIVATIONS))] = "elu"


class LinearLearner(Learner):
    """See :class:`~...registry.Learner`.

    Args:
        config: The training; every candidate drives ``n_envs`` episodes of ``task.episode.duration``.
    """

    def __init__(self, config: TrainingConfig) -> None:
        self.given = from_dict(LinearHyperparameters, dict(config.hyperparameters), "hyperparameters")
        _check(config)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self._total, self._each = config.steps, config.n_envs
        self._seeds = drive_seeds(self._each, config.seed)
        self.batch = Batch(config.n_envs * self.given.population, config.task)
        self._everywhere = np.ones(self.batch.n, dtype=bool)
        self._length = round(float(config.task.episode.duration or 0.0) / self.batch.time_step)
        layout = self.batch.layout
        self.actor = Actor(layout.size, self.batch.action_size, self.given.net_arch, self.given.activation_fn)
        begin = coordinates(self.given.start, len(config.task.observation.memory))
        options = {"seed": config.seed + 1, "popsize": self.given.population, "verbose": -9}
        self._search = cma.CMAEvolutionStrategy(begin, self.given.sigma, options)
        self._values: list[list[float]] = []
        self._best, self._least = begin, math.inf
        self._costs = np.zeros((0, 0))

    @property
    def steps(self) -> int:
        """Actions so far."""
        return len(self._values) * self._length * self.batch.n

    def learn(self, boundary: Boundary) -> None:
        """Search until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        while self.steps < self._total:
            boundary()
            points = self._search.ask()
            self._record(points, self._evaluate(points))

    def _record(self, points: list[Floats], values: list[float]) -> None:
        self._search.tell(points, values)
        self._values.append(values)
        least = int(np.argmin(values))
        if values[least] < self._least:
            self._best, self._least = np.array(points[least]), values[least]

    def _evaluate(self, points: list[Floats]) -> list[float]:
        """Cost of each candidate, in the same episodes of every generation."""
        batch, arrays = self.batch, self.batch.arrays
        matrices = np.array([self._gains(point) for point in points])
        batch.seed(self._everywhere, self._seeds * len(points))
        batch.begin(self._everywhere)
        batch.observe(self._everywhere)
        costs = np.zeros(batch.n)
        for _ in range(self._length):
            observation = arrays.observation.pull().reshape(len(points), self._each, -1)
            action = np.tanh(np.einsum("pes,pas->pea", observation, matrices))
            batch.write(action.reshape(batch.n, -1))
            batch.step()
            costs -= arrays.reward.pull()
        self._costs = (costs / self._length).reshape(len(points), self._each)
        # Logarithms: every drive by its relative gain, a wild one as much as a gentle one.
        values: list[float] = np.log(self.given.offset + self._costs).mean(axis=1).tolist()
        return values

    def _gains(self, point: Floats) -> NDArray[np.float32]:
        return as_shown(gains(washout_at(point), self.batch.layout, self.batch.usual_scale), self.batch)

    @property
    def washout(self) -> LinearWashout:
        """The best gains so far."""
        return washout_at(self._best)

    def scalars(self) -> dict[str, float]:
        """Of the last generation, and the best so far."""
        scalars = {"train/sigma": float(self._search.sigma)}
        if self._values:
            scalars |= {"rollout/reward": -float(self._costs.mean(axis=1).min()), "train/least": self._least}
        return scalars

    def network(self) -> Network:
        """The best gains so far as a network."""
        start_linear(self.actor, self._gains(self._best))
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """Values of each generation; the search is repeated from them."""
        return {"told": [list(values) for values in self._values]}

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            for values in state["told"]:
                self._record(self._search.ask(), [float(value) for value in values])


def _check(config: TrainingConfig) -> None:
    check_episodes(config, "gains need the scales of the machine")
    task = config.task
    if task.action.mode != "acceleration" or task.observation.stack > 1:
        raise ConfigurationError("linear needs task.action.mode acceleration and task.observation.stack 1")
    if task.action.frame != "cab" or task.observation.frame != "cab":
        raise ConfigurationError("task.action.frame and task.observation.frame must be cab for linear")
