"""A training that was stopped goes on as if it had not been."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.task.episode import platform_of
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.train.agents import Agent
from motion_cueing.train.logs import read_log
from motion_cueing.train.run import RunFolder, checkpoints_in, read_checkpoint, write_checkpoint
from motion_cueing.train.training import Training
from motion_cueing.train.validation import Validation
from motion_cueing.train.watch import References

from . import tiny
from .agents import RECORD, recurrent

pytestmark = pytest.mark.slow


def stop_at(steps: int):
    """What a training tells, and Ctrl-C from ``steps`` on."""
    holder: list[Training] = []

    def tell(status):
        if status.steps >= steps:
            holder[0]._interrupt.asked = True

    return holder, tell


def train_stopped(folder: RunFolder, *stops: int):
    """Train with a stop at each of ``stops``, then to the end."""
    for stop in stops:
        holder, tell = stop_at(stop)
        holder.append(Training(folder, tell))
        outcome = holder[0].train()
        assert outcome.interrupted
        assert stop <= outcome.status.steps < folder.config.steps
        assert checkpoints_in(folder.checkpoints)[-1].stem.endswith(str(outcome.status.steps))
        assert not folder.final_agent.exists()
        folder = RunFolder.open(folder.path)
    outcome = Training(folder).train()
    assert not outcome.interrupted
    return outcome


def same_networks(one, other) -> bool:
    arrays = [
        [*n.head.weights, *n.head.biases, *(x for layer in n.lstm for x in layer)]
        + ([] if n.mean is None else [n.mean, n.variance])
        for n in (Agent.load(one).network, Agent.load(other).network)
    ]
    return all(np.array_equal(x, y) for x, y in zip(*arrays, strict=True))


_SDE = {"use_sde": True, "train_freq": 8, "policy_kwargs": {"clip_mean": 0.0}}
_SCHEDULES = {"learning_rate": "lin_1e-3", "clip_range": "lin_0.2"}
_NOISE = {"noise_type": "ornstein-uhlenbeck"}
_NOT_NORMALIZED = {"observation": False, "reward": False}
CASES = {
    "ppo, schedules": ("ppo", {"hyperparameters": _SCHEDULES}),
    "ppo, a critic of groups, annealed noise, an adaptive learning rate": (
        "ppo",
        {
            "group": 2,
            "normalize": _NOT_NORMALIZED,
            "hyperparameters": {
                "policy": "GroupCriticPolicy",
                "critic_first": 1,
                "annealed_std": [0.5, 0.1],
                "adaptive_kl": 0.02,
            },
        },
    ),
    "ppo, residual": ("ppo", {"task": {"action": {"mode": "residual"}}}),
    "ppo, gains, state-dependent exploration": (
        "ppo",
        {"task": {"action": {"mode": "gains", "bound": 1.0}}, "hyperparameters": {"use_sde": True}},
    ),
    "sac, full replay buffer, returns of several steps": (
        "sac",
        {"hyperparameters": {"buffer_size": 60, "n_steps": 3}},
    ),
    "sac, state-dependent exploration": ("sac", {"hyperparameters": _SDE}),
    "td3, noise that remembers, nothing normalized": (
        "td3",
        {"hyperparameters": _NOISE, "normalize": _NOT_NORMALIZED},
    ),
    "trpo, schedules": ("trpo", {"hyperparameters": {"learning_rate": "lin_1e-3"}}),
    "recurrent-ppo, two layers": (
        "recurrent-ppo",
        {"hyperparameters": {"policy_kwargs": {"n_lstm_layers": 2}, "learning_rate": "lin_1e-3"}},
    ),
    "crossq, batch renormalization after its warm-up": (
        "crossq",
        {"hyperparameters": {"policy_kwargs": {"renorm_warmup_steps": 5}, "policy_delay": 2}},
    ),
    "tqc, several steps": ("tqc", {"hyperparameters": {"train_freq": 3, "gradient_steps": 2}}),
}


@pytest.mark.parametrize("name", CASES)
def test_it_goes_on_bit_for_bit(name, tmp_path):
    algo, fields = CASES[name]
    config = tiny.config(tmp_path, algo, **fields)
    whole, broken = (RunFolder.create(tmp_path / part, config) for part in ("whole", "broken"))
    Training(whole).train()
    train_stopped(broken, 1, 190)
    assert same_networks(whole.final_agent, broken.final_agent)
    assert same_networks(whole.best_agent, broken.best_agent)
    logs = [(folder.path / "log.csv").read_text() for folder in (whole, broken)]
    assert logs[0] == logs[1]
    agent = Agent.load(broken.final_agent)
    assert agent.record.steps >= config.steps
    assert agent.task == config.task
    assert len(json.loads((broken.path / "run.json").read_text())["sessions"]) == 3


def test_other_seeds_give_other_agents(tmp_path):
    folders = [RunFolder.create(tmp_path / str(s), tiny.config(tmp_path, "ppo", seed=s)) for s in (0, 1)]
    for folder in folders:
        Training(folder).train()
    assert not same_networks(folders[0].final_agent, folders[1].final_agent)


def test_a_training_that_is_complete_stays_as_it_is_and_can_be_lengthened(tmp_path):
    folder = RunFolder.create(tmp_path / "run", tiny.config(tmp_path, "ppo"))
    Training(folder).train()
    before = {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()}
    again = Training(RunFolder.open(folder.path)).train()
    assert not again.interrupted
    assert {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()} == before
    longer = RunFolder.open(folder.path)
    longer.extend(400)
    assert Training(longer).train().status.steps >= 400
    assert Agent.load(folder.final_agent).record.steps >= 400
    assert RunFolder.open(folder.path).config.steps == 400


@pytest.mark.parametrize("algo", ["ppo", "recurrent-ppo", "td3"])
def test_a_training_begins_with_the_network_of_another(algo, tmp_path):
    first = RunFolder.create(tmp_path / "first", tiny.config(tmp_path, algo))
    Training(first).train()
    config = tiny.config(tmp_path, algo, initial=str(first.final_agent), seed=8)
    second = RunFolder.create(tmp_path / "second", config)
    network = Agent.load(first.final_agent).network
    seen = np.random.default_rng(0).normal(size=(50, network.size)).astype(np.float32)
    training = Training(second)
    assert np.array_equal(training.learner.network().step(seen)[0], network.step(seen)[0])
    training.train()
    assert not np.array_equal(Agent.load(second.final_agent).predict(seen)[0], network.step(seen)[0])
    origin = Agent.load(first.final_agent).record
    assert Agent.load(second.final_agent).record.initial == origin
    # What is resumed no longer needs the agent it began with.
    first.final_agent.unlink()
    longer = RunFolder.open(second.path)
    longer.extend(400)
    assert not Training(longer).train().interrupted
    assert Agent.load(second.final_agent).record.initial == origin


def test_an_algorithm_without_memory_does_not_begin_with_one(tmp_path):
    task = tiny.config(tmp_path, "apg", normalize=_NOT_NORMALIZED).task
    size = layout_of(task.observation, task.action.mode, 9).size
    Agent("lstm", task, recurrent(size), RECORD).save(tmp_path / "lstm.safetensors")
    config = tiny.config(tmp_path, "apg", initial=str(tmp_path / "lstm.safetensors"))
    with pytest.raises(DataError, match="initial: apg trains no network with a memory, which the agent has"):
        Training(RunFolder.create(tmp_path / "run", config))


def test_a_person_sees_references_noise_and_warnings_once_and_no_more_when_it_goes_on(tmp_path):
    task = {"action": {"mode": "residual", "repeat": 1}}
    config = tiny.config(tmp_path, "ppo", task=task, validation={"every": 64}, group=2)
    folder = RunFolder.create(tmp_path / "run", config)
    seen = []

    def tell(status):
        seen.append((status.steps, status.news, list(status.warnings), status.references))
        if status.steps >= 128:
            training._interrupt.asked = True

    training = Training(folder, tell)
    assert training.train().interrupted
    # A trace of 0.2 s: said before anything is measured.
    steps, news, (sentence,), references = seen[0]
    assert (steps, news, references) == (0, False, None)
    assert "s, but its travel costs after" in sentence
    assert not any(sentence in warnings for _, _, warnings, _ in seen[1:])
    validation = Validation(config)
    washout = validation.score_policy(ClassicalWashout("classical", platform_of(config.task).cab))
    assert seen[-1][3] == References(
        washout=washout.cue_error,
        standing=validation.score_policy(NoMotion()).cue_error,
        start=validation.score(lambda o: np.zeros((len(o), 9))).cue_error,
    )
    first = read_log(folder.path)[0]
    assert first["start/J"] == pytest.approx(seen[-1][3].start, rel=1e-8)
    assert {
        "classical/J",
        "no-motion/J",
        "validation/noise_cost",
        "validation/carriage_travel",
    } <= first.keys()
    told = seen.copy()
    status = Training(RunFolder.open(folder.path), tell).train().status
    assert status.references == told[-1][3]
    assert not any(sentence in warnings for _, _, warnings, _ in seen[len(told) :])
    assert {"train/entropy", "train/approx_kl", "rollout/drive_share"} <= read_log(folder.path)[-1].keys()
    assert 0.0 <= status.drive_share <= 1.0
    assert status.entropy is not None
    assert status.kl is not None


def test_without_a_base_it_begins_with_its_network(tmp_path):
    config = tiny.config(tmp_path, "td3", normalize=_NOT_NORMALIZED)
    training = Training(RunFolder.create(tmp_path / "run", config))
    network = training.learner.network()
    start = training.train().status.references.start
    assert start == training.validation.score(network).cue_error


def test_a_checkpoint_of_before_has_the_washout_alone(finished):
    state = read_checkpoint(checkpoints_in(finished.checkpoints)[-1])
    washout = state.pop("references")["washout"]
    del state["watch"]
    for name in ("carriage_travel", "leg_travel", "at_ends", "by_drive", "noise"):
        del state["score"][name]
    training = Training(RunFolder.open(finished.path))
    training._go_on({**state, "reference": washout})
    assert training.status.references == References(washout=washout)
    assert training.status.reference == washout


def test_only_the_latest_checkpoints_are_kept(tmp_path):
    config = tiny.config(tmp_path, "ppo", checkpoints={"every": 64, "keep": 3})
    folder = RunFolder.create(tmp_path / "run", config)
    Training(folder).train()
    kept = [int(path.stem.split("-")[1]) for path in checkpoints_in(folder.checkpoints)]
    assert kept == [192, 256, 320]


def test_states_come_back_as_they_were(tmp_path):
    kind = np.dtype([("a", "<f8", (2,)), ("b", "u1")], align=True)
    state = {
        "struct": np.array([((1.0, 2.0), 3)], dtype=kind),
        "scalar": np.float64(0.1),
        "none": None,
        "list": [1, "two", np.arange(3, dtype=np.int32)],
        "whole": np.array(2.5),
    }
    write_checkpoint(tmp_path / "step-1.checkpoint", state)
    back = read_checkpoint(tmp_path / "step-1.checkpoint")
    assert back["struct"].dtype == kind
    assert np.array_equal(back["struct"], state["struct"])
    assert (back["scalar"], back["none"], back["list"][:2]) == (0.1, None, [1, "two"])
    assert back["list"][2].dtype == np.int32
    assert back["whole"].shape == ()


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> RunFolder:
    """A training with two checkpoints."""
    path = tmp_path_factory.mktemp("finished")
    folder = RunFolder.create(path / "run", tiny.config(path, "ppo"))
    Training(folder).train()
    assert len(checkpoints_in(folder.checkpoints)) == 2
    return folder


def damaged(data: bytes, how: str) -> bytes:
    middle = len(data) // 2
    return {
        "a bit": data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :],
        "cut off": data[:middle],
        "empty": b"",
        "something else": b"PK\x03\x04" + data,
    }[how]


@pytest.mark.parametrize("how", ["a bit", "cut off", "empty", "something else"])
def test_a_damaged_checkpoint_is_refused_and_the_earlier_one_named(finished, how):
    earlier, last = checkpoints_in(finished.checkpoints)
    whole = last.read_bytes()
    try:
        last.write_bytes(damaged(whole, how))
        with pytest.raises(DataError, match=rf"{last.name}: .*delete it to go on from {earlier.name}"):
            Training(RunFolder.open(finished.path))
    finally:
        last.write_bytes(whole)


def test_a_checkpoint_of_another_training_is_refused(finished, tmp_path):
    config = tiny.config(tmp_path, "ppo", hyperparameters={"policy_kwargs": {"net_arch": [9]}})
    other = RunFolder.create(tmp_path / "other", config)
    other.checkpoints.mkdir(parents=True)
    last = checkpoints_in(finished.checkpoints)[-1]
    (other.checkpoints / last.name).write_bytes(last.read_bytes())
    with pytest.raises(DataError, match="of another configuration or version"):
        Training(other)


def test_a_folder_with_something_in_it_is_left_alone(finished, tmp_path):
    with pytest.raises(ConfigurationError, match="there is something already; name a new"):
        RunFolder.create(finished.path, finished.config)
    (tmp_path / "x").write_text("mine")
    with pytest.raises(ConfigurationError, match="name a new folder"):
        RunFolder.create(tmp_path, finished.config)
    with pytest.raises(DataError, match=r"no training was begun there \(config.yaml is missing\)"):
        RunFolder.open(tmp_path)
