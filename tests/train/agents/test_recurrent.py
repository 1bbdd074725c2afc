"""Networks with a memory: against the LSTM's definition in float64, and as agents."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.task import (
    ActionOptions,
    DrivingSimulator,
    DrivingSimulatorVector,
    ObservationOptions,
    TaskOptions,
)
from motion_cueing.evaluation import rollout
from motion_cueing.train.agents import Agent, Network, RecurrentNetwork
from motion_cueing.train.agents.export import ExportError, export_onnx
from motion_cueing.train.agents.network import LstmLayer

from ...envs.task.tasks import SHORT, drive
from . import agent, recurrent

STEPS, N, SIZE = 12, 4, 7


def exact(net: RecurrentNetwork, episode: np.ndarray) -> np.ndarray:
    """(k, outputs) actions for observations (k, size) of one episode, by the definition."""

    def logistic(x):
        return 1.0 / (1.0 + np.exp(-x))

    outputs = [np.zeros(layer.units) for layer in net.lstm]
    cells = [np.zeros(layer.units) for layer in net.lstm]
    actions = []
    for seen in np.asarray(episode, dtype=np.float64):
        x = np.clip((seen - net.mean) / np.sqrt(net.variance + 1e-8), -net.clip, net.clip)
        for k, layer in enumerate(net.lstm):
            i, f, g, o = np.split(layer.inputs @ x + layer.recurrent @ outputs[k] + layer.bias, 4)
            cells[k] = logistic(f) * cells[k] + logistic(i) * np.tanh(g)
            x = outputs[k] = logistic(o) * np.tanh(cells[k])
        hidden = np.tanh(net.head.weights[0] @ x + net.head.biases[0])
        actions.append(np.clip(net.head.weights[1] @ hidden + net.head.biases[1], -net.bound, net.bound))
    return np.array(actions)


def observations(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=2.0, size=(STEPS, N, SIZE)).astype(np.float32)


@pytest.mark.parametrize("units", [(6,), (6, 5)])
def test_it_computes_its_definition_in_episodes_that_begin_at_different_times(units):
    net, seen = recurrent(SIZE, units, outputs=3), observations()
    begins = np.zeros((STEPS, N), dtype=bool)
    begins[0], begins[5, 1], begins[7, 2] = True, True, True
    state, found = None, []
    for k in range(STEPS):
        action, state = net.step(seen[k], state, begins[k])
        found.append(action)
    assert state.shape == (N, net.memory)
    assert net.memory == 2 * sum(units)
    for column, first in enumerate((0, 5, 7, 0)):
        expected = exact(net, seen[first:, column])
        np.testing.assert_allclose(np.array(found)[first:, column], expected, atol=3e-6)
    assert np.std(found) > 0.05


def test_a_vector_and_a_batch_agree_and_acting_begins_anew():
    net, seen = recurrent(SIZE, outputs=3), observations()
    for _ in range(2):
        act, state = net.acting(), None
        for k in range(STEPS):
            alone, state = net.step(seen[k, 0], state, None)
            np.testing.assert_allclose(act(seen[k])[0], alone, atol=1e-6)


def test_a_state_stays_as_it_was_given():
    net, seen = recurrent(SIZE), observations()
    _, state = net.step(seen[0])
    held = state.copy()
    net.step(seen[1], state, np.array([True, False, False, False]))
    assert np.array_equal(state, held)


@pytest.mark.parametrize("state", [np.zeros((3, 22)), np.zeros((N, 21)), [0.0]])
def test_a_state_of_others_is_refused(state):
    with pytest.raises(DataError, match="give what the last call for these 4 observations returned"):
        recurrent(SIZE).step(observations()[0], state)


def test_what_does_not_fit_together_is_refused():
    net = recurrent(SIZE)
    first, second = net.lstm
    for change, message in (
        ({"lstm": ()}, "needs an LSTM layer"),
        ({"lstm": (second, first)}, "lstm 1 inputs has shape"),
        ({"lstm": (first,)}, "its head takes 5 inputs, expected 6"),
        ({"lstm": (first, second._replace(bias=np.zeros(7)))}, "lstm 1 bias has shape"),
        ({"lstm": (first, LstmLayer(*(np.full_like(x, np.nan) for x in second)))}, "is not finite"),
        ({"variance": None}, "mean and variance together"),
        ({"mean": np.zeros(3)}, "mean has shape"),
        ({"clip": 0.0}, "clip must be positive"),
        ({"head": replace(net.head, mean=np.zeros(5), variance=np.ones(5))}, "not normalized"),
    ):
        with pytest.raises(DataError, match=message):
            replace(net, **change)


@pytest.fixture
def one() -> Agent:
    """An agent with a memory."""
    plain = agent(TaskOptions(observation=ObservationOptions(preview=2)))
    return replace(plain, network=recurrent(plain.layout.size, clip=4.0))


def test_the_same_agent_comes_back_from_its_file(one, tmp_path):
    one.save(tmp_path / "one.safetensors")
    other = Agent.load(tmp_path / "one.safetensors")
    assert (other.task, other.record, other.network.clip) == (one.task, one.record, 4.0)
    seen, states = np.random.default_rng(0).normal(size=(5, 3, one.layout.size)), [None, None]
    for k in range(5):
        begins = np.array([k == 0, False, k == 3])
        actions = []
        for i, each in enumerate((one, other)):
            action, states[i] = each.predict(seen[k], states[i], begins)
            actions.append(action)
        assert np.array_equal(*actions)
    assert np.array_equal(*states)


def test_it_drives_with_its_memory_and_forgets_between_drives(one):
    again = [rollout(one, drive()) for _ in range(2)]
    assert np.array_equal(again[0].hexapod, again[1].hexapod)
    forgetful = replace(one, network=_Forgetful(*(getattr(one.network, name) for name in _FIELDS)))
    assert np.abs(rollout(forgetful, drive()).hexapod - again[0].hexapod).max() > 1e-4


_FIELDS = ("lstm", "head", "mean", "variance", "clip")


class _Forgetful(RecurrentNetwork):
    """The same layers without a memory."""

    def step(self, observation, state=None, begins=None):
        return super().step(observation)


def test_under_an_agent_that_does_nothing_it_drives_as_it_does_alone(one):
    residual = ActionOptions(mode="residual", repeat=4, axes=("roll",), authority=0.05)
    env = DrivingSimulator(action=residual, base=one, episode=SHORT)
    own = DrivingSimulator(one.task, episode=SHORT)
    for seed in (5, 6):
        env.reset(seed=seed)
        (observation, _), state, begins = own.reset(seed=seed), None, np.array([True])
        for _ in range(6):
            env.step(np.zeros(1, dtype=np.float32))
            for _ in range(4):
                action, state = one.predict(observation, state, begins)
                observation, begins = own.step(action)[0], np.array([False])
            assert np.array_equal(env.batch.simulator.state, own.batch.simulator.state)


def test_a_snapshot_holds_what_the_base_remembers(one):
    residual = ActionOptions(mode="residual", repeat=4, axes=("roll",), authority=0.05)
    env = DrivingSimulatorVector(2, action=residual, base=one, episode=SHORT)
    env.reset(seed=3)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (6, 2, 1)).astype(np.float32)
    for action in actions[:3]:
        env.step(action)
    held, ends = env.batch.snapshot(), []
    for _ in range(2):
        env.batch.restore(held)
        for action in actions[3:]:
            env.step(action)
        ends.append(env.batch.simulator.state.copy())
    assert np.array_equal(*ends)


def test_it_is_not_exported(one, tmp_path):
    with pytest.raises(ExportError, match=r"its network has a memory \(LSTM\)"):
        export_onnx(one, tmp_path / "a.onnx")
    assert not list(tmp_path.iterdir())


def test_a_multilayer_perceptron_passes_a_state_on():
    net = agent().network
    assert isinstance(net, Network)
    seen = np.zeros((2, net.size))
    action, state = net.step(seen, "anything", np.array([True, False]))
    assert state == "anything"
    assert np.array_equal(action, net(seen))
