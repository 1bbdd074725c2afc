"""Agents drive their machine with any bound on the jerk of its limits, and no other machine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import Braking, get_platform
from motion_cueing.train.agents import get_agent


def test_an_agent_takes_its_machine_with_another_bound_on_jerk():
    gentle = replace(get_platform("paper"), braking=Braking(150.0))
    fitted = get_agent("learned").for_platform(gentle)
    assert fitted.platform == gentle


def test_a_bound_on_jerk_makes_no_other_machine_its_own():
    with pytest.raises(ConfigurationError, match="was made for the motion base 'paper'"):
        get_agent("learned").for_platform(replace(get_platform("nads-1"), braking=Braking(150.0)))
