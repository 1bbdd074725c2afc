"""Configurations of Stable-Baselines3 that hardly learn, found before they are trained."""

from __future__ import annotations

import inspect
import math
from typing import Any, Final

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from ....envs.errors import ConfigurationError
from ....envs.platform.machines import AXES, Platform, limits_of
from ....envs.simulator.simulator import TIME_STEP
from ....envs.task.episode import platform_of
from ....envs.task.kernels.action import acceleration_scale, action_scale, velocity_scale
from ....envs.task.options import TaskOptions
from ...config import TrainingConfig
from .group_critic import GroupCriticPolicy

_HOPELESS: Final = 0.9
"""Share of actions at their bound from which nothing can be learned."""

_FULL: Final = 0.5
"""Share of the machine's own accelerations that is close to full authority."""


def advice(config: TrainingConfig, algorithm: type[BaseAlgorithm]) -> list[str]:
    """Reasons why a configuration will hardly learn, a sentence each that names the field.

    Raises:
        ConfigurationError: it cannot learn at all.
    """
    found = (
        _saturation(config, algorithm),
        _short_horizon(config, algorithm),
        _full_authority(config.task),
    )
    return [sentence for sentence in found if sentence is not None]


def _saturation(config: TrainingConfig, algorithm: type[BaseAlgorithm]) -> str | None:
    """A Gaussian that is wider than the bound of an action."""
    given = config.hyperparameters
    if not issubclass(algorithm, OnPolicyAlgorithm) or given.get("use_sde"):
        return None
    kwargs: Any = given.get("policy_kwargs") or {}
    annealed: Any = given.get("annealed_std")
    deviation = math.exp(float(kwargs.get("log_std_init", 0.0))) if annealed is None else float(annealed[0])
    bound = config.task.action.bound
    beyond = math.erfc(bound / deviation / math.sqrt(2.0))
    if deviation <= bound:
        return None
    sentence = (
        f"hyperparameters.policy_kwargs.log_std_init {math.log(deviation):.3g}: {100.0 * beyond:.0f} % of "
        f"actions lie beyond task.action.bound {bound:g} at first; take at most {math.log(bound / 2.0):.2g}"
    )
    if beyond > _HOPELESS:
        raise ConfigurationError(sentence)
    return sentence


def _short_horizon(config: TrainingConfig, algorithm: type[BaseAlgorithm]) -> str | None:
    """A horizon that ends before a constant action has used the travel up."""
    time, horizon = travel_time(config.task), _horizon(config, algorithm)
    if time is None or horizon >= time:
        return None
    fields = _horizon_fields(config, algorithm)
    names, verb = " and ".join(fields), "credits" if len(fields) == 1 else "credit"
    return (
        f"hyperparameters: {names} {verb} an action for {horizon:.1f} s, but its travel costs after "
        f"{time:.1f} s; raise {names}, or charge travel earlier (task.reward.stroke_margin, stroke_braking)"
    )


def _horizon(config: TrainingConfig, algorithm: type[BaseAlgorithm]) -> float:
    """How far ahead an action is credited: the trace of GAE, or the discount's time constant, s."""
    defaults = inspect.signature(algorithm).parameters
    share = 1.0
    for name in _horizon_fields(config, algorithm):
        value: Any = config.hyperparameters.get(name, defaults[name].default)
        share *= float(value)
    step = TIME_STEP * config.task.action.repeat
    return math.inf if share >= 1.0 else step / (1.0 - share)


def _horizon_fields(config: TrainingConfig, algorithm: type[BaseAlgorithm]) -> list[str]:
    """Hyperparameters that the horizon follows from; a critic that knows machines bridges a short trace."""
    critic = config.hyperparameters.get("policy") == GroupCriticPolicy.__name__
    return ["gamma", "gae_lambda"] if issubclass(algorithm, OnPolicyAlgorithm) and not critic else ["gamma"]


def travel_time(task: TaskOptions) -> float | None:
    """Time in which an action of 1 takes the carriage from rest at neutral to where its travel costs, s.

    That is its end, or the share ``stroke_margin`` of its travel where the reward charges travel; with
    ``stroke_braking`` travel counts where the carriage would come to a stop.

    Returns:
        The shorter of both axes; None where no action moves the carriage directly.
    """
    platform, action, reward = platform_of(task), task.action, task.reward
    if platform.carriage is None or action.mode == "gains":
        return None
    margin = reward.stroke_margin if reward.weights.stroke > 0.0 else 1.0
    braking = reward.stroke_braking if reward.weights.stroke > 0.0 else None
    moved = [k for k in range(2) if AXES[k] in action.axes and AXES[k] not in action.frozen]
    times = [_time_to(platform, task, k, margin, braking) for k in moved]
    return min(times, default=None)


def _time_to(platform: Platform, task: TaskOptions, axis: int, margin: float, braking: float | None) -> float:
    limits = limits_of(platform)
    distance = margin * min(limits["position_max"][axis], -limits["position_min"][axis])
    speed = float(velocity_scale(platform)[axis])
    if task.action.mode == "velocity":
        return float(distance / speed)
    acceleration = float(action_scale(platform, task.action)[axis])
    # What stopping takes, as a share of the way so far: v^2 = 2 a x.
    stop = 0.0 if braking is None else acceleration / (braking * limits["acceleration"][axis])
    way = distance / (1.0 + stop)
    reached = speed * speed / (2.0 * acceleration)
    if way <= reached:
        return math.sqrt(2.0 * float(way) / acceleration)
    if braking is not None:
        way = max(distance - stop * reached, reached)
    return speed / acceleration + float(way - reached) / speed


def _full_authority(task: TaskOptions) -> str | None:
    """Actions that are the machine's whole acceleration, with no controller below them."""
    action = task.action
    if action.mode in ("residual", "gains"):
        return None
    platform = platform_of(task)
    own, ours = acceleration_scale(platform), action_scale(platform, action)
    chosen = np.array([axis in action.axes and axis not in action.frozen for axis in AXES]) & (own > 0.0)
    if not chosen.any() or float(np.max(ours[chosen] / own[chosen])) < _FULL:
        return None
    return (
        f"task.action.mode {action.mode!r} with the machine's full accelerations and no controller below: "
        "noise alone drives it to its ends; take the task 'cueing', mode 'residual' or a small authority"
    )
