"""What a training measures: validation drives, means of the log."""

from __future__ import annotations

import time

import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.envs.errors import DataError
from motion_cueing.envs.task import DrivingSimulator
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.envs.task.options import load_task
from motion_cueing.evaluation import rollout
from motion_cueing.evaluation.metrics import measure
from motion_cueing.train.config import load_config
from motion_cueing.train.logs import Monitor, TrainingLog, read_log
from motion_cueing.train.validation import Validation, tilt_rate

from . import tiny

LONG = {"validation": {"duration": 20.0, "drives": 3}}


@pytest.fixture(scope="module")
def validation(tmp_path_factory) -> Validation:
    return Validation(tiny.config(tmp_path_factory.mktemp("config"), "ppo", **LONG))


@pytest.mark.parametrize("policy", [NoMotion(), ClassicalWashout()], ids=["no-motion", "classical"])
def test_scores_are_those_of_an_evaluation(policy, validation):
    measured = [measure(rollout(policy, drive)) for drive in validation._batch.drives]
    score = validation.score_policy(policy)
    j = np.mean([one.cue_error for one in measured])
    assert j > 0.5
    assert score.cue_error == pytest.approx(j, rel=0.01)
    assert score.perceived_error == pytest.approx(
        np.mean([one.perceived_cue_error for one in measured]), rel=0.01
    )
    peak = max(one.tilt_rate_peak for one in measured)
    assert score.tilt_rate_peak == pytest.approx(peak, rel=0.02, abs=1e-4)


def test_scores_are_means_over_a_loop_of_single_environments(validation):
    def act(observation):
        return 0.05 * np.tanh(np.atleast_2d(observation)[:, :9])

    rewards, terms = [], []
    for drive in validation._batch.drives:
        env = DrivingSimulator(validation.task, drives=[drive])
        seen, _ = env.reset(seed=0)
        done = False
        while not done:
            seen, reward, terminated, truncated, info = env.step(act(seen)[0].astype(np.float32))
            rewards.append(reward)
            terms.append([info[name] for name in TERMS])
            done = terminated or truncated
    score = validation.score(act)
    assert score.reward == pytest.approx(np.mean(rewards), rel=1e-6)
    assert score.limited == score.terms["limits"]
    assert [score.terms[name] for name in TERMS] == pytest.approx(np.mean(terms, axis=0), rel=1e-6)
    assert score == validation.score(act)


def test_travel_and_ends_are_those_of_the_machine(validation):
    def act(observation):
        action = np.zeros((len(observation), 9), dtype=np.float32)
        action[:, 0] = 0.3
        return action

    used, ends, by_drive = [], [], []
    for drive in validation._batch.drives:
        env = DrivingSimulator(validation.task, drives=[drive])
        seen, _ = env.reset(seed=0)
        carriage, done, errors = env.batch.platform.carriage, False, []
        used.append(0.0)
        while not done:
            seen, _, terminated, truncated, info = env.step(act(seen[None])[0])
            state, done = env.batch.simulator.state[0], terminated or truncated
            used[-1] = max(used[-1], state["motion"]["position"][0] / carriage.travel_x[1])
            ends.append(any((int(state["limits"]) >> 4 * k) & 1 for k in range(9)))
            errors.append(info["cue_error"])
        by_drive.append(np.mean(errors))
    score = validation.score(act)
    assert score.carriage_travel == pytest.approx(np.mean(used), rel=1e-6)
    assert score.leg_travel < 1e-6
    # It stops at the end of its travel.
    assert 0.9 < score.carriage_travel <= 1.0 + 1e-9
    assert score.at_ends == pytest.approx(np.mean(ends))
    assert 0.01 < score.at_ends < 1.0
    assert score.by_drive == pytest.approx(by_drive, rel=1e-6)
    assert np.mean(score.by_drive) == pytest.approx(score.cue_error)


def test_the_cost_of_noise_is_what_it_adds_to_j(validation):
    def still(observation):
        return np.zeros((len(observation), 9))

    def loud(observation):
        return np.full((len(observation), 9), 0.02)

    score = validation.score(still)
    assert score.noise is None
    assert "validation/noise_cost" not in score.scalars()
    same, other = validation.with_noise(score, still), validation.with_noise(score, loud)
    assert same.noise == 0.0
    assert other.noise == pytest.approx(validation.score(loud).cue_error - score.cue_error)
    told = other.scalars()
    assert told["validation/noisy_J"] - told["validation/J"] == pytest.approx(told["validation/noise_cost"])


