"""Base policies under the agent, commands on them, and rewards against them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.kernels.step import AXES
from motion_cueing.envs.task import (
    ActionOptions,
    DrivingSimulator,
    DrivingSimulatorVector,
    ObservationOptions,
    RewardOptions,
    RewardWeights,
)
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.agents import get_agent

from .tasks import SHORT

RESIDUAL = ActionOptions(mode="residual", repeat=4, ramp=True, axes=("carriage_x", "roll"), authority=0.05)
ZERO = np.zeros(2, dtype=np.float32)


class Lister:
    """A policy whose state is a list with an item for each environment: how often it was asked."""

    def predict(self, observation: Any, state: Any, episode_start: Any, deterministic: bool):
        counts = [0] * len(observation) if state is None else list(state)
        counts = [0 if begins else count for begins, count in zip(episode_start, counts, strict=True)]
        action = np.zeros((len(observation), 9))
        action[:, 0] = counts
        return action, [count + 1 for count in counts]


def commanded(env: DrivingSimulator) -> np.ndarray:
    return env.batch.commanded[0]


def motions(env: Any, actions: list[np.ndarray]) -> np.ndarray:
    """(k, ...) states after each action."""
    states = []
    for action in actions:
        env.step(action)
        states.append(env.batch.simulator.state.copy())
    return np.array(states)


def test_an_agent_under_an_agent_that_does_nothing_drives_as_it_does_alone():
    alone = get_agent("linear-washout")
    env = DrivingSimulator(action=RESIDUAL, base="linear-washout", episode=SHORT)
    own = DrivingSimulator(alone.task, episode=SHORT)
    env.reset(seed=5)
    observation, _ = own.reset(seed=5)
    for _ in range(10):
        env.step(ZERO)
        for _ in range(RESIDUAL.repeat // alone.task.action.repeat):
            action, _ = alone.predict(observation)
            observation, *_ = own.step(action)
        assert np.array_equal(env.batch.simulator.state, own.batch.simulator.state)


@pytest.mark.parametrize("name", ["classical", "adaptive-tuned", "optimal-washout-tuned", "mpc"])
def test_a_base_by_name_acts_as_the_policy_does_by_itself(name):
    """A batch under it moves as one that gets the policy's accelerations as its actions."""
    policy, n = make_policy(name, get_platform("paper")), 2
    env = DrivingSimulatorVector(n, action=replace(RESIDUAL, base=name), episode=SHORT)
    own = DrivingSimulatorVector(n, episode=SHORT)
    env.reset(seed=2)
    own.reset(seed=2)
    state, begins = None, np.ones(n, dtype=bool)
    for _ in range(3):
        env.step(np.tile(ZERO, (n, 1)))
        for _ in range(RESIDUAL.repeat):
            rows = own.batch.arrays.core.pull().copy()
            acceleration, state = policy.predict(rows, state, begins, deterministic=True)
            begins = np.zeros(n, dtype=bool)
            own.step(own.action_of(acceleration))
        for name_of in ("position", "rate"):
            ours, theirs = (e.batch.simulator.state["motion"][name_of] for e in (env, own))
            # Actions are float32.
            assert np.allclose(ours, theirs, rtol=1e-5, atol=1e-6)


def test_a_state_with_an_item_for_each_environment_goes_on_where_no_episode_begins():
    env = DrivingSimulatorVector(3, action=RESIDUAL, base=Lister(), episode=SHORT)
    env.reset(seed=0)
    env.step(np.tile(ZERO, (3, 1)))
    assert env.batch.commanded[:, 0].tolist() == [3.0, 3.0, 3.0]
    env.reset(options={"reset_mask": np.array([False, True, False])})
    env.step(np.tile(ZERO, (3, 1)))
    assert env.batch.commanded[:, 0].tolist() == [7.0, 3.0, 7.0]


