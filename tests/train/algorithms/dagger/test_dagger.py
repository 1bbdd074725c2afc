"""Imitation of a controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.task import ActionOptions, EpisodeOptions, TaskOptions
from motion_cueing.envs.task.batch import Batch
from motion_cueing.evaluation import rollout
from motion_cueing.train.algorithms.apg.apg import ApgLearner
from motion_cueing.train.algorithms.dagger.dagger import DaggerLearner, Teacher, rest_of
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.registry import StopTraining

pytestmark = pytest.mark.slow

SMALL = {
    "n_envs": 4,
    "steps": 4 * 20 * 6,
    "task": {
        "observation": {"memory": [1.0], "frame": "cab"},
        "action": {"frame": "cab", "repeat": 5},
        "episode": {"library": 2, "drive_duration": 6.0, "duration": 1.0, "random_start": True},
    },
    "hyperparameters": {"net_arch": [16], "updates": 50, "learning_rate": 0.01, "teacher": "classical"},
}
EVERYWHERE = np.ones(2, dtype=bool)


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    path = tmp_path_factory.mktemp("config") / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    return load_config("dagger", path)


def nothing() -> None:
    """A boundary where nothing is due."""


def episodes(frame: str, **episode: object) -> Batch:
    """Two episodes of a random drive."""
    options = TaskOptions(
        action=ActionOptions(frame=frame),
        episode=EpisodeOptions(library=2, drive_duration=6.0, **episode),
    )
    batch = Batch(2, options)
    batch.seed(EVERYWHERE, [0, 1])
    return batch


@pytest.mark.parametrize("frame", ["machine", "cab"])
def test_a_teacher_that_drives_drives_as_its_policy_does(frame):
    """Through the actions of the task, in either frame, the machine goes where the policy alone takes it."""
    batch = episodes(frame)
    batch.begin(EVERYWHERE, np.array([0, 1]))
    batch.observe(EVERYWHERE)
    teacher = Teacher("classical", batch)
    teacher.begin()
    positions = []
    for _ in range(400):
        batch.write(teacher(batch.arrays.core.pull()))
        batch.step()
        positions.append(np.array(batch.simulator.state["motion"]["position"]))
    for i, drive in enumerate(batch.drives):
        record = rollout(ClassicalWashout(), drive)
        expected = np.column_stack([record.carriage[1:401], record.turntable[1:401]])
        np.testing.assert_allclose(np.array(positions)[:, i, [0, 1, 8]], expected, atol=2e-5)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_actions_in_the_cabs_frame_ask_for_the_teachers_accelerations(seed):
    """The inverse of what the task makes of an action, wherever the turntable and the hexapod stand."""
    batch = episodes("cab", duration=2.0, random_start=True, platform_offset=0.3)
    batch.begin(EVERYWHERE)
    batch.observe(EVERYWHERE)
    rng = np.random.default_rng(seed)
    batch.write(0.2 * rng.normal(size=(2, 9)))
    for _ in range(20):
        batch.step()
    teacher = Teacher("no-motion", batch)
    wanted = 0.5 * batch.scale * rng.uniform(-1.0, 1.0, size=(2, 9))
    batch.write(teacher._as_actions(wanted))
    batch.step()
    np.testing.assert_allclose(batch.commanded, wanted, atol=1e-5)


def test_one_that_is_told_the_drive_is_told_what_is_left_of_it():
    """Seen from a controller that knows the drive, an episode within it is a drive of its own."""
    batch = episodes("machine", duration=2.0, random_start=True)
    batch.begin(EVERYWHERE)
    batch.observe(EVERYWHERE)
    teacher = Teacher("mpc-preview", batch)
    teacher.begin()
    answers = teacher(batch.arrays.core.pull())
    samples = batch.simulator.state["sample"]
    assert samples.max() > 0
    for i, drive in enumerate(batch.drives[k] for k in batch.simulator.constants[4].numpy()):
        rest = rest_of(drive, int(samples[i]))
        assert len(rest) == len(drive) - samples[i]
        np.testing.assert_array_equal(rest.angular_acceleration, drive.angular_acceleration[samples[i] :])
        record = rollout(teacher._made, rest)
        first = np.array(record.action[1]) / batch.scale
        np.testing.assert_allclose(answers[i], np.clip(first, -1.0, 1.0), atol=1e-5)


def test_the_pupil_learns_what_the_teacher_does(config):
    learner = DaggerLearner(replace(config, steps=2 * config.steps))
    learner._drive()
    seen, told = learner._observations[0], learner._labels[0]
    with torch.no_grad():
        before = float((learner.actor(seen) - told).pow(2).mean())
    learner.learn(nothing)
    with torch.no_grad():
        after = float((learner.actor(seen) - told).pow(2).mean())
    assert after < 0.4 * before
    assert learner.scalars()["train/samples"] == 2 * config.steps + len(seen)


def test_the_teacher_drives_less_and_less(config):
    learner = DaggerLearner(config)
    shares = []

    def note() -> None:
        shares.append(learner.scalars().get("rollout/teacher_share"))

    learner.learn(note)
    assert shares[1] == 1.0
    assert shares[2] == 0.5
    assert shares[3:] == [0.0] * 3


def test_one_that_is_resumed_ends_with_the_same_bits(config):
    whole = DaggerLearner(config)
    whole.learn(nothing)

    first = DaggerLearner(config)

    def stop() -> None:
        if first.steps >= config.steps // 2:
            raise StopTraining

    with pytest.raises(StopTraining):
        first.learn(stop)
    second = DaggerLearner(config)
    second.restore(first.state())
    second.learn(nothing)
    for a, b in zip(whole.network().weights, second.network().weights, strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_gradient_goes_on_from_its_network(config):
    learner = DaggerLearner(config)
    given = {"net_arch": [16]}
    other = ApgLearner(replace(config, algo="apg", hyperparameters=given))
    other.actor.load(learner.network())
    observation = torch.randn(5, learner.batch.layout.size)
    with torch.no_grad():
        torch.testing.assert_close(other.actor(observation), learner.actor(observation))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"hyperparameters": {"teacher_share": 2.0}}, "teacher_share"),
        ({"normalize": {"observation": True}}, "normalize must be off"),
        ({"task": {"episode": {"duration": None, "random_start": False}}}, r"task\.episode\.duration"),
        ({"task": {"action": {"mode": "velocity"}}}, r"task\.action\.mode"),
    ],
)
def test_what_it_cannot_do_is_refused(tmp_path, fields, message):
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(fields), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=message):
        DaggerLearner(load_config("dagger", path))


def test_an_unknown_teacher_is_refused(config):
    with pytest.raises(UnknownNameError, match="nobody"):
        DaggerLearner(replace(config, hyperparameters={"teacher": "nobody"}))
