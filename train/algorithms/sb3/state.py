"""State of a Stable-Baselines3 training: everything that is needed to go on from it bit for bit.

Not in it: PyTorch's generator on a GPU.
"""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from operator import attrgetter
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from sb3_contrib.common.recurrent.type_aliases import RNNStates
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import OrnsteinUhlenbeckActionNoise, VectorizedActionNoise
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from ...registry import State, restoring
from ...vec_env import DrivingSimulatorVecEnv
from .group_critic import GroupCriticPolicy

_PLAIN: Final = ("num_timesteps", "_n_updates", "_episode_num")
_NOISE: Final = ("exploration_mat", "exploration_matrices")
_ARRAYS: Final = ("_last_obs", "_last_episode_starts", "_last_original_obs")


def state_of(
    model: BaseAlgorithm, simulators: DrivingSimulatorVecEnv, normalize: VecNormalize | None
) -> dict[str, Any]:
    """The state at the beginning of a rollout."""
    modules, tensors = model._get_torch_save_params()
    return {
        "modules": {name: attrgetter(name)(model).state_dict() for name in modules},
        "tensors": {name: attrgetter(name)(model).detach() for name in tensors},
        "plain": {name: getattr(model, name) for name in _PLAIN},
        "arrays": {name: getattr(model, name, None) for name in _ARRAYS},
        "lstm": _lstm(model),
        "episodes": [dict(info) for info in model.ep_info_buffer or ()],
        "replay": _replay(model),
        "normalize": None if normalize is None else _statistics(normalize),
        "simulators": simulators.snapshot(),
        **_randomness(model),
    }


def _randomness(model: BaseAlgorithm) -> dict[str, Any]:
    """Random generators, and noise that lasts."""
    return {
        "random": _random(model),
        "noise": {name: getattr(_noisy(model), name) for name in _NOISE} if _noisy(model) else {},
        "walks": [walk.noise_prev.copy() for walk in _walks(model)],
    }


@contextmanager
def exploring(
    model: BaseAlgorithm, normalize: VecNormalize | None, n: int
) -> Iterator[Callable[[NDArray[np.float32]], NDArray[np.float32]]]:
    """The policy with the noise it explores with, for ``n`` environments, always the same draws.

    After the block generators and noise of the model are as before.
    """
    before, policy = _randomness(model), model.policy
    noise = getattr(model, "action_noise", None)
    if noise is not None:
        one = noise.noises[0] if isinstance(noise, VectorizedActionNoise) else noise
        noise = VectorizedActionNoise(copy.deepcopy(one), n)
        noise.reset()

    memory: Any = None
    begins = np.ones(n, dtype=bool)

    def act(observation: NDArray[np.float32]) -> NDArray[np.float32]:
        nonlocal memory
        seen: Any = observation if normalize is None else normalize.normalize_obs(observation)
        if isinstance(policy, GroupCriticPolicy):
            # One by itself deviates from none, and the actor does not see it.
            seen = np.hstack([seen, np.zeros_like(seen)])
        action, memory = model.predict(seen, memory, begins, deterministic=False)
        begins[...] = False
        if noise is None:
            return action
        # As OffPolicyAlgorithm adds it: in an action space of -1 to 1.
        return policy.unscale_action(np.clip(policy.scale_action(action) + noise(), -1.0, 1.0))

    try:
        # Not that of a GPU, which could not be put back.
        torch.default_generator.manual_seed(0)
        np.random.seed(0)  # noqa: NPY002
        if _noisy(model):
            policy_with_noise: Any = policy
            policy_with_noise.reset_noise(n)
        yield act
    finally:
        restore_random(before, model)


def restore(
    state: State,
    model: BaseAlgorithm,
    simulators: DrivingSimulatorVecEnv,
    normalize: VecNormalize | None,
) -> None:
    """Put a model made of the same configuration into a state."""
    with restoring():
        _restore_model(state, model)
        _restore_replay(state["replay"], model)
        if normalize is not None:
            _restore_statistics(state["normalize"], normalize)
        simulators.restore(state["simulators"])
        restore_random(state, model)


def _restore_model(state: State, model: BaseAlgorithm) -> None:
    for name, values in state["modules"].items():
        attrgetter(name)(model).load_state_dict(values)
    for name, tensor in state["tensors"].items():
        attrgetter(name)(model).data.copy_(tensor)
    for name in (*_PLAIN, *_ARRAYS):
        group = "plain" if name in _PLAIN else "arrays"
        setattr(model, name, state[group][name])
    if isinstance(model, RecurrentPPO):
        recurrent: Any = model
        recurrent._last_lstm_states = RNNStates(*(tuple(pair) for pair in state["lstm"]))
    model.ep_info_buffer = deque(state["episodes"], maxlen=model._stats_window_size)
    model.ep_success_buffer = deque(maxlen=model._stats_window_size)


