"""Training of a predictor: it learns, its file says how it was made, and commands drive with it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.maneuvers import random_drives
from motion_cueing.envs.task.predictor import Predictor, PredictorOptions
from motion_cueing.evaluation.studies.forecasts import measure_forecasts
from motion_cueing.train.algorithms.predict.predict import changes_of, load_predict_config

SMALL = "library: 6\ndrive_duration: 25.0\nepochs: 6\nnet_arch: [32]\nbatch_size: 128\n"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The folder of a small training."""
    folder = tmp_path_factory.mktemp("predict")
    (folder / "small.yaml").write_text(SMALL)
    argv = ["train", "--algo", "predict", "--config", str(folder / "small.yaml"), "--seed", "3"]
    assert main([*argv, "--out", str(folder / "run")]) == 0
    return folder / "run"


def test_the_file_has_what_made_it(trained):
    predictor = Predictor.load(trained / "predictor.safetensors")
    assert predictor.record["config"]["seed"] == 3
    assert predictor.record["config"]["library"] == 6
    losses = [float(line.split(",")[1]) for line in (trained / "log.csv").read_text().splitlines()[1:]]
    assert len(losses) == 6
    assert losses[-1] < losses[0]


def test_targets_are_the_changes_of_the_cues():
    drive, options = random_drives(1, 20.0, 4)[0], PredictorOptions(leads=(0.1, 2.0))
    changes = changes_of(drive, options)
    force, rate = drive.specific_force, drive.angular_velocity
    np.testing.assert_allclose(changes[100, 1, :3], force[300] - force[100])
    np.testing.assert_allclose(changes[100, 0, 3:], (rate[110] - rate[100]) / 0.1)
    assert not changes[-1].any()


def test_errors_by_lead_time(trained):
    drives = random_drives(2, 25.0, 9)
    predictor = Predictor.load(trained / "predictor.safetensors")
    found = measure_forecasts(predictor, drives, (0.2, 1.0))
    force = np.concatenate(
        [d.specific_force[np.minimum(np.arange(len(d)) + 100, len(d) - 1)] for d in drives]
    )
    now = np.concatenate([d.specific_force for d in drives])
    expected = np.sqrt(np.mean((force - now) ** 2, axis=0))
    np.testing.assert_allclose(found.errors["held"][1, :3], expected)
    assert ((found.within >= 0.0) & (found.within <= 1.0)).all()
    assert (found.within[1] >= found.within[0]).all()


def test_options_that_mean_nothing_are_refused(capsys):
    assert main(["train", "--algo", "predict", "--steps", "5"]) == 2
    assert "--algo predict takes --config, --seed and --out alone" in capsys.readouterr().err


def test_a_wrong_field_is_named(tmp_path, capsys):
    (tmp_path / "wrong.yaml").write_text("epoch: 3\n")
    argv = [
        "train",
        "--algo",
        "predict",
        "--config",
        str(tmp_path / "wrong.yaml"),
        "--out",
        str(tmp_path / "x"),
    ]
    assert main(argv) == 2
    assert "epoch" in capsys.readouterr().err
    assert load_predict_config(seed=4).seed == 4


def test_a_policy_drives_with_it(trained, tmp_path, capsys):
    argv = ["evaluate", "--policies", "learned-preview", "--maneuvers", "lane-change", "--preview"]
    scores = {}
    for preview in ("true", "held", "predicted"):
        out = tmp_path / preview
        more = ["--predictor", str(trained / "predictor.safetensors"), "--out", str(out)]
        assert main([*argv, preview, *more]) == 0
        results = json.loads((out / "results.json").read_text())
        scores[preview] = results["maneuvers"]["lane-change"]["learned-preview"]["cue_error"]
    capsys.readouterr()
    assert scores["true"] < scores["held"]
    assert len(set(scores.values())) == 3