@pytest.mark.parametrize("base", ["linear-washout", "classical"])
def test_a_snapshot_holds_the_base(base):
    env = DrivingSimulator(action=replace(RESIDUAL, base=base), episode=SHORT, reward={"against_base": True})
    env.reset(seed=3)
    rng = np.random.default_rng(0)
    actions = [rng.uniform(-1.0, 1.0, 2).astype(np.float32) for _ in range(6)]
    motions(env, actions[:3])
    held = env.get_state()
    first = [env.step(action) for action in actions[3:]]
    env.set_state(held)
    again = [env.step(action) for action in actions[3:]]
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one[0], other[0])
        assert one[1:] == other[1:]


def test_a_ramp_reaches_an_action_linearly_and_axes_without_an_entry_are_the_bases():
    env = DrivingSimulator(
        action=replace(RESIDUAL, bound=3.0, largest=(0.5,) * 9, authority=1.0),
        base=Lister(),
        episode=SHORT,
    )
    env.reset(seed=0)
    before, asked = np.zeros(2), 0
    for action in (np.array([1.0, -2.0]), np.array([-1.0, 2.5]), np.array([9.0, -9.0])):
        for k in range(RESIDUAL.repeat):
            if k == 0:
                env.batch.write(action[None])
                steps = env.batch.play()
            next(steps)
            share = (k + 1) / RESIDUAL.repeat
            now = np.clip(action, -3.0, 3.0)
            expected = np.zeros(9)
            expected[0] = asked + 0.5 * (before[0] + (now[0] - before[0]) * share)
            expected[AXES.index("roll")] = 0.5 * (before[1] + (now[1] - before[1]) * share)
            assert np.allclose(commanded(env), expected)
            asked += 1
        assert next(steps, None) is None
        before = np.clip(action, -3.0, 3.0)
    assert env.batch.clipped.tolist() == [2]


def test_a_reward_against_the_base_is_the_difference_of_two_machines():
    options: dict[str, Any] = {"action": replace(RESIDUAL, base="linear-washout"), "episode": SHORT}
    env = DrivingSimulator(**options, reward={"against_base": True})
    own, base = DrivingSimulator(**options), DrivingSimulator(**options)
    for one in (env, own, base):
        one.reset(seed=1)
    rng = np.random.default_rng(0)
    for k in range(10):
        action = rng.uniform(-1.0, 1.0, 2).astype(np.float32) * (k > 2)
        reward = env.step(action)[1]
        assert reward == pytest.approx(own.step(action)[1] - base.step(ZERO)[1], rel=1e-12, abs=1e-12)
        assert (reward == 0.0) == (k <= 2)


@pytest.mark.parametrize("scaling", ["physical", "typical"])
def test_an_observation_against_the_base_is_the_difference_of_two_machines(scaling):
    seen = ObservationOptions(scaling=scaling, frame="cab", simulator_cue="model")
    options: dict[str, Any] = {"action": replace(RESIDUAL, base="linear-washout"), "episode": SHORT}
    env = DrivingSimulator(**options, observation=replace(seen, against_base=True))
    own, base = (DrivingSimulator(**options, observation=seen) for _ in range(2))
    first, *_ = (one.reset(seed=1)[0] for one in (env, own, base))
    assert not first[-22:].any()
    rng = np.random.default_rng(0)
    for k in range(10):
        action = rng.uniform(-1.0, 1.0, 2).astype(np.float32) * (k > 2)
        whole, mine, theirs = env.step(action)[0], own.step(action)[0], base.step(ZERO)[0]
        assert np.array_equal(whole[:-22], mine)
        # The rows from the simulator's force to the rates of its angles, in 0.25 of what they usually are.
        difference = (mine - theirs)[6:28] * (4.0 if scaling == "typical" else 1.0)
        assert np.allclose(whole[-22:], np.clip(difference, -10.0, 10.0), rtol=1e-6)
        assert whole[-22:].any() == (k > 2)


