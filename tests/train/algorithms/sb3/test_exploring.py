"""The noise an algorithm explores with is measured without changing what it learns."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from motion_cueing.train.registry import ALGORITHMS, Learner

from ... import tiny

N = 3


def learner_of(folder, algo: str, **fields) -> Learner:
    return ALGORITHMS[algo](tiny.config(folder, algo, **fields))


def generators() -> tuple[bytes, bytes]:
    return torch.get_rng_state().numpy().tobytes(), np.random.get_state()[1].tobytes()  # noqa: NPY002


CASES = {
    "ppo": ("ppo", {}),
    "ppo, noise of the state": ("ppo", {"use_sde": True}),
    "sac": ("sac", {}),
    "sac, more noise": ("sac", {"noise_type": "normal", "noise_std": 0.3}),
    "td3": ("td3", {"noise_type": "ornstein-uhlenbeck", "noise_std": 0.3}),
}


@pytest.mark.parametrize("name", CASES)
def test_it_is_repeatable_within_bounds_and_leaves_the_generators_alone(name, tmp_path):
    algo, hyperparameters = CASES[name]
    learner = learner_of(tmp_path, algo, hyperparameters=hyperparameters)
    network = learner.network()
    seen = np.random.default_rng(0).normal(size=(N, network.size)).astype(np.float32)
    runs = []
    for _ in range(2):
        before = generators()
        with learner.exploring(N) as act:
            runs.append(np.array([act(seen) for _ in range(5)]))
        assert generators() == before
    assert runs[0].shape == (5, N, 9)
    assert np.array_equal(*runs)
    assert np.abs(runs[0]).max() <= 1.0
    assert not np.allclose(runs[0][0], np.asarray(network(seen)), atol=1e-3)


def test_the_mean_is_the_policy_and_the_deviation_that_of_the_gaussian(tmp_path):
    kwargs = {"policy_kwargs": {"log_std_init": float(np.log(0.1))}}
    learner = learner_of(tmp_path, "ppo", hyperparameters=kwargs)
    learner.normalize.obs_rms.mean[:] = 0.5
    network = learner.network()
    seen = np.tile(np.linspace(-1.0, 2.0, network.size, dtype=np.float32), (4000, 1))
    with learner.exploring(len(seen)) as act:
        actions = np.asarray(act(seen))
    assert np.allclose(actions.mean(axis=0), np.asarray(network(seen[:1]))[0], atol=0.01)
    assert actions.std(axis=0) == pytest.approx(0.1, rel=0.1)


def test_td3_without_noise_explores_with_its_policy(tmp_path):
    learner = learner_of(tmp_path, "td3", hyperparameters={"noise_std": 0.0})
    network = learner.network()
    seen = np.zeros((N, network.size), dtype=np.float32)
    with learner.exploring(N) as act:
        assert np.allclose(act(seen), np.asarray(network(seen)), atol=1e-5)


def test_algorithms_without_noise_have_nothing_to_measure(tmp_path):
    learner = learner_of(tmp_path, "apg", normalize={"observation": False, "reward": False})
    with learner.exploring(N) as act:
        assert act is None
