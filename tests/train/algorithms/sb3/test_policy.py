"""Networks of Stable-Baselines3's models act as the models do."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from gymnasium import spaces
from sb3_contrib import ARS, TRPO, RecurrentPPO
from sb3_contrib.common.torch_layers import BatchRenorm1d
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecNormalize

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.task import ObservationOptions
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.train.algorithms.sb3.policy import CLASSES, SkipPolicy, load_network, network_of
from motion_cueing.train.algorithms.sb3.sb3 import arguments
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

from ....envs.task.tasks import SHORT

ROWS = 500
SIZE = layout_of(ObservationOptions(), "acceleration", 9).size


def shaken(model) -> None:
    """Weights as large as after a training: new ones hardly leave the neighborhood of zero."""
    generator = torch.Generator().manual_seed(3)
    with torch.no_grad():
        for parameter in model.policy.parameters():
            parameter += 0.2 * torch.randn(parameter.shape, generator=generator)
        for module in model.policy.modules():
            if isinstance(module, BatchRenorm1d):
                module.ra_mean.normal_(0.0, 0.5, generator=generator)
                module.ra_var.uniform_(0.2, 2.0, generator=generator)


def make(name: str, normalized: bool = True, **policy):
    """A model with its normalization."""
    env = DrivingSimulatorVecEnv(2, episode=SHORT)
    env = VecNormalize(env, clip_obs=3.0) if normalized else env
    if normalized:
        rng = np.random.default_rng(1)
        env.obs_rms.update(rng.normal(0.3, rng.uniform(0.01, 2.0, SIZE), (50, SIZE)))
    kind = "MlpLstmPolicy" if name == "recurrent-ppo" else "MlpPolicy"
    policy = {"lstm_hidden_size": 7, "n_lstm_layers": 2, **policy} if name == "recurrent-ppo" else policy
    model = CLASSES[name](kind, env, policy_kwargs={"net_arch": [16, 12], **policy}, seed=1)
    shaken(model)
    return model, env if normalized else None


def acted(network, seen: np.ndarray) -> np.ndarray:
    """Actions in environments that all begin."""
    return network.acting()(seen)


def observations(size: int) -> np.ndarray:
    return np.random.default_rng(2).normal(0.0, 2.0, (ROWS, size)).astype(np.float32)


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("name", CLASSES)
def test_it_predicts_what_the_model_does(name, normalized):
    model, normalize = make(name, normalized)
    network = network_of(model, normalize)
    seen = observations(network.size)
    expected, _ = model.predict(normalize.normalize_obs(seen) if normalize else seen, deterministic=True)
    assert np.allclose(acted(network, seen), expected, rtol=0.0, atol=1e-5)
    inside = np.abs(expected) < 1.0
    assert inside.mean() > 0.2
    assert np.std(expected[inside]) > 0.1


def test_a_model_with_a_memory_acts_as_its_network_does_over_time():
    model, normalize = make("recurrent-ppo")
    network, states, generator = network_of(model, normalize), [None, None], np.random.default_rng(4)
    assert [layer.units for layer in network.lstm] == [7, 7]
    actions = []
    for _ in range(30):
        seen = generator.normal(0.0, 2.0, (5, SIZE)).astype(np.float32)
        begins = generator.random(5) < 0.1
        expected, states[0] = model.predict(
            normalize.normalize_obs(seen), states[0], begins, deterministic=True
        )
        found, states[1] = network.step(seen, states[1], begins)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-5)
        actions.append(found)
    assert np.std(actions) > 0.1


@pytest.mark.parametrize("option", [{"bidirectional": True}, {"bias": False}, {"proj_size": 3}])
def test_lstm_layers_of_another_kind_are_refused(option):
    env = DrivingSimulatorVecEnv(1, episode=SHORT)
    model = RecurrentPPO("MlpLstmPolicy", env, policy_kwargs={"lstm_kwargs": option})
    with pytest.raises(DataError, match="lstm_kwargs: an agent holds LSTM layers of the plain kind alone"):
        network_of(model)


@pytest.mark.parametrize("activation", [torch.nn.Tanh, torch.nn.ReLU, torch.nn.ELU, torch.nn.SiLU])
@pytest.mark.parametrize("name", ["ppo", "sac"])
def test_activations_are_the_models(name, activation):
    model, normalize = make(name, activation_fn=activation)
    seen = observations(SIZE)
    expected, _ = model.predict(normalize.normalize_obs(seen), deterministic=True)
    assert np.allclose(acted(network_of(model, normalize), seen), expected, rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("algorithm", [PPO, TRPO])
def test_a_policy_whose_last_layer_sees_the_observation_goes_to_a_network_and_back(algorithm):
    models = []
    for seed in (1, 2):
        env = DrivingSimulatorVecEnv(2, episode=SHORT)
        models.append(algorithm(SkipPolicy, env, policy_kwargs={"net_arch": [16, 12]}, seed=seed))
        shaken(models[-1])
    network = network_of(models[0])
    seen = observations(SIZE)
    expected, _ = models[0].predict(seen, deterministic=True)
    assert network.skip
    assert np.allclose(acted(network, seen), expected, rtol=0.0, atol=1e-5)
    assert not np.allclose(models[1].predict(seen, deterministic=True)[0], expected, atol=0.01)
    load_network(network, models[1], None, 1.0)
    assert np.array_equal(models[1].predict(seen, deterministic=True)[0], expected)
    # What is sampled scatters around the same mean, and the probability is that of what was sampled.
    with torch.no_grad():
        action, _, log_probability = models[1].policy(torch.from_numpy(seen))
        _, again, _ = models[1].policy.evaluate_actions(torch.from_numpy(seen), action)
    assert np.allclose(log_probability, again, atol=1e-4)


@pytest.mark.parametrize("name", CLASSES)
def test_a_policy_without_hidden_layers_is_one_layer(name):
    none = name in ("ppo", "trpo", "recurrent-ppo")
    model, normalize = make(name, net_arch=[] if none else [5])
    network = network_of(model, normalize)
    assert len(network.head.weights) == (1 if none else 2)
    seen = observations(SIZE)
    expected, _ = model.predict(normalize.normalize_obs(seen), deterministic=True)
    assert np.allclose(acted(network, seen), expected, rtol=0.0, atol=1e-5)


def test_the_network_does_not_change_with_the_model():
    model, normalize = make("ppo")
    network = network_of(model, normalize)
    before = network(observations(SIZE))
    shaken(model)
    normalize.obs_rms.update(np.ones((10, SIZE)))
    assert np.array_equal(network(observations(SIZE)), before)


@pytest.mark.parametrize("name", CLASSES)
def test_a_model_takes_over_a_network(name):
    plain = {"batch_norm": False} if name == "crossq" else {}
    network = network_of(*make(name, **plain))
    other, normalize = make(name, **plain)
    shaken(other)
    normalize.obs_rms.update(np.ones((10, SIZE)))
    seen = observations(SIZE)
    assert not np.allclose(acted(network_of(other, normalize), seen), acted(network, seen))
    load_network(network, other, normalize, 100.0)
    assert np.array_equal(acted(network_of(other, normalize), seen), acted(network, seen))
    assert normalize.obs_rms.count == 100.0
    if name == "td3":
        for one, two in zip(
            other.policy.actor.parameters(), other.policy.actor_target.parameters(), strict=True
        ):
            assert torch.equal(one, two)


@pytest.mark.parametrize(
    ("name", "normalized", "policy", "message"),
    [
        ("ppo", True, {"net_arch": [16, 11]}, r"it has hidden layers \[16, 12\] and activation tanh"),
        ("ppo", True, {"activation_fn": torch.nn.ReLU}, "and activation tanh, and ends with clip"),
        ("sac", True, {"activation_fn": torch.nn.Tanh}, "ends with clip"),
        ("ppo", False, {}, "trained with normalize.observation true; set it so"),
        ("recurrent-ppo", True, {}, r"built in another way; it has hidden layers \[16, 12\]"),
    ],
)
def test_a_network_that_does_not_fit_is_not_taken_over(name, normalized, policy, message):
    network = network_of(*make("ppo"))
    with pytest.raises(DataError, match=message):
        load_network(network, *make(name, normalized, **policy), 1.0)


def test_a_network_with_a_memory_is_taken_over_by_its_like_alone():
    network = network_of(*make("recurrent-ppo"))
    for name, policy in (("ppo", {}), ("recurrent-ppo", {"lstm_hidden_size": 6})):
        with pytest.raises(DataError, match=r"it has LSTM layers \[7, 7\], hidden layers \[16, 12\]"):
            load_network(network, *make(name, **policy), 1.0)


def test_a_network_has_no_batch_statistics_to_take_over():
    network = network_of(*make("crossq"))
    with pytest.raises(DataError, match="initial: an agent's file has no batch statistics"):
        load_network(network, *make("crossq"), 1.0)


class Twice(BaseFeaturesExtractor):
    """Something a network cannot hold."""

    def __init__(self, space: spaces.Box) -> None:
        super().__init__(space, space.shape[0])

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return 2.0 * x


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ({"features_extractor_class": Twice}, "features extractor"),
        ({"activation_fn": torch.nn.Softsign}, "layers Softsign; a network has one of tanh"),
    ],
)
def test_what_a_network_cannot_hold_is_refused(policy, message):
    model = PPO("MlpPolicy", DrivingSimulatorVecEnv(2, episode=SHORT), policy_kwargs=policy)
    with pytest.raises(DataError, match=message):
        network_of(model)


def test_noise_that_depends_on_the_state_is_refused_where_the_mean_goes_through_a_tanh():
    assert arguments(PPO, {"policy": "SkipPolicy"}, 9)["policy"] is SkipPolicy
    assert arguments(TRPO, {"policy": "SkipPolicy"}, 9)["policy"] is SkipPolicy
    with pytest.raises(ConfigurationError, match=r"hyperparameters\.use_sde"):
        arguments(PPO, {"policy": "SkipPolicy", "use_sde": True}, 9)
    with pytest.raises(ConfigurationError, match=r"hyperparameters\.policy"):
        arguments(SAC, {"policy": "SkipPolicy"}, 9)


def test_a_model_of_another_kind_is_refused_in_one_sentence():
    model = ARS("MlpPolicy", DrivingSimulatorVecEnv(1, episode=SHORT))
    with pytest.raises(DataError, match=r"ARS: .* make a motion_cueing.train.agents.Network of it"):
        network_of(model)