def test_the_base_alone_and_the_washout_are_measured_where_rewards_are_against_the_base(tmp_path):
    task = load_task("cueing", episode={"library": 2, "drive_duration": 6.0, "duration": 1.0})
    config = load_config("ppo", task=task, validation={"drives": 2, "duration": 5.0})
    validation = Validation(config)
    alone = validation.score_base()
    assert alone.reward == pytest.approx(0.0, abs=1e-5)
    assert 0.0 < alone.cue_error < validation.score_policy(NoMotion()).cue_error


def test_a_drive_that_fails_counts_until_then(tmp_path):
    task = {"episode": {"terminate_on_failure": True}, "action": {"mode": "acceleration"}}
    failing = Validation(tiny.config(tmp_path, "ppo", task=task, **LONG))
    # Validation always drives to the end.
    assert not failing.task.episode.terminate_on_failure
    score = failing.score(lambda seen: np.ones((len(seen), 9)))
    assert score.terms["failure"] == 0.0
    assert score.limited > 0.05


def test_tilt_rate_is_what_goes_beyond_the_cars_own():
    kind = np.dtype([("reference_cue", [("rate", "f8", 3)]), ("simulator_cue", [("rate", "f8", 3)])])
    state = np.zeros(4, dtype=kind)
    state["reference_cue"]["rate"][:, 0] = [0.1, 0.1, -0.1, 0.0]
    state["simulator_cue"]["rate"][:, 0] = [0.05, 0.3, 0.2, 0.0]
    state["simulator_cue"]["rate"][:, 1] = [0.0, 0.0, 0.0, -0.4]
    state["simulator_cue"]["rate"][:, 2] = 9.0
    assert tilt_rate(state) == pytest.approx([0.0, 0.2, 0.2, 0.4])


def test_the_monitor_tells_means_once():
    monitor, terms = Monitor(), np.arange(2 * len(TERMS), dtype=float).reshape(2, -1)
    monitor.step(np.array([1.0, 3.0]), terms, [{}, {"episode": {"r": 4.0, "l": 10}}])
    monitor.step(np.array([0.0, 0.0]), 3.0 * terms)
    found = monitor.take()
    assert found["rollout/reward"] == 1.0
    assert [found[f"terms/{name}"] for name in TERMS] == (2.0 * terms.mean(axis=0)).tolist()
    assert (found["rollout/episode_return"], found["rollout/episode_steps"]) == (4.0, 10.0)
    assert monitor.take() == {}


def test_a_monitor_goes_on_from_a_state():
    one, other = Monitor(), Monitor()
    one.step(np.array([1.0]), np.ones((1, len(TERMS))))
    other.restore(one.state())
    for monitor in (one, other):
        monitor.step(np.array([5.0]), np.ones((1, len(TERMS))))
    assert one.take() == other.take()


def events(folder) -> dict[str, list[tuple[int, float]]]:
    found = EventAccumulator(str(folder / "tensorboard"))
    found.Reload()
    return {
        tag: [(event.step, event.value) for event in found.Scalars(tag)] for tag in found.Tags()["scalars"]
    }


def test_the_log_is_a_table_and_tensorboards_events(tmp_path):
    log = TrainingLog(tmp_path)
    log.write(10, {"a": 1.5})
    log.write(20, {"a": 2.5})
    log.write(20, {"b/c": -1.0})
    log.write(30, {})
    log.close()
    assert (tmp_path / "log.csv").read_text() == "steps,a,b/c\n10,1.5,\n20,2.5,-1\n"
    assert read_log(tmp_path) == [{"steps": 10.0, "a": 1.5}, {"steps": 20.0, "a": 2.5, "b/c": -1.0}]
    assert events(tmp_path) == {"a": [(10, 1.5), (20, 2.5)], "b/c": [(20, -1.0)]}


def test_what_came_after_a_checkpoint_is_dropped(tmp_path, monkeypatch):
    first = TrainingLog(tmp_path)
    for steps in (10, 20, 30):
        first.write(steps, {"a": float(steps)})
    first.close()
    # TensorBoard orders event files by names with whole seconds: a training goes on at least one later.
    began = time.time
    monkeypatch.setattr(time, "time", lambda: began() + 10.0)
    second = TrainingLog(tmp_path, 20)
    second.write(25, {"a": 7.0})
    second.close()
    assert [row["steps"] for row in read_log(tmp_path)] == [10.0, 20.0, 25.0]
    assert events(tmp_path)["a"] == [(10, 10.0), (20, 20.0), (25, 7.0)]


@pytest.mark.parametrize("text", ["steps,a\n1,x\n", "a\n1\n", "steps\n1,2\n"])
def test_a_broken_log_is_refused(text, tmp_path):
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(DataError, match="not the log of a training"):
        read_log(tmp_path)
