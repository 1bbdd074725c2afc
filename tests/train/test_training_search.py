"""Searches for hyperparameters."""

from __future__ import annotations

import csv
from dataclasses import replace

import optuna
import pytest
from optuna.trial import TrialState

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.settings import from_dict, load
from motion_cueing.evaluation.command_line import main
from motion_cueing.train.agent import Agent
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.search import Search, _suggest
from motion_cueing.train.training import Training

from . import tiny

SPACE = {
    "hyperparameters.policy_kwargs.net_arch": {"choices": [[4], [6, 6]]},
    "hyperparameters.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True},
    "task.action.repeat": {"low": 4, "high": 6, "integer": True},
}


def rows(search: Search) -> list[dict[str, str]]:
    with (search.path / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_search_finds_a_configuration_resumes_and_runs_in_processes(tmp_path, capsys):
    path, out = tiny.config_file(tmp_path, "ppo", search=SPACE), tmp_path / "search"
    words = ["train", "--algo", "ppo", "--config", str(path), "--steps", "128", "--search", "2"]
    assert main([*words, "--out", str(out)]) == 0
    assert "best.yaml: trial" in capsys.readouterr().out
    assert len(rows(Search.open(out))) == 2
    assert main(["train", "--resume", str(out), "--search", "4", "--jobs", "2"]) == 0

    search = Search.open(out)
    found = rows(search)
    assert [row["state"] in ("complete", "pruned") for row in found] == [True] * 4
    for row in found:
        assert 1e-4 <= float(row["hyperparameters.learning_rate"]) <= 1e-2
        assert row["task.action.repeat"] in "456"
        assert row["hyperparameters.policy_kwargs.net_arch"] in ("[4]", "[6, 6]")
    assert len({row["hyperparameters.learning_rate"] for row in found}) == 4
    best = min((row for row in found if row["state"] == "complete"), key=lambda row: float(row["result"]))
    config = load(TrainingConfig, search.best_config)
    assert str(config.hyperparameters["learning_rate"]) == best["hyperparameters.learning_rate"]
    assert str(config.task.action.repeat) == best["task.action.repeat"]
    assert load_config(None, search.best_config) == config
    agent = Agent.load(out / "trials" / f"{int(best['trial']):04d}" / "best.safetensors")
    assert agent.record.validation == pytest.approx(float(best["result"]), rel=1e-5)
    # All results are there: nothing is trained again.
    assert not search.run(4, 1)
    assert len(rows(search)) == 4


def test_hopeless_trainings_are_broken_off(tmp_path, monkeypatch):
    config = tiny.config(tmp_path, "ppo", search=SPACE, validation={"every": 64})
    search = Search.create(tmp_path / "search", config)
    monkeypatch.setattr(optuna.Trial, "should_prune", lambda trial: trial.number == 1)
    assert not search.run(2, 1)
    assert [row["state"] for row in rows(search)] == ["complete", "pruned"]
    assert not (search.path / "trials" / "0001" / "final.safetensors").exists()


def test_a_training_that_fails_is_told_and_not_counted(tmp_path, monkeypatch, capsys):
    search = Search.create(tmp_path / "search", tiny.config(tmp_path, "ppo", search=SPACE, steps=64))
    train = Training.train

    def fail_once(training: Training):
        if training.run.path.name == "0000":
            raise ValueError("not\nfinite")
        return train(training)

    monkeypatch.setattr(Training, "train", fail_once)
    assert not search.run(2, 1)
    assert "trial 0: failed (not finite)" in capsys.readouterr().out
    assert [row["state"] for row in rows(search)] == ["fail", "complete"]
    assert not search.run(2, 1)
    assert [row["state"] for row in rows(search)] == ["fail", "complete", "complete"]


def test_ctrl_c_and_a_killed_process_leave_trials_to_be_tried_again(tmp_path, monkeypatch):
    search = Search.create(tmp_path / "search", tiny.config(tmp_path, "ppo", search=SPACE, steps=64))

    def interrupted(training: Training):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Training, "train", interrupted)
        assert search.run(1, 1)
    first = search.study().trials
    assert [trial.state for trial in first] == [TrialState.FAIL, TrialState.WAITING]
    killed = search.study().ask()
    for name, choice in search.config.search.items():
        _suggest(killed, name, choice)
    search = Search.open(search.path)
    assert not search.run(1, 1)
    done = [trial for trial in search.study().trials if trial.state is TrialState.COMPLETE]
    assert len(done) == 1
    assert done[0].params == first[0].params


@pytest.mark.parametrize(
    ("space", "message"),
    [
        ({}, "search is empty"),
        ({"n_envs": {"low": 0, "high": 4, "integer": True}}, "field 'n_envs'"),
        ({"steps.more": {"choices": [1]}}, "leads through 'steps', which has no fields"),
        ({"task.episode.drives": {"choices": [["braking"]]}}, "never trained on"),
    ],
)
def test_what_cannot_be_searched_is_refused_before_anything_is_trained(space, message, tmp_path):
    varied = from_dict(TrainingConfig, {"algo": "ppo", "search": space}).search
    config = replace(tiny.config(tmp_path, "ppo"), search=varied)
    with pytest.raises(ConfigurationError) as caught:
        Search.create(tmp_path / "search", config)
    assert message in str(caught.value)
    assert not (tmp_path / "search").exists()
