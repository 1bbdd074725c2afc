"""Steps of the weights: Adam's alone are PyTorch's, Muon's have one size in every direction."""

from __future__ import annotations

import copy

import pytest
import torch

from motion_cueing.train.algorithms.apg.apg import ActorOptimizer
from motion_cueing.train.networks import Actor


def learner() -> tuple[Actor, torch.Tensor, torch.Tensor]:
    torch.manual_seed(3)
    return Actor(12, 4, (32, 24)), torch.randn(64, 12), torch.randn(64, 4)


def loss(actor: Actor, seen: torch.Tensor, told: torch.Tensor) -> torch.Tensor:
    return (actor(seen) - 0.5 * torch.tanh(told)).pow(2).mean()


def step(
    optimizer: ActorOptimizer, actor: Actor, seen: torch.Tensor, told: torch.Tensor, done: float
) -> None:
    optimizer.step(loss(actor, seen, told), done)


def test_without_a_hidden_rate_it_is_adam():
    actor, seen, told = learner()
    other = copy.deepcopy(actor)
    optimizer, adam = ActorOptimizer(actor, 1e-2, None, 1e9), torch.optim.Adam(other.parameters(), lr=1e-2)
    for _ in range(3):
        step(optimizer, actor, seen, told, done=0.1)
        adam.zero_grad()
        loss(other, seen, told).backward()
        adam.step()
    for ours, theirs in zip(actor.parameters(), other.parameters(), strict=True):
        torch.testing.assert_close(ours, theirs)


def test_a_hidden_layer_moves_by_the_rate_in_every_direction_and_nothing_else_does():
    actor, seen, told = learner()
    before = copy.deepcopy(actor)
    step(ActorOptimizer(actor, 1e-12, 0.1, 1.0), actor, seen, told, done=0.1)
    for name, weight in actor.named_parameters():
        moved = weight.detach() - before.get_parameter(name).detach()
        if name.startswith("latent") and weight.ndim == 2:
            # Newton and Schulz bring singular values to about one; tall matrices step further in PyTorch.
            sizes = torch.linalg.svdvals(moved) / (0.1 * max(1.0, weight.shape[0] / weight.shape[1]) ** 0.5)
            assert 0.6 < float(sizes.max()) < 1.3
            assert float(sizes.median()) > 0.3
        else:
            assert float(moved.abs().max()) < 1e-9


@pytest.mark.parametrize("rate", [None, 0.02])
def test_it_goes_down_and_goes_on_from_its_state_bit_for_bit(rate):
    actor, seen, told = learner()
    optimizer, first = ActorOptimizer(actor, 1e-2, rate, 1.0), loss(actor, seen, told).item()
    for k in range(20):
        step(optimizer, actor, seen, told, done=k / 40)
    assert loss(actor, seen, told).item() < 0.7 * first
    again = copy.deepcopy(actor)
    other = ActorOptimizer(again, 1e-2, rate, 1.0)
    other.restore(copy.deepcopy(optimizer.state()))
    for k in range(20, 25):
        step(optimizer, actor, seen, told, done=k / 40)
        step(other, again, seen, told, done=k / 40)
    for ours, theirs in zip(actor.parameters(), again.parameters(), strict=True):
        assert torch.equal(ours, theirs)


def test_the_norm_of_the_gradient_is_returned_and_the_gradient_clipped():
    actor, seen, told = learner()
    optimizer = ActorOptimizer(actor, 1e-2, 0.1, 1e-3)
    norm = optimizer.step(loss(actor, seen, told), 0.5)
    actor, seen, told = learner()
    loss(actor, seen, told).backward()
    whole = torch.cat([weight.grad.flatten() for weight in actor.parameters()]).norm()
    assert norm == pytest.approx(float(whole))
    assert optimizer.step(loss(actor, seen, told) * torch.nan, 0.5) == 0.0
