"""Searches for hyperparameters."""

from __future__ import annotations

import csv
import signal
from dataclasses import replace

import optuna
import pytest
from optuna.trial import TrialState

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.settings import from_dict, load
from motion_cueing.train import training
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.experiments.engine import make_engine
from motion_cueing.train.experiments.search import Search, suggest
from motion_cueing.train.experiments.seeds import Place, TrainingProgress, run_search
from motion_cueing.train.training import Training

from .. import tiny

pytestmark = pytest.mark.slow

SPACE = {
    "hyperparameters.policy_kwargs.net_arch": {"choices": [[4], [6, 6]]},
    "hyperparameters.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True},
    "task.action.repeat": {"low": 4, "high": 6, "integer": True},
}


def run(search: Search, trials: int) -> bool:
    with make_engine("local") as engine:
        return search.run(trials, engine, TrainingProgress())


def rows(search: Search) -> list[dict[str, str]]:
    with (search.path / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_search_finds_a_configuration_and_goes_on(tmp_path, capsys):
    search = Search.create(tmp_path / "search", tiny.config(tmp_path, "ppo", search=SPACE, steps=128))
    assert run_search(search, 2, Place("local")) == 0
    assert "best.yaml: trial" in capsys.readouterr().out
    assert len(rows(Search.open(search.path))) == 2
    search = Search.open(search.path)
    assert run_search(search, 4, Place("local")) == 0

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
    agent = Agent.load(search.path / "trials" / f"{int(best['trial']):04d}" / "best.safetensors")
    assert agent.record.validation == pytest.approx(float(best["result"]), rel=1e-5)
    # All results are there: nothing is trained again.
    assert not run(search, 4)
    assert len(rows(search)) == 4


def test_hopeless_trainings_are_broken_off(tmp_path, monkeypatch):
    config = tiny.config(tmp_path, "ppo", search=SPACE, validation={"every": 64})
    search = Search.create(tmp_path / "search", config)
    monkeypatch.setattr(optuna.Trial, "should_prune", lambda trial: trial.number == 1)
    assert not run(search, 2)
    assert [row["state"] for row in rows(search)] == ["complete", "pruned"]
    assert not (search.path / "trials" / "0001" / "final.safetensors").exists()


def test_a_training_that_fails_is_told_and_not_counted(tmp_path, monkeypatch, capsys):
    search = Search.create(tmp_path / "search", tiny.config(tmp_path, "ppo", search=SPACE, steps=64))
    train = Training.train

    def fail_once(begun: Training):
        if begun.run.path.name == "0000":
            raise ValueError("not\nfinite")
        return train(begun)

    monkeypatch.setattr(Training, "train", fail_once)
    assert not run(search, 2)
    assert "trial 0: failed (not finite)" in capsys.readouterr().out
    assert [row["state"] for row in rows(search)] == ["fail", "complete"]
    assert not run(search, 2)
    assert [row["state"] for row in rows(search)] == ["fail", "complete", "complete"]


def test_trials_stopped_by_ctrl_c_or_by_a_killed_process_go_on(tmp_path, monkeypatch):
    config = tiny.config(tmp_path, "ppo", search=SPACE, steps=128)
    search = Search.create(tmp_path / "search", config)
    boundary = Training._boundary

    def pressed(begun: Training) -> None:
        signal.raise_signal(signal.SIGINT)
        boundary(begun)

    with monkeypatch.context() as patched:
        patched.setattr(Training, "_boundary", pressed)
        assert run(search, 1)
    assert [path.name for path in (search.path / "trials/0000/checkpoints").iterdir()]
    study = search.study()
    killed, unfinished = study.ask(), study.ask()
    for name, choice in search.config.search.items():
        suggest(killed, name, choice)
    assert [trial.state for trial in study.trials] == [TrialState.RUNNING] * 3
    search = Search.open(search.path)
    assert not run(search, 3)
    trials = search.study().trials
    assert [trial.state for trial in trials] == [TrialState.COMPLETE] * 2 + [
        TrialState.FAIL,
        TrialState.COMPLETE,
    ]
    assert unfinished.number == 2
    assert trials[1].params == killed.params
    # Checkpoints are for going on only.
    assert not list(search.path.glob("trials/*/checkpoints"))


def test_a_training_that_is_not_finite_is_a_failure(tmp_path, monkeypatch, capsys):
    search = Search.create(tmp_path / "search", tiny.config(tmp_path, "ppo", search=SPACE, steps=64))
    monkeypatch.setattr(training, "rating", lambda score, measure: float("nan"))
    assert not run(search, 1)
    assert [row["state"] for row in rows(search)] == ["fail"]
    assert "no validation of it is finite" in capsys.readouterr().out


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
