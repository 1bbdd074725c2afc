"""Training with randomized platforms, and the agents whose observation describes theirs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform, platform_names
from motion_cueing.envs.task import TaskOptions
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.episode import machines_of
from motion_cueing.envs.task.kernels.action import acceleration_scale
from motion_cueing.envs.task.kernels.observation import MACHINE, abilities, ability_of
from motion_cueing.train.agents.export import export_onnx
from motion_cueing.train.algorithms.apg.apg import ApgLearner
from motion_cueing.train.algorithms.dagger.dagger import Teacher
from motion_cueing.train.config import load_config, validation_task
from motion_cueing.train.networks import Actor, normalize_by_rollout, start_as_spring_damper
from motion_cueing.train.validation import Validation

from ...envs.task.tasks import drive
from .. import tiny
from . import agent

BUILD = {"travel": [0.5, 1.0], "size": [0.4, 1.0], "without_carriage": 0.4, "without_turntable": 0.4}
TOLD = {
    "observation": {"preview": 0, "machine": True, "frame": "cab", "memory": [1.0]},
    "action": {"frame": "cab", "repeat": 5, "authority": 0.5},
    "randomization": {"platforms": 6, "platform": BUILD},
}


def told(**fields) -> TaskOptions:
    return TaskOptions(**{**TOLD, **fields})


def test_a_spring_begins_on_machines_that_all_can_move():
    batch = Batch(8, told(), drives=[drive()])
    actor = Actor(batch.layout.size, 9, (8,))
    start_as_spring_damper(actor, batch)
    rows, gains = batch.layout.slices, actor.network().weights[-1][:, 8:]
    # -w^2 x with w = 0.3 rad/s, a unit of the row being 10 m, as a share of the usual scale.
    assert gains[0, rows["carriage"].start] == pytest.approx(-0.09 * 10.0 / batch.usual_scale[0], rel=1e-6)
    assert gains[8, rows["turntable_rate"].start] < 0.0
    assert not gains[:, rows["carriage_travel"].start :].any()


def test_what_a_machine_can_do_gets_a_standard_that_others_fit_in():
    task = told(randomization={"platforms": 2, "platform": BUILD})
    batch = Batch(2, task, drives=[drive()])
    everywhere = np.ones(2, dtype=bool)
    batch.seed(everywhere, [0, 1])
    actor = Actor(batch.layout.size, 9, (8,))
    start_as_spring_damper(actor, batch)
    normalize_by_rollout(actor, batch, 10)
    for platform in map(get_platform, platform_names()):
        first = batch.layout.first(MACHINE[0].name)
        seen = torch.zeros(batch.layout.size)
        seen[first : first + len(ability_of(platform))] = torch.from_numpy(ability_of(platform))
        standard = ((seen - actor.mean) / actor.deviation)[first:-3]
        assert float(standard.abs().max()) < 15.0


def test_validation_drives_machines_that_are_not_trained_on(tmp_path):
    config = tiny.config(tmp_path, "apg", task=TOLD, validation={"drives": 4})
    task = validation_task(config)
    trained, judged = machines_of(config.task), machines_of(task)
    assert (len(trained), len(judged)) == (6, 4)
    assert not {m.hexapod for m in trained} & {m.hexapod for m in judged}
    validation = Validation(config)
    validation.score(lambda seen: np.zeros((4, 9)))
    assert validation._batch.simulator.platform_of.tolist() == [0, 1, 2, 3]


@pytest.mark.slow
def test_it_learns_on_several_machines(tmp_path):
    task = {**TOLD, "episode": {"library": 2, "drive_duration": 6.0, "duration": 0.5, "random_start": True}}
    learner = ApgLearner(tiny.config(tmp_path, "apg", task=task, steps=4 * 10 * 4))
    before = learner.network()
    learner.learn(lambda: None)
    assert len(set(learner.batch.simulator.platform_of.tolist())) > 1
    first, hidden = learner.batch.layout.slices["hexapod_top_speed"], 8
    after = learner.network().weights[-1][:, hidden:]
    assert np.abs(after - before.weights[-1][:, hidden:])[:, first].max() > 0.0
    assert learner.scalars()["train/skipped_rounds"] == 0


def test_a_teacher_has_one_machine():
    with pytest.raises(ConfigurationError, match=r"teacher classical is made for one machine; leave rand"):
        Teacher("classical", Batch(2, told(), drives=[drive()]))


def test_an_agent_file_keeps_that_it_is_told(tmp_path):
    one = agent(told(action={"largest": [float(k) for k in range(1, 10)]}), name="any")
    one.save(tmp_path / "any.safetensors")
    read = type(one).load(tmp_path / "any.safetensors")
    assert read.task.observation.machine
    assert read.task == one.task
    assert "any motion base, which it observes" in read.description
    assert not agent().task.observation.machine


def test_the_exported_file_says_what_is_seen_of_the_machine(tmp_path):
    one = agent(told()).on("nads-1")
    export_onnx(one, tmp_path / "a.onnx")
    about = {entry.key: entry.value for entry in onnx.load(tmp_path / "a.onnx").metadata_props}
    machine = json.loads(about["machine"])
    assert machine == {name: values.tolist() for name, values in abilities(one.platform).items()}
    assert json.loads(about["action"])["scale"] == (0.5 * acceleration_scale(one.platform)).tolist()
    export_onnx(agent(), tmp_path / "b.onnx")
    about = {entry.key: entry.value for entry in onnx.load(tmp_path / "b.onnx").metadata_props}
    assert json.loads(about["machine"]) == {}


def test_the_recipes_machines_are_no_preset_but_around_them():
    config, first = (load_config(None, Path(name)) for name in ("learned-any", "learned-any-washout"))
    assert config.task.randomization == first.task.randomization
    machines = machines_of(config.task)
    presets = [get_platform(one) for one in platform_names()]
    assert config.task.observation.machine
    for part in ("hexapod", "carriage"):
        used = {getattr(machine, part) for machine in machines} - {None}
        assert not used & {getattr(preset, part) for preset in presets}
    told_of = np.array([ability_of(machine) for machine in machines])
    lowest, highest = told_of.min(axis=0) - 1e-6, told_of.max(axis=0) + 1e-6
    for preset in presets:
        own = ability_of(preset)
        assert np.mean((own >= lowest) & (own <= highest)) > 0.9
