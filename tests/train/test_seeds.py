"""One training with several seeds, from the command line."""

from __future__ import annotations

import csv
import signal
from pathlib import Path

import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.settings import load
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.experiments import seeds as studies
from motion_cueing.train.experiments.seeds import Seeds, summary
from motion_cueing.train.training import Training

from . import tiny


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_each_seed_has_a_folder_and_a_row_and_all_go_on(tmp_path, capsys):
    path, out = tiny.config_file(tmp_path, "apg"), tmp_path / "seeds"
    words = ["train", "--algorithm", "apg", "--config", str(path), "--seeds", "5", "6"]
    assert main([*words, "--steps", "160", "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert f"{out}: best in validation" in told.out
    assert "over 2 seeds" in told.out
    assert {line.split(":")[0] for line in told.err.splitlines()} == {"seed-5", "seed-6"}
    assert [(row["seed"], row["state"], row["steps"]) for row in rows(out)] == [
        ("5", "done", "160"),
        ("6", "done", "160"),
    ]
    for row in rows(out):
        folder = out / f"seed-{row['seed']}"
        assert load(TrainingConfig, folder / "config.yaml").seed == int(row["seed"])
        best = Agent.load(folder / "best.safetensors").record.validation
        assert best == pytest.approx(float(row["best"]), rel=1e-5)
    assert main(["train", "--out", str(out), "--steps", "320"]) == 0
    assert [row["steps"] for row in rows(out)] == ["320", "320"]
    assert Agent.load(out / "seed-6" / "final.safetensors").record.steps == 320


def test_ctrl_c_stops_all_and_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    path, out, boundary = tiny.config_file(tmp_path, "apg"), tmp_path / "seeds", Training._boundary

    def pressed(training: Training) -> None:
        signal.raise_signal(signal.SIGINT)
        boundary(training)

    words = ["train", "--algorithm", "apg", "--config", str(path), "--seeds", "0", "1", "--out", str(out)]
    with monkeypatch.context() as patched:
        patched.setattr(Training, "_boundary", pressed)
        assert main([*words, "--workers", "1"]) == 130
    assert f"stopped; go on with: motion-cueing train --out {out} --workers 1" in capsys.readouterr().err
    assert [row["state"] for row in rows(out)] == ["stopped", "not begun"]
    assert main(["train", "--out", str(out)]) == 0
    assert [row["state"] for row in rows(out)] == ["done", "done"]


def test_one_that_fails_is_named_when_the_others_are_done(tmp_path, monkeypatch, capsys):
    seeds = Seeds.create(tmp_path / "seeds", tiny.config(tmp_path, "apg", steps=80), 2)
    train = Training.train

    def fail_once(training: Training):
        if training.config.seed == 0:
            raise ValueError("not finite")
        return train(training)

    with monkeypatch.context() as patched:
        patched.setattr(Training, "train", fail_once)
        assert main(["train", "--out", str(seeds.path)]) == 2
    assert "failed: seed-0 (not finite); the same command tries again" in capsys.readouterr().err
    assert [row["state"] for row in rows(seeds.path)] == ["failed", "done"]


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


def test_a_search_is_gone_on_with_only_by_its_command(tmp_path, capsys):
    (tmp_path / "search.journal").touch()
    assert main(["train", "--out", str(tmp_path)]) == 2
    assert "holds a search; `motion-cueing search` goes on with it" in capsys.readouterr().err
