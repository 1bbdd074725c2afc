"""The washout whose parameters are set at every step, alone and under an agent."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines.washout import ClassicalWashout, load_washout
from motion_cueing.baselines.washout.classical.family import LowPass
from motion_cueing.baselines.washout.classical.policies import KNOBS, ScheduledWashout
from motion_cueing.envs.errors import ActionError, ConfigurationError, DataError
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.envs.task import ActionOptions, DrivingSimulator

from ...envs.task.tasks import drive

N = 4


def observations(steps: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    return 0.1 * rng.standard_normal((steps, N, OBSERVATION_SIZE))


def run(step, steps: int = 30) -> np.ndarray:
    """Actions over some observations; ``step(observation, state, begins)`` is a policy."""
    state, begins, actions = None, np.ones(N, dtype=bool), []
    for observation in observations(steps):
        action, state = step(observation, state, begins)
        begins = np.zeros(N, dtype=bool)
        actions.append(action)
    return np.array(actions)


def turned(knob: str, gain: float) -> np.ndarray:
    gains = np.zeros((N, len(KNOBS)))
    gains[:, list(KNOBS).index(knob)] = gain
    return gains


def test_with_neutral_gains_it_is_the_classical_washout_also_after_others_were_set():
    policy, classical = ScheduledWashout("est1"), ClassicalWashout("est1")
    expected = run(classical.predict)
    run(lambda o, s, b: policy.schedule(o, np.ones((N, len(KNOBS))), s, b))
    assert np.array_equal(run(lambda o, s, b: policy.schedule(o, turned("hps", 0.0), s, b)), expected)
    assert np.array_equal(run(policy.predict), expected)


@pytest.mark.parametrize("gain", [-1.0, 0.5, 1.0])
def test_gains_are_powers_of_the_span(gain):
    base = load_washout("est1")
    factor = 3.0**gain
    scaled = {
        "cue_scale": replace(base, force_scale=(factor,) * 3, rate_scale=(factor,) * 3),
        "lpc": replace(base, lpc=LowPass(base.lpc.frequency * factor)),
        "hps": replace(base, hps=tuple(replace(b, frequency=b.frequency * factor) for b in base.hps)),
        "hpi": replace(base, hpi=tuple(replace(b, frequency=b.frequency * factor) for b in base.hpi)),
        "hpr": replace(base, hpr=tuple(replace(b, frequency=b.frequency * factor) for b in base.hpr)),
        "tilt_low_pass": replace(base, tilt=replace(base.tilt, low_pass=LowPass(5.0 * factor))),
    }
    policy = ScheduledWashout(base, span=3.0)
    assert set(scaled) == set(policy.gain_names)
    for knob, parameters in scaled.items():
        actions = run(lambda o, s, b, knob=knob: policy.schedule(o, turned(knob, gain), s, b))
        assert np.allclose(actions, run(ClassicalWashout(parameters).predict), rtol=1e-12, atol=1e-12), knob


def test_each_environment_has_gains_of_its_own():
    policy = ScheduledWashout()
    gains = np.linspace(-1.0, 1.0, N)[:, None] * np.ones(len(KNOBS))
    actions = run(lambda o, s, b: policy.schedule(o, gains, s, b))
    for i in range(N):
        alone = run(lambda o, s, b, i=i: policy.schedule(o, np.tile(gains[i], (N, 1)), s, b))
        assert np.array_equal(alone[:, i], actions[:, i])


def test_agent_with_neutral_gains_moves_as_the_washout_does():
    states = []
    for mode, size, base in (("gains", len(KNOBS), ScheduledWashout()), ("residual", 9, ClassicalWashout())):
        env = DrivingSimulator(drives=[drive()], action=ActionOptions(mode=mode), base=base)
        env.reset(seed=0)
        assert env.action_space.shape == (size,)
        for _ in range(200):
            env.step(np.zeros(size, dtype=np.float32))
        states.append(env.batch.simulator.state["motion"]["position"].copy())
    assert np.abs(states[0]).max() > 0.05
    assert np.array_equal(*states)


def test_pickled_policy_is_the_same_and_wrong_arguments_are_named():
    policy = pickle.loads(pickle.dumps(ScheduledWashout("brk", span=1.5)))
    assert (policy.name, policy.span) == ("brk", 1.5)
    with pytest.raises(ConfigurationError, match="span must be above 1"):
        ScheduledWashout(span=1.0)
    with pytest.raises(ActionError, match=r"gains must be finite and of shape \(1, 6\)"):
        policy.schedule(observations(1)[0][:1], np.zeros((1, 5)))
    with pytest.raises(ActionError, match=r"gains are not numeric"):
        policy.schedule(observations(1)[0][:1], [["high"] * len(KNOBS)])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"observation": np.zeros(7)}, "observation has shape"),
        ({"observation": observations(1)[0][0]}, "observation has shape"),
        ({"state": np.zeros(N)}, "state is an array of float64"),
        ({"episode_start": np.zeros(N)}, "episode_start is an array of float64"),
    ],
)
def test_refused_arguments_leave_no_gains_behind(arguments, told):
    policy, seen = ScheduledWashout("brk"), observations(1)[0]
    expected, memory = policy.predict(seen)
    good = {"observation": seen, "state": memory, "episode_start": np.zeros(N, dtype=bool)}
    with pytest.raises(DataError, match=told):
        policy.schedule(gains=np.ones((N, len(KNOBS))), **(good | arguments))
    assert np.array_equal(policy.predict(seen)[0], expected)
