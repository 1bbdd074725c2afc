"""Policies on machines that they were not made for, as studies of machines need them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..baselines.families import make_washout
from ..envs.platform import Platform
from .drivers import TaskPolicy
from .policies import find_agent, is_agent, make_policy
from .rollout import AnyPolicy


def policy_on(name: str, platform: Platform) -> AnyPolicy:
    """A policy by name or file on any machine.

    An agent is forced onto the machine, whatever it was trained on; what is not there does not answer.
    A washout on a machine without turntable yaws the cab with its hexapod (k_T = 0), as the paper's EST3.
    Any other policy is made for the machine.

    Args:
        name: Of the policy, or its file.
        platform: The machine.

    Raises:
        MotionCueingError: there is no such policy, or it cannot be made for the machine.
    """
    if is_agent(name):
        return find_agent(name).on(platform)
    policy: Any = make_policy(name, platform)
    parameters: Any = getattr(policy, "parameters", None)
    if platform.turntable is None and getattr(parameters, "turntable_share", 0.0) > 0.0:
        return make_washout(replace(parameters, turntable_share=0.0), platform.cab)
    return policy  # type: ignore[no-any-return]


def moved_to(policy: AnyPolicy, platform: Platform) -> AnyPolicy:
    """The policy of a machine, to be driven on another one that it knows nothing of.

    Args:
        policy: Made for a machine with the same subsystems.
        platform: The one it is driven on.
    """
    on = getattr(policy, "on", None)
    return on(platform) if isinstance(policy, TaskPolicy) and callable(on) else policy
