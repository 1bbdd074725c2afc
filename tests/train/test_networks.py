"""One multilayer perceptron in four forms: NumPy, PyTorch to export, PyTorch to train, backward in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from motion_cueing.envs.errors import DataError
from motion_cueing.train.agents.network import ACTIVATIONS
from motion_cueing.train.algorithms.apg.backpropagation import NumpyBackward
from motion_cueing.train.networks import TORCH_ACTIVATIONS, Actor, TorchNetwork

from .agents import network


def actor(activation: str = "elu", hidden: tuple[int, ...] = (5, 4)) -> Actor:
    """An actor with a normalization of its own."""
    torch.manual_seed(1)
    made = Actor(7, 3, hidden, activation)
    made.set_normalization(torch.randn(7), torch.rand(7) + 0.5, torch.rand(3) + 0.2)
    return made


def test_numpy_and_pytorch_have_the_same_activations():
    assert ACTIVATIONS.keys() == TORCH_ACTIVATIONS.keys()


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_an_activation_and_its_derivative_are_those_of_pytorch(name):
    x = torch.linspace(-6.0, 6.0, 101).requires_grad_(True)
    expected = TORCH_ACTIVATIONS[name]()(x)
    (slope,) = torch.autograd.grad(expected.sum(), x)
    values = x.detach().numpy()
    np.testing.assert_allclose(ACTIVATIONS[name].function(values), expected.detach(), atol=2e-6)
    np.testing.assert_allclose(ACTIVATIONS[name].derivative(values), slope, atol=2e-6)


@pytest.mark.parametrize("hidden", [(), (6,), (5, 4)])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_all_forms_of_an_actor_agree(activation, hidden):
    trained = actor(activation, hidden)
    observations = np.random.default_rng(0).normal(size=(50, 7)).astype(np.float32)
    expected = trained(torch.from_numpy(observations)).detach().numpy()
    plain = trained.network()
    np.testing.assert_allclose(plain(observations), expected, atol=1e-6)
    exported = TorchNetwork(plain)(torch.from_numpy(observations)).detach()
    np.testing.assert_allclose(exported, expected, atol=1e-6)
    np.testing.assert_allclose(NumpyBackward(trained).act(observations), expected, atol=1e-6)
    again = Actor(7, 3, hidden, activation)
    again.load(plain)
    np.testing.assert_allclose(again(torch.from_numpy(observations)).detach(), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("sizes", "choices"),
    [
        ((7, 3), {"squash": "clip", "activation": "relu"}),
        ((7, 6, 3), {"squash": "tanh", "skip": True, "activation": "elu"}),
        ((7, 6, 5, 3), {"normalized": False, "skip": True, "activation": "silu"}),
        ((7, 6, 5, 3), {"squash": "tanh", "activation": "tanh"}),
    ],
)
def test_the_exported_form_of_any_network_agrees(sizes, choices):
    plain = network(sizes, **choices)
    # Some are beyond the clip of the normalization, and some actions beyond +-1.
    observations = np.random.default_rng(0).normal(scale=8.0, size=(50, 7)).astype(np.float32)
    found = TorchNetwork(plain)(torch.from_numpy(observations)).detach().numpy()
    np.testing.assert_allclose(found, plain(observations), atol=1e-6)


@pytest.mark.parametrize("hidden", [(5, 4), (6,)])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_the_backward_pass_is_that_of_autograd(activation, hidden):
    """Of several steps kept one behind another, from the last to the first."""
    trained = actor(activation, hidden)
    steps = NumpyBackward(trained)
    observations, gradient = torch.randn(4, 6, 7), torch.randn(4, 6, 3)
    for k in range(4):
        steps.act(observations[k].numpy())
    for k in reversed(range(4)):
        point = observations[k].clone().requires_grad_(True)
        (expected,) = torch.autograd.grad(trained(point), point, gradient[k])
        np.testing.assert_allclose(steps.back(gradient[k].numpy()), expected, atol=1e-5)


def test_a_normalization_leaves_the_policy_as_it_is():
    torch.manual_seed(2)
    trained, observations = Actor(7, 3, (5, 4)), torch.randn(6, 7)
    before = trained(observations).detach()
    trained.set_normalization(torch.randn(7), torch.rand(7) + 0.5, torch.rand(3) + 0.2)
    np.testing.assert_allclose(trained(observations).detach(), before, atol=1e-6)


def test_a_network_of_other_layers_is_refused():
    with pytest.raises(DataError, match=r"use its hidden layers and activation, which are \[6\] and elu"):
        actor().load(network((7, 6, 3), normalized=False, squash="tanh", skip=True, activation="elu"))
