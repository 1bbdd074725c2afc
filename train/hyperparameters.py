"""Hyperparameters as YAML has them become arguments of a Stable-Baselines3 class, checked against it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any, Final, get_type_hints

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise, OrnsteinUhlenbeckActionNoise

from ..envs.errors import ConfigurationError, suggest
from .actor import ACTIVATIONS
from .sb3_policy import SkipPolicy

SCHEDULED: Final = "lin_"
"""Before a number: it falls linearly to zero at the end of the training."""

NOISES: Final[Mapping[str, Any]] = {
    "normal": NormalActionNoise,
    "ornstein-uhlenbeck": OrnsteinUhlenbeckActionNoise,
}
"""Names that ``noise_type`` takes."""

_NOISE: Final = ("noise_type", "noise_std")
_POLICY: Final = "policy"
_OURS: Final = {
    "self", "policy", "env", "verbose", "seed", "device", "tensorboard_log", "stats_window_size",
    "action_noise", "rollout_buffer_class", "rollout_buffer_kwargs", "replay_buffer_class",
    "replay_buffer_kwargs", "optimize_memory_usage", "_init_setup_model",
}  # fmt: skip
"""Arguments that the training sets, or that a file cannot hold."""
_OURS_OF_POLICY: Final = {"self", "observation_space", "action_space", "lr_schedule", "use_sde"} | {
    "features_extractor_class", "features_extractor_kwargs", "share_features_extractor", "normalize_images",
    "optimizer_class", "optimizer_kwargs", "squash_output",
}  # fmt: skip

_LENIENT: Final = ConfigDict(arbitrary_types_allowed=True)


def arguments(
    algorithm: type[BaseAlgorithm], hyperparameters: Mapping[str, Any], action_size: int
) -> dict[str, Any]:
    """Keyword arguments of a Stable-Baselines3 algorithm.

    Args:
        algorithm: Its class.
        hyperparameters: As in rl-baselines3-zoo: numbers may be schedules (``lin_3e-4``); ``policy_kwargs``
            is a mapping, its ``activation_fn`` one of :data:`ACTIVATIONS`; ``policy`` "MlpPolicy" or, for
            PPO, "SkipPolicy", whose last layers see the observation, too; ``noise_type`` and ``noise_std``
            make the action noise.
        action_size: Entries of an action.

    Raises:
        ConfigurationError: one is unknown or of the wrong type.
    """
    known = _parameters(algorithm, _OURS)
    noisy = "action_noise" in inspect.signature(algorithm).parameters
    _refuse_unknown("hyperparameters", hyperparameters, [*known, _POLICY, *(_NOISE if noisy else ())])
    found = {name: v for name, v in hyperparameters.items() if name not in (*_NOISE, _POLICY)}
    found["policy_kwargs"] = _policy_kwargs(algorithm, found.get("policy_kwargs") or {})
    checked = {name: _checked(f"hyperparameters.{name}", v, known[name]) for name, v in found.items()}
    checked[_POLICY] = _policy(
        algorithm, hyperparameters.get(_POLICY, "MlpPolicy"), bool(hyperparameters.get("use_sde"))
    )
    if "noise_type" in hyperparameters or "noise_std" in hyperparameters:
        checked["action_noise"] = _noise(hyperparameters, action_size)
    return checked


def _policy(algorithm: type[BaseAlgorithm], name: Any, use_sde: bool) -> Any:
    known = {"MlpPolicy": "MlpPolicy"} | ({"SkipPolicy": SkipPolicy} if algorithm is PPO else {})
    if name not in known:
        raise ConfigurationError(f"hyperparameters.policy: {name!r}; use one of {', '.join(known)}")
    if known[name] is SkipPolicy and use_sde:
        raise ConfigurationError("hyperparameters.use_sde must be off with policy SkipPolicy")
    return known[name]


def _parameters(cls: type[Any], ours: set[str]) -> dict[str, Any]:
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


def _policy_kwargs(algorithm: type[BaseAlgorithm], given: Any) -> dict[str, Any]:
    where = "hyperparameters.policy_kwargs"
    if not isinstance(given, Mapping):
        raise ConfigurationError(f"{where}: expected fields with values, found {given!r}")
    known = _parameters(algorithm.policy_aliases["MlpPolicy"], _OURS_OF_POLICY)
    _refuse_unknown(where, given, list(known))
    checked = dict(given)
    if "activation_fn" in checked:
        name = checked["activation_fn"]
        if name not in ACTIVATIONS:
            raise ConfigurationError(f"{where}.activation_fn: {name!r}; use one of {', '.join(ACTIVATIONS)}")
        checked["activation_fn"] = ACTIVATIONS[name]
    return {name: _checked(f"{where}.{name}", value, known[name]) for name, value in checked.items()}


def _checked(where: str, value: Any, hint: Any) -> Any:
    """``value`` as the annotation has it."""
    if isinstance(value, str) and value.startswith(SCHEDULED):
        return linear(_number(where, value.removeprefix(SCHEDULED)))
    try:
        return TypeAdapter(hint, config=_LENIENT).validate_python(value)
    except ValidationError as error:
        reasons = " or ".join(dict.fromkeys(item["msg"] for item in error.errors()))
        raise ConfigurationError(f"{where}: {reasons} (found {value!r})") from None


def _number(where: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ConfigurationError(f"{where}: expected a number after {SCHEDULED}, found {text!r}") from None


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
