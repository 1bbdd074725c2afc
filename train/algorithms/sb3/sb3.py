"""Algorithms of Stable-Baselines3 and sb3-contrib: those of :data:`~.policy.CLASSES`.

Hyperparameters are those of the class, as rl-baselines3-zoo writes them in YAML, checked against its
signature.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from types import SimpleNamespace
from typing import Any, Final, get_type_hints

import numpy as np
import torch
from pydantic import ConfigDict, TypeAdapter, ValidationError
from sb3_contrib import TRPO, RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.noise import NormalActionNoise, OrnsteinUhlenbeckActionNoise
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from ....envs.errors import ConfigurationError, suggest
from ....envs.settings import Positive
from ....envs.task.options import Count
from ...agents import PolicyNetwork
from ...agents.agent import base_policy
from ...config import TrainingConfig
from ...logs import Monitor
from ...networks import TORCH_ACTIVATIONS
from ...registry import Boundary, Learner, State
from ...training import initial_network
from ...validation import Act
from ...vec_env import DrivingSimulatorVecEnv
from .advice import advice
from .callbacks import AdaptiveLearningRate, AnnealedNoise, CriticFirst
from .group_critic import Deviations, GroupCriticPolicy
from .policy import CLASSES, SkipPolicy, load_network, network_of
from .state import exploring, restore, restore_random, state_of

SCHEDULED: Final = "lin_"
"""Before a number: it falls linearly to zero at the end of the training."""

NOISES: Final[Mapping[str, Any]] = {
    "normal": NormalActionNoise,
    "ornstein-uhlenbeck": OrnsteinUhlenbeckActionNoise,
}
"""Names that ``noise_type`` takes."""

_NOISE: Final = ("noise_type", "noise_std")
_CALLBACKS: Final = ("critic_first", "annealed_std", "adaptive_kl")
_POLICY: Final = "policy"
OURS: Final = {
    "self", "policy", "env", "verbose", "seed", "device", "tensorboard_log", "stats_window_size",
    "action_noise", "rollout_buffer_class", "rollout_buffer_kwargs", "replay_buffer_class",
    "replay_buffer_kwargs", "optimize_memory_usage", "_init_setup_model",
}  # fmt: skip
"""Arguments that the training sets, or that a file cannot hold."""
_OURS_OF_POLICY: Final = {"self", "observation_space", "action_space", "lr_schedule", "use_sde"} | {
    "features_extractor_class", "features_extractor_kwargs", "share_features_extractor", "normalize_images",
    "optimizer_class", "optimizer_kwargs", "squash_output", "lstm_kwargs",
}  # fmt: skip

_LENIENT: Final = ConfigDict(arbitrary_types_allowed=True)


def arguments(
    algorithm: type[BaseAlgorithm], hyperparameters: Mapping[str, Any], action_size: int
) -> dict[str, Any]:
    """Keyword arguments of a Stable-Baselines3 algorithm.

    Args:
        algorithm: Its class.
        hyperparameters: As in rl-baselines3-zoo: numbers may be schedules (``lin_3e-4``); ``policy_kwargs``
            is a mapping, its ``activation_fn`` one of :data:`TORCH_ACTIVATIONS`. ``policy`` is "MlpPolicy"
            ("MlpLstmPolicy" for RecurrentPPO) or, for PPO and TRPO, "SkipPolicy", with a skip connection,
            or "GroupCriticPolicy". ``noise_type`` and ``noise_std`` make the action noise. PPO also has
            those of :func:`callbacks_of`.
        action_size: Entries of an action.

    Raises:
        ConfigurationError: one is unknown or of the wrong type.
    """
    known = parameters(algorithm, OURS)
    noisy = "action_noise" in inspect.signature(algorithm).parameters
    own = [*(_NOISE if noisy else ()), *(_CALLBACKS if algorithm is PPO else ())]
    _refuse_unknown("hyperparameters", hyperparameters, [*known, _POLICY, *own])
    callbacks_of(hyperparameters)
    given = {n: v for n, v in hyperparameters.items() if n not in (*_NOISE, *_CALLBACKS, _POLICY)}
    policy = _policy(
        algorithm, hyperparameters.get(_POLICY, _plain(algorithm)), bool(hyperparameters.get("use_sde"))
    )
    given["policy_kwargs"] = _policy_kwargs(algorithm, policy, given.get("policy_kwargs") or {})
    checked = {name: _checked(f"hyperparameters.{name}", v, known[name]) for name, v in given.items()}
    checked[_POLICY] = policy
    if "noise_type" in hyperparameters or "noise_std" in hyperparameters:
        checked["action_noise"] = _noise(hyperparameters, action_size)
    return checked


def _plain(algorithm: type[BaseAlgorithm]) -> str:
    """The policy without pictures."""
    return "MlpLstmPolicy" if algorithm is RecurrentPPO else "MlpPolicy"


def _policy(algorithm: type[BaseAlgorithm], name: Any, use_sde: bool) -> Any:
    plain = _plain(algorithm)
    known: dict[str, Any] = {plain: plain}
    if algorithm in (PPO, TRPO):
        known |= {"SkipPolicy": SkipPolicy, "GroupCriticPolicy": GroupCriticPolicy}
    if name not in known:
        raise ConfigurationError(f"hyperparameters.policy: {name!r}; use one of {', '.join(known)}")
    if known[name] is SkipPolicy and use_sde:
        raise ConfigurationError("hyperparameters.use_sde must be off with policy SkipPolicy")
    return known[name]


def parameters(cls: type[Any], ours: set[str]) -> dict[str, Any]:
    """What a class can be given in a file, with its types."""
    constructor: Any = cls.__init__
    annotations = {
        name: parameter.annotation for name, parameter in inspect.signature(cls).parameters.items()
    }
    # One by one: those of the environment name types that only type checkers import.
    holder = SimpleNamespace(__annotations__={n: a for n, a in annotations.items() if n not in ours})
    return get_type_hints(holder, globalns=constructor.__globals__)


def _refuse_unknown(where: str, given: Mapping[str, Any], known: list[str]) -> None:
    for name in given:
        if name not in known:
            raise ConfigurationError(f"{where}: unknown field {name!r}. {suggest(str(name), known)}")


def _policy_kwargs(algorithm: type[BaseAlgorithm], policy: Any, given: Any) -> dict[str, Any]:
    where = "hyperparameters.policy_kwargs"
    if not isinstance(given, Mapping):
        raise ConfigurationError(f"{where}: expected fields with values, found {given!r}")
    known = parameters(algorithm.policy_aliases[_plain(algorithm)], _OURS_OF_POLICY)
    if policy is GroupCriticPolicy:
        known |= {"critic_learning_rate": Positive}
    _refuse_unknown(where, given, list(known))
    checked = dict(given)
    if "activation_fn" in checked:
        name = checked["activation_fn"]
        if name not in TORCH_ACTIVATIONS:
            raise ConfigurationError(
                f"{where}.activation_fn: {name!r}; use one of {', '.join(TORCH_ACTIVATIONS)}"
            )
        checked["activation_fn"] = TORCH_ACTIVATIONS[name]
    return {name: _checked(f"{where}.{name}", value, known[name]) for name, value in checked.items()}


def _checked(where: str, value: Any, hint: Any) -> Any:
    """``value`` as the annotation has it."""
    if isinstance(value, str) and value.startswith(SCHEDULED):
        text = value.removeprefix(SCHEDULED)
        try:
            return linear(float(text))
        except ValueError:
            raise ConfigurationError(
                f"{where}: expected a number after {SCHEDULED}, found {text!r}"
            ) from None
    try:
        return TypeAdapter(hint, config=_LENIENT).validate_python(value)
    except ValidationError as error:
        reasons = " or ".join(dict.fromkeys(item["msg"] for item in error.errors()))
        raise ConfigurationError(f"{where}: {reasons} (found {value!r})") from None


def callbacks_of(hyperparameters: Mapping[str, Any]) -> list[BaseCallback]:
    """What acts on the model between its updates.

    Args:
        hyperparameters: ``critic_first``: rollouts in which the critic alone learns. ``annealed_std``: the
            standard deviation of the actions at first and at the end. ``adaptive_kl``: the divergence of an
            update that the learning rate is to keep.

    Raises:
        ConfigurationError: one is not of positive numbers.
    """
    found: list[BaseCallback] = []
    first = hyperparameters.get("critic_first")
    if first is not None:
        found.append(CriticFirst(_checked("hyperparameters.critic_first", first, Count)))
    kl, rate = hyperparameters.get("adaptive_kl"), hyperparameters.get("learning_rate", 1e-3)
    if kl is not None:
        if str(rate).startswith(SCHEDULED):
            raise ConfigurationError(
                f"hyperparameters.learning_rate must be a number with adaptive_kl, found {rate}"
            )
        found.append(AdaptiveLearningRate(_checked("hyperparameters.adaptive_kl", kl, Positive), float(rate)))
    deviations = hyperparameters.get("annealed_std")
    if deviations is not None:
        found.append(
            AnnealedNoise(*_checked("hyperparameters.annealed_std", deviations, tuple[Positive, Positive]))
        )
    return found


def linear(initial: float) -> Callable[[float], float]:
    """A schedule from ``initial`` to zero; its argument goes from 1 at the beginning to 0 at the end."""
    return lambda remaining: remaining * initial


def _noise(given: Mapping[str, Any], size: int) -> Any:
    kind, deviation = given.get("noise_type", "normal"), given.get("noise_std", 0.1)
    if kind not in NOISES:
        raise ConfigurationError(f"hyperparameters.noise_type: {kind!r}; use one of {', '.join(NOISES)}")
    if not isinstance(deviation, int | float) or isinstance(deviation, bool) or deviation < 0.0:
        raise ConfigurationError(f"hyperparameters.noise_std: expected a number from 0, found {deviation!r}")
    return NOISES[kind](mean=np.zeros(size), sigma=np.full(size, float(deviation)))


_NUMBER: Final = (int, float, np.number)
_INITIAL_WEIGHT: Final = 1e5
"""Observations that the normalization of an initial agent counts for."""


class SB3Learner(Learner):
    """A Stable-Baselines3 model with its environments; see :class:`~...registry.Learner`."""

    def __init__(self, config: TrainingConfig) -> None:
        torch.set_num_threads(config.threads)
        algorithm, self._total = CLASSES[config.algo], config.steps
        # Checked before the drives are made, which takes seconds.
        if arguments(algorithm, config.hyperparameters, 1)[_POLICY] is GroupCriticPolicy:
            _check_groups(config)
        base = base_policy(config.base, config.task)
        self.simulators = DrivingSimulatorVecEnv(
            config.n_envs,
            config.task,
            base=base,
            group=config.group,
            stagger=config.group > 1,
            device=config.device,
        )
        (size,) = self.simulators.action_space.shape or (0,)
        hyperparameters = arguments(algorithm, config.hyperparameters, size)
        env: VecEnv = self.simulators
        if hyperparameters[_POLICY] is GroupCriticPolicy:
            env = Deviations(self.simulators)
        self.normalize = _normalized(env, config)
        env = self.normalize or env
        self.model = _model(algorithm, env, config, hyperparameters)
        initial = initial_network(config)
        if initial is not None:
            load_network(initial, self.model, self.normalize, _INITIAL_WEIGHT)
        self.callbacks = callbacks_of(config.hyperparameters)
        self.model.set_logger(Logger(None, output_formats=[]))
        self.monitor = Monitor()
        self._resumed: State | None = None

    @property
    def steps(self) -> int:
        """Actions so far."""
        return int(self.model.num_timesteps)

    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        left = self._total - self.steps
        if left <= 0:
            return
        callback = [*self.callbacks, _Callback(self._at(boundary), self.monitor, self.simulators)]
        # No Generic method: the classes' own differ in the default of log_interval alone.
        learn: Any = self.model.learn
        learn(left, callback=callback, log_interval=None, reset_num_timesteps=False)

    def _at(self, boundary: Boundary) -> Boundary:
        def settled() -> None:
            if self._resumed is not None:
                restore_random(self._resumed, self.model)
                self._resumed = None
            boundary()

        return settled

    def scalars(self) -> dict[str, float]:
        """Means since the last call, and what the last update logged."""
        logged = self._logged()
        self.model.logger.name_to_value.clear()
        self.model.logger.name_to_count.clear()
        if "train/entropy_loss" in logged:
            logged["train/entropy"] = -logged["train/entropy_loss"]
        share = self.simulators.take_drive_share()
        drives = {} if share is None else {"rollout/drive_share": share}
        return {**self.monitor.take(), **drives, **logged}

    def _logged(self) -> dict[str, float]:
        values: dict[str, Any] = self.model.logger.name_to_value
        return {name: float(value) for name, value in values.items() if isinstance(value, _NUMBER)}

    def network(self) -> PolicyNetwork:
        """The deterministic policy with its normalization."""
        return network_of(self.model, self.normalize)

    def exploring(self, n: int) -> AbstractContextManager[Act | None]:
        """The policy with the noise it explores with, for ``n`` environments."""
        return exploring(self.model, self.normalize, n)

    @classmethod
    def advice(cls, config: TrainingConfig) -> list[str]:
        """Reasons why a configuration will hardly learn."""
        algorithm = CLASSES[config.algo]
        arguments(algorithm, config.hyperparameters, 1)
        return advice(config, algorithm)

    def state(self) -> dict[str, Any]:
        """Weights, optimizers, replay buffer, normalization, environments, random generators, log."""
        whole = state_of(self.model, self.simulators, self.normalize)
        rates = [
            [one.rate, one.adapted_at] for one in self.callbacks if isinstance(one, AdaptiveLearningRate)
        ]
        return {**whole, "monitor": self.monitor.state(), "logged": self._logged(), "rates": rates}

    def restore(self, state: State) -> None:
        """Go on from a state."""
        restore(state, self.model, self.simulators, self.normalize)
        self._resumed = {name: state[name] for name in ("random", "noise", "walks")}
        self.monitor.restore(state["monitor"])
        self.model.logger.name_to_value.update(state.get("logged", state.get("told", {})))
        adaptive = [one for one in self.callbacks if isinstance(one, AdaptiveLearningRate)]
        for callback, saved in zip(adaptive, state.get("rates", []), strict=True):
            callback.rate, callback.adapted_at = saved


def _model(
    algorithm: type[BaseAlgorithm], env: VecEnv, config: TrainingConfig, hyperparameters: dict[str, Any]
) -> BaseAlgorithm:
    try:
        return algorithm(env=env, seed=config.seed, device=config.device, **hyperparameters)
    except (AssertionError, TypeError, ValueError) as error:
        # Values that are right by themselves, but do not go together.
        raise ConfigurationError(f"hyperparameters: {' '.join(str(error).split())}") from None


def _check_groups(config: TrainingConfig) -> None:
    if config.group < 2:
        raise ConfigurationError("hyperparameters.policy GroupCriticPolicy needs groups: set group to 8")
    if config.normalize.observation:
        raise ConfigurationError(
            "normalize.observation must be off with hyperparameters.policy GroupCriticPolicy; "
            "set task.observation.scaling to typical"
        )


def _normalized(env: VecEnv, config: TrainingConfig) -> VecNormalize | None:
    options = config.normalize
    if not (options.observation or options.reward):
        return None
    gamma: Any = config.hyperparameters.get("gamma", 0.99)
    return VecNormalize(
        env,
        norm_obs=options.observation,
        norm_reward=options.reward,
        clip_obs=options.clip,
        clip_reward=options.clip,
        gamma=float(gamma),
    )


class _Callback(BaseCallback):
    """Calls the monitor at every step, and the training at every boundary."""

    def __init__(self, boundary: Boundary, monitor: Monitor, simulators: DrivingSimulatorVecEnv) -> None:
        super().__init__()
        self._boundary, self._monitor, self._simulators = boundary, monitor, simulators

    def _on_rollout_start(self) -> None:
        self._boundary()

    def _on_step(self) -> bool:
        arrays = self._simulators.batch.arrays
        self._monitor.step(arrays.reward.pull(), arrays.terms.pull(), self.locals["infos"])
        return True