def _lstm(model: BaseAlgorithm) -> list[list[torch.Tensor]] | None:
    """Output and cell of the actor's LSTM, and of the critic's."""
    states: Any = model._last_lstm_states if isinstance(model, RecurrentPPO) else None
    return None if states is None else [list(states.pi), list(states.vf)]


def _replay(model: BaseAlgorithm) -> dict[str, Any] | None:
    """What the replay buffer holds; rows that were never filled stay out."""
    buffer = model.replay_buffer if isinstance(model, OffPolicyAlgorithm) else None
    if buffer is None:
        return None
    filled = buffer.buffer_size if buffer.full else buffer.pos
    rows = {name: value[:filled] for name, value in vars(buffer).items() if isinstance(value, np.ndarray)}
    return {"rows": rows, "pos": buffer.pos, "full": buffer.full}


def _restore_replay(saved: State | None, model: BaseAlgorithm) -> None:
    buffer = model.replay_buffer if isinstance(model, OffPolicyAlgorithm) else None
    if saved is None or buffer is None:
        return
    for name, rows in saved["rows"].items():
        getattr(buffer, name)[: len(rows)] = rows
    buffer.pos, buffer.full = saved["pos"], saved["full"]


def _statistics(normalize: VecNormalize) -> dict[str, Any]:
    statistics: dict[str, Any] = {"returns": normalize.returns}
    for name in ("obs_rms", "ret_rms"):
        moments = getattr(normalize, name, None)
        if moments is not None:
            statistics[name] = {"mean": np.array(moments.mean), "var": np.array(moments.var)}
            statistics[name]["count"] = float(moments.count)
    return statistics


def _restore_statistics(saved: State, normalize: VecNormalize) -> None:
    normalize.returns = np.array(saved["returns"])
    for name in ("obs_rms", "ret_rms"):
        moments = getattr(normalize, name, None)
        if moments is not None:
            # Of no dimension for rewards, where NumPy numbers stand in for arrays.
            moments.mean, moments.var = saved[name]["mean"][()], saved[name]["var"][()]
            moments.count = saved[name]["count"]


def _random(model: BaseAlgorithm) -> dict[str, Any]:
    # SB3 draws from NumPy's global generator (Mersenne Twister), PyTorch's, and the action space's own.
    _, keys, *rest = np.random.get_state()  # noqa: NPY002
    space = model.action_space.np_random.bit_generator.state
    return {"numpy": [keys, *rest], "torch": torch.get_rng_state(), "space": _as_text(space)}


def restore_random(state: State, model: BaseAlgorithm) -> None:
    """Put noise and random generators back; once more at the first rollout, before which others are drawn."""
    saved = state["random"]
    np.random.set_state(("MT19937", *saved["numpy"]))  # noqa: NPY002
    torch.set_rng_state(saved["torch"])
    model.action_space.np_random.bit_generator.state = _as_numbers(saved["space"])
    for name, matrices in state["noise"].items():
        setattr(_noisy(model), name, matrices)
    # A model that has not learned yet has one noise for all environments.
    for walk, before in zip(_walks(model), state["walks"], strict=False):
        walk.noise_prev = before.copy()


def _walks(model: BaseAlgorithm) -> list[OrnsteinUhlenbeckActionNoise]:
    """Action noises that remember; learning begins with forgetting."""
    noise = getattr(model, "action_noise", None)
    noises = noise.noises if isinstance(noise, VectorizedActionNoise) else [noise]
    return [one for one in noises if isinstance(one, OrnsteinUhlenbeckActionNoise)]


def _noisy(model: BaseAlgorithm) -> Any:
    """The distribution that holds noise over a rollout, or None."""
    if not getattr(model, "use_sde", False):
        return None
    policy: Any = model.policy
    return policy.actor.action_dist if isinstance(model, OffPolicyAlgorithm) else policy.action_dist


def _as_text(state: Any) -> Any:
    """Numbers of 128 bits are no numbers of a checkpoint."""
    if isinstance(state, dict):
        return {name: _as_text(value) for name, value in state.items()}
    return str(state)


def _as_numbers(state: Any) -> Any:
    if isinstance(state, dict):
        return {name: _as_numbers(value) for name, value in state.items()}
    return int(state) if state.lstrip("-").isdigit() else state
