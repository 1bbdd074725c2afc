"""Backpropagation through time: the gradient of a rollout's cost, through simulator and policy, step by step.

Forward, :class:`Rollout` drives every environment with the actor. Backward, the adjoint of the simulator
(:class:`~....envs.task.unroll.TaskUnroll`) and that of the actor (:class:`NumpyBackward`) alternate, from the
last action to the first. The result is dC/da of each action; the caller leads it on to the weights.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray

from ....envs.task.unroll import TaskUnroll
from ...agents.network import ACTIVATIONS, Array
from ...networks import Actor, linear_layers

_ONE: Final = np.ones((), dtype=np.float32)
_TINY: Final = 1e-30


class NumpyBackward:
    """An actor's forward and backward pass in NumPy, with weights held fixed.

    For the few rows of a batch this is several times faster than to record an autograd graph for each step.
    """

    def __init__(self, actor: Actor) -> None:
        layers = linear_layers(actor.latent.hidden)
        self._weights = [layer.weight.detach().numpy() for layer in layers]
        self._biases = [layer.bias.detach().numpy() for layer in layers]
        self._mean, self._factor = actor.mean.numpy(), 1.0 / actor.deviation.numpy()
        reach = actor.reach.numpy()
        head, size = actor.head.weight.detach().numpy() * reach[:, None], len(self._mean)
        self._head_on_hidden, self._head_on_observation = head[:, :-size], head[:, -size:]
        self._head_bias = actor.head.bias.detach().numpy() * reach
        self._activation = ACTIVATIONS[actor.latent.activation]
        self._steps: list[tuple[list[Array], Array]] = []

    def act(self, observation: Array) -> Array:
        """(n, action_size) for observations (n, size); what :meth:`back` needs is kept."""
        normalized = hidden = (observation - self._mean) * self._factor
        before_activation = []
        for weight, bias in zip(self._weights, self._biases, strict=True):
            before_activation.append(hidden @ weight.T + bias)
            hidden = self._activation.function(before_activation[-1])
        out = normalized @ self._head_on_observation.T + self._head_bias
        if before_activation:
            out = out + hidden @ self._head_on_hidden.T
        action: Array = np.tanh(out)
        self._steps.append((before_activation, action))
        return action

    def back(self, gradient: Array) -> Array:
        """Gradient (n, size) with respect to the observation of the last step kept, which is dropped.

        Args:
            gradient: (n, action_size) with respect to its action.
        """
        before_activation, action = self._steps.pop()
        d_out = gradient * (_ONE - action * action)
        d_observation = d_out @ self._head_on_observation
        if before_activation:
            d_hidden = d_out @ self._head_on_hidden
            for weight, x in zip(reversed(self._weights), reversed(before_activation), strict=True):
                d_hidden = (d_hidden * self._activation.derivative(x)) @ weight
            d_observation = d_observation + d_hidden
        return np.asarray(d_observation * self._factor)


class Rollout:
    """A rollout of an actor in every environment, and its way back.

    Args:
        unroll: The simulators, at the start of a window.
        actor: The policy.

    Attributes:
        observations: (actions + 1, n, size) before each action, and after the last.
    """

    def __init__(self, unroll: TaskUnroll, actor: Actor) -> None:
        self._unroll, self._actor = unroll, NumpyBackward(actor)
        observations = []
        for k in range(unroll.actions):
            observations.append(unroll.observe(k))
            unroll.act(k, self._actor.act(observations[-1]))
        observations.append(unroll.observe(unroll.actions))
        self.observations = torch.from_numpy(np.stack(observations))

    def backward(self, weights: NDArray[np.float64], at_end: torch.Tensor | None = None) -> torch.Tensor:
        """Gradient of the weighted costs with respect to the actions; to be called once.

        Args:
            weights: (actions, n) of the costs.
            at_end: (n, size) gradient with respect to the observation after the last action.

        Returns:
            (actions, n, k), the effect by way of later actions included.
        """
        unroll = self._unroll
        unroll.weigh(weights)
        if at_end is not None:
            unroll.back_through_observe(unroll.actions, at_end.numpy())
        gradients = []
        for k in reversed(range(unroll.actions)):
            gradients.append(unroll.back_through_act(k).copy())
            unroll.back_through_observe(k, self._actor.back(gradients[-1]))
        return torch.from_numpy(np.stack(gradients[::-1]))


def clip_outliers(gradients: torch.Tensor, outlier: float) -> tuple[torch.Tensor, int]:
    """Clip the gradient of each environment by norm, relative to the median environment's.

    Where policy and limits chatter, a gradient grows with every step back and would dominate the sum.
    Gradients that are not finite become zero.

    Args:
        gradients: (actions, n, k) from :meth:`Rollout.backward`.
        outlier: Largest norm of an environment, as a multiple of the median.

    Returns:
        The gradients, and the number of environments whose gradient was not finite.
    """
    norms = gradients.flatten(2).pow(2).sum(dim=(0, 2)).sqrt()
    finite = torch.isfinite(norms)
    skipped = int((~finite).sum())
    if not finite.any():
        return torch.zeros_like(gradients), skipped
    largest = outlier * norms[finite].median()
    factors = torch.where(finite, torch.clamp(largest / norms.clamp_min(_TINY), max=1.0), 0.0)
    return torch.nan_to_num(gradients, 0.0, 0.0, 0.0) * factors[None, :, None], skipped
