"""One training with several seeds."""

from __future__ import annotations

import csv
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.settings import load
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.experiments import seeds as studies
from motion_cueing.train.experiments.seeds import Seeds, summary
from motion_cueing.train.run import RunFolder
from motion_cueing.train.training import Training

from .. import tiny

pytestmark = pytest.mark.slow

HERE = studies.Place("local")


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    return tiny.config(tmp_path_factory.mktemp("config"), "apg", seed=5, steps=160)


def test_each_seed_has_a_folder_and_a_row_and_all_go_on(config, tmp_path, capsys):
    seeds = Seeds.create(tmp_path / "seeds", config, 2)
    assert studies.run_seeds(seeds, HERE) == 0
    told = capsys.readouterr()
    assert f"{seeds.path}: best in validation" in told.out
    assert "over 2 seeds" in told.out
    assert {line.split(":")[0] for line in told.err.splitlines()} == {"seed-5", "seed-6"}
    assert [(row["seed"], row["state"], row["steps"]) for row in rows(seeds.path)] == [
        ("5", "done", "160"),
        ("6", "done", "160"),
    ]
    for row in rows(seeds.path):
        folder = seeds.path / f"seed-{row['seed']}"
        assert load(TrainingConfig, folder / "config.yaml").seed == int(row["seed"])
        best = Agent.load(folder / "best.safetensors").record.validation
        assert best == pytest.approx(float(row["best"]), rel=1e-5)
    assert studies.run_seeds(Seeds.open(seeds.path, 240), HERE) == 0
    assert [row["steps"] for row in rows(seeds.path)] == ["240", "240"]
    assert Agent.load(seeds.path / "seed-6" / "final.safetensors").record.steps == 240


def test_ctrl_c_stops_all_and_says_how_to_go_on(config, tmp_path, monkeypatch, capsys):
    seeds, boundary = Seeds.create(tmp_path / "seeds", config, 2), Training._boundary

    def pressed(training: Training) -> None:
        signal.raise_signal(signal.SIGINT)
        boundary(training)

    with monkeypatch.context() as patched:
        patched.setattr(Training, "_boundary", pressed)
        assert studies.run_seeds(seeds, HERE) == 130
    assert f"stopped; go on with: motion-cueing train --out {seeds.path}" in capsys.readouterr().err
    assert [row["state"] for row in rows(seeds.path)] == ["stopped", "not begun"]
    assert studies.run_seeds(Seeds.open(seeds.path), HERE) == 0
    assert [row["state"] for row in rows(seeds.path)] == ["done", "done"]


def test_one_that_fails_is_named_when_the_others_are_done(config, tmp_path, monkeypatch):
    seeds = Seeds.create(tmp_path / "seeds", replace(config, steps=80), 2)
    train = Training.train

    def fail_once(training: Training):
        if training.config.seed == 5:
            raise ValueError("not finite")
        return train(training)

    monkeypatch.setattr(Training, "train", fail_once)
    with pytest.raises(DataError, match=r"failed: seed-5 \(not finite\); the same command tries again"):
        studies.run_seeds(seeds, HERE)
    assert [row["state"] for row in rows(seeds.path)] == ["failed", "done"]


def test_what_was_begun_in_a_folder_is_known(config, tmp_path):
    assert studies.kind_of(tmp_path) is None
    seeds = Seeds.create(tmp_path / "seeds", config, 2)
    assert studies.kind_of(seeds.path) == "seeds"
    run = RunFolder.create(tmp_path / "run", config)
    run.begin(0)
    assert studies.kind_of(run.path) == "training"


def test_the_summary_is_mean_lowest_and_highest():
    assert summary([1.0, 2.0, 6.0]) == "best in validation 3.000, 1.000 to 6.000 over 3 seeds"


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (studies.Place("local"), ""),
        (studies.Place("ray", 4, "10.0.0.1:6379"), " --engine ray --address 10.0.0.1:6379 --workers 4"),
    ],
)
def test_the_words_that_go_on_name_the_place(place, words):
    assert place.words == words
