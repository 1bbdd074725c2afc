"""The agents that come with the package do what the README says of them."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.car import get_maneuver, maneuver_names
from motion_cueing.evaluation import Trajectory, measure, rollout
from motion_cueing.train.agent import Agent, agent_names, get_agent

TUNED = "classical-tuned"


@pytest.fixture(scope="module")
def washout() -> dict[str, Trajectory]:
    policy = ClassicalWashout(TUNED)
    return {name: rollout(policy, get_maneuver(name).drive()) for name in maneuver_names()}


@pytest.fixture(scope="module", params=agent_names())
def agent(request) -> Agent:
    return get_agent(request.param)


@pytest.fixture(scope="module")
def driven(agent) -> dict[str, Trajectory]:
    return {name: rollout(agent, get_maneuver(name).drive()) for name in maneuver_names()}


def test_there_is_one():
    assert agent_names()


def test_it_is_better_than_the_tuned_washout_on_every_maneuver_and_halves_its_error(driven, washout):
    found = {name: (measure(driven[name]), measure(washout[name])) for name in driven}
    for name, (ours, theirs) in found.items():
        assert ours.cue_error < theirs.cue_error, name
    ours, theirs = np.mean([[a.cue_error, b.cue_error] for a, b in found.values()], axis=0)
    assert ours < 0.5 * theirs


def test_no_limit_of_the_machine_is_exceeded(driven):
    for name, trajectory in driven.items():
        limits = trajectory.limits
        positions = np.column_stack([trajectory.carriage, trajectory.legs, trajectory.turntable])
        rates = np.column_stack([trajectory.carriage_rate, trajectory.legs_rate, trajectory.turntable_rate])
        assert np.all(positions <= limits.position_max + 1e-9), name
        assert np.all(positions >= limits.position_min - 1e-9), name
        assert np.all(np.abs(rates) <= limits.velocity + 1e-9), name


def test_its_record_says_how_it_was_made(agent):
    record = agent.record
    assert record.command.startswith("motion-cueing train --algo ")
    assert record.steps > 0
    assert record.wall_time < 2.0 * 3600.0
    assert record.hardware
    assert record.validation is not None
    assert {"numpy", "torch", "warp-lang", "motion-cueing-gym"} <= record.versions.keys()