def test_a_batch_shows_against_the_base_what_each_environment_does():
    task = load_task("cueing", episode={"library": 2}, observation={"against_base": True})
    several = DrivingSimulatorVector(3, task)
    single = [DrivingSimulator(task, drives=several.batch.drives) for _ in range(3)]
    rng = np.random.default_rng(1)
    seen = several.reset(seed=[4, 5, 6])[0]
    # The washout multiplies matrices of float32, for all environments at once or for one.
    close = partial(np.testing.assert_allclose, rtol=1e-4, atol=1e-4)
    close(seen, [env.reset(seed=4 + i)[0] for i, env in enumerate(single)])
    for _ in range(4):
        actions = rng.uniform(-1.0, 1.0, (3, 4)).astype(np.float32)
        seen = several.step(actions)[0]
        close(seen, [env.step(a)[0] for env, a in zip(single, actions, strict=True)])
        assert seen[:, -22:].any()


def test_rewards_are_divided_by_what_standing_still_costs_and_have_a_floor():
    weights = RewardWeights(cue_error=1.0, stroke=0.0, tilt_rate=0.0, limits=0.0, action_rate=0.0)
    plain = DrivingSimulator(episode=SHORT, reward=RewardOptions(weights=weights))
    shared = RewardOptions(weights=weights, standstill=0.5)
    divided = DrivingSimulator(episode=SHORT, reward=shared)
    floored = DrivingSimulator(episode=SHORT, reward=replace(shared, floor=0.01))
    scaled = DrivingSimulator(episode=SHORT, reward=replace(shared, scale=3.0))
    for one in (plain, divided, floored, scaled):
        one.reset(seed=4)
    drive = plain.batch.drives[plain.batch.simulator.drive_of[0]]
    force = (drive.specific_force + np.array([0.0, 0.0, 9.81])) / 0.6
    rate = drive.angular_velocity / np.radians(3.0)
    standing = np.mean(np.sum(force**2, axis=1) + np.sum(rate**2, axis=1))
    rng = np.random.default_rng(0)
    for _ in range(20):
        action = rng.uniform(-0.01, 0.01, 9)
        reward = plain.step(action)[1]
        assert divided.step(action)[1] == pytest.approx(reward / (1.0 + 0.5 * standing), rel=1e-3)
        assert scaled.step(action)[1] == pytest.approx(3.0 * reward / (1.0 + 0.5 * standing), rel=1e-3)
        assert floored.step(action)[1] == pytest.approx(max(reward / (1.0 + 0.5 * standing), -0.01), rel=1e-3)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"action": {"mode": "residual"}}, "needs base="),
        (
            {"action": {"mode": "residual", "base": "clasical"}},
            "Did you mean classical",
        ),
        ({"action": {"mode": "residual", "base": "mpc-preview"}}, "must know the drive"),
        ({"action": {"mode": "residual", "base": "linear-washout", "repeat": 3}}, "no multiple"),
        ({"action": {"mode": "residual", "base": "learned-ppo", "repeat": 5}}, "has a base itself"),
        ({"action": {"mode": "residual"}, "base": object()}, "no method predict"),
        ({"action": {"axes": ["carriage_x", "carriage_x"]}}, "axes must differ"),
        ({"action": {"axes": ["carriage_z"]}}, "unknown axis 'carriage_z'"),
        ({"action": {"bound": 0.0}}, "action.bound"),
        (
            {"action": {"mode": "gains", "base": "classical", "bound": 2.0}},
            "bound must be 1 with mode 'gains'",
        ),
        ({"action": {"base": "classical"}}, "base 'classical' is of no use with mode 'acceleration'"),
        ({"reward": {"against_base": True}}, "needs a base policy"),
        ({"observation": {"against_base": True}}, "needs a base policy"),
        (
            {"action": RESIDUAL, "base": "classical", "observation": {"against_base": True, "stack": 2}},
            "stack must be 1",
        ),
        ({"reward": {"floor": 0.0}}, "reward.floor"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(fields, message):
    with pytest.raises((ConfigurationError, UnknownNameError), match=message):
        DrivingSimulator(**fields, episode=SHORT)
