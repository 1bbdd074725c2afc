"""Whole tasks by name or file, and the environments that have them."""

from __future__ import annotations

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from motion_cueing.envs import ENVIRONMENTS
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.settings import save, to_dict
from motion_cueing.envs.task import DrivingSimulator, EpisodeOptions, TaskOptions
from motion_cueing.envs.task.options import load_task, task_names

SMALL = {"library": 2, "drive_duration": 3.0, "duration": 1.0}
LEARNING = ["motion_cueing/Cueing-v0", "motion_cueing/CueingPreview-v0"]


def test_a_task_comes_by_name_and_the_preview_is_what_sets_the_two_apart():
    assert task_names() == ["cueing", "cueing-preview"]
    plain, ahead = (to_dict(load_task(name)) for name in task_names())
    assert ahead["observation"].pop("preview") == 10
    assert plain["observation"].pop("preview") == 0
    assert plain == ahead
    assert load_task() == TaskOptions()


def test_fields_of_a_mapping_replace_those_it_names_alone():
    task = load_task("cueing", episode={"library": 3}, reward={"weights": {"stroke": 9.0}})
    known = load_task("cueing")
    assert task.episode == replace(known.episode, library=3)
    assert task.reward == replace(known.reward, weights=replace(known.reward.weights, stroke=9.0))
    assert load_task(known, episode=EpisodeOptions()).episode == EpisodeOptions()


def test_a_file_holds_a_task_or_changes_one(tmp_path):
    save(load_task("cueing"), tmp_path / "mine.yaml")
    assert load_task(tmp_path / "mine.yaml") == load_task("cueing")
    (tmp_path / "changed.yaml").write_text("preset: cueing-preview\naction: {repeat: 10}\n")
    changed, known = load_task(str(tmp_path / "changed.yaml")), load_task("cueing-preview")
    assert changed == replace(known, action=replace(known.action, repeat=10))
    env = DrivingSimulator(str(tmp_path / "changed.yaml"), episode=SMALL)
    assert env.task.action.repeat == 10


def test_what_is_no_task_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="unknown task 'cuing'"):
        load_task("cuing")
    with pytest.raises(DataError, match=r"none\.yaml"):
        load_task(tmp_path / "none.yaml")
    with pytest.raises(ConfigurationError, match=r"unknown field 'action\.repaet'"):
        load_task("cueing", action={"repaet": 2})


@pytest.mark.parametrize("name", LEARNING)
@pytest.mark.filterwarnings("error")
def test_the_learning_environments_pass_gymnasiums_checker_and_begin_at_a_reward_of_zero(name):
    env = gymnasium.make(name, episode=SMALL)
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=0)
    zero = np.zeros(env.action_space.shape, dtype=np.float32)
    assert all(env.step(zero)[1] == 0.0 for _ in range(5))
    assert np.isfinite(env.step(env.action_space.sample())[1])


def test_every_environment_has_a_native_batch():
    for name in ENVIRONMENTS:
        batch = gymnasium.make_vec(name, num_envs=2, episode=SMALL)
        observation, _ = batch.reset(seed=0)
        assert observation.shape == (2, *batch.single_observation_space.shape)


@pytest.mark.slow
def test_typical_scaling_shows_rows_of_about_unit_size():
    """Over what they usually are: fixed numbers, so the physical entries are known from them."""
    shown = DrivingSimulator("cueing-preview", episode={"library": 24})
    physical = DrivingSimulator(
        "cueing-preview", drives=shown.batch.drives, observation={"scaling": "physical"}
    )
    gains = shown.batch.layout.gains
    assert (physical.batch.layout.gains == 1.0).all()
    seen = []
    for seed in range(4):
        observations = [one.reset(seed=seed)[0] for one in (shown, physical)]
        for _ in range(240):
            assert np.allclose(observations[0], np.clip(observations[1] * gains, -10.0, 10.0), atol=1e-4)
            seen.append(observations[0])
            action = shown.action_space.sample()
            observations = [one.step(action)[0] for one in (shown, physical)]
    deviation = np.sqrt(np.mean(np.square(seen), axis=0))
    assert 0.5 < np.median(deviation) < 2.0
    assert np.mean((deviation > 0.1) & (deviation < 4.0)) > 0.9
