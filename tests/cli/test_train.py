"""``motion-cueing train`` from the command line."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from motion_cueing.cli import train as train_command
from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import load, to_dict
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.train import training as interrupt
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.run import RunFolder, checkpoints_in
from motion_cueing.train.training import Training, initial_network

from ..train import tiny

pytestmark = pytest.mark.slow

PROGRAM = (sys.executable, "-m", "motion_cueing.evaluation")


@pytest.mark.parametrize("algo", tiny.ALGORITHMS)
@pytest.mark.usefixtures("undrawn")
def test_an_agent_comes_of_it(algo, tmp_path, capsys):
    out = tmp_path / "run"
    config_file = tiny.config_file(tmp_path, algo, hyperparameters={"gamma": 0.95})
    words = ["train", "--algorithm", algo, "--config", str(config_file)]
    assert main([*words, "--seed", "3", "--envs", "5", "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert "final.safetensors: the agent after" in told.out
    assert "(washout " in told.err
    # Its gamma is of a few seconds: said once, before it trains.
    assert told.err.splitlines()[0].startswith("warning: hyperparameters: gamma")
    assert told.err.count("s, but its travel costs after") == 1
    assert f"{out / 'learning.png'}: J over the actions" in told.out

    config = load(TrainingConfig, out / "config.yaml")
    assert (config.algo, config.seed, config.n_envs) == (algo, 3, 5)
    for name in ("final", "best"):
        agent = Agent.load(out / f"{name}.safetensors")
        assert agent.task == config.task
        assert (agent.record.algo, agent.record.seed) == (algo, 3)
        assert agent.record.validation is not None
        action, _ = agent.predict(np.zeros((2, agent.network.size), dtype=np.float32))
        assert action.shape == (2, 9)
    record = json.loads((out / "run.json").read_text())
    assert record["sessions"][0]["versions"]["torch"]
    assert "cores" in record["sessions"][0]["hardware"]
    rows = list(csv.DictReader((out / "log.csv").open()))
    assert {f"terms/{name}" for name in TERMS} | {"validation/J", "validation/perceived_J"} <= rows[0].keys()
    assert float(rows[0]["classical/J"]) > 0.0
    assert list((out / "tensorboard").iterdir())
    assert checkpoints_in(out / "checkpoints")


def test_an_agent_is_evaluated(tmp_path, capsys):
    out = tmp_path / "run"
    config = tiny.config_file(tmp_path, "ppo")
    assert main(["train", "--algorithm", "ppo", "--config", str(config), "--out", str(out)]) == 0
    words = ["evaluate", "--policies", str(out / "best.safetensors"), "--maneuvers", "lane-change"]
    assert main([*words, "--out", str(tmp_path / "results")]) == 0
    assert "lane-change" in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_ctrl_c_leaves_a_checkpoint_to_go_on_from(tmp_path):
    out = tmp_path / "run"
    path = tiny.config_file(tmp_path, "ppo", steps=10_000_000)
    process = subprocess.Popen(
        [*PROGRAM, "train", "--algorithm", "ppo", "--config", str(path), "--out", str(out)],
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert process.stderr is not None
    seen = ""
    # The line of the second validation: it trains.
    while seen.count(" J ") < 2:
        line = process.stderr.readline()
        assert line, seen
        seen += line
    os.kill(process.pid, signal.SIGINT)
    rest = process.communicate(timeout=120)[1]
    assert process.returncode == 130
    assert f"go on with: motion-cueing train --out {out}" in rest
    assert "Traceback" not in rest
    (*_, last) = checkpoints_in(out / "checkpoints")
    steps = int(last.stem.split("-")[1])
    assert f"stopped after {steps:,} steps" in rest
    assert main(["train", "--out", str(out), "--steps", str(steps + 64)]) == 0
    assert Agent.load(out / "final.safetensors").record.steps >= steps + 64


@pytest.mark.usefixtures("undrawn")
def test_the_same_command_goes_on_and_fresh_begins_anew(tmp_path, capsys):
    out, config = tmp_path / "run", tiny.config_file(tmp_path, "ppo", steps=64)
    words = ["train", "--algorithm", "ppo", "--config", str(config), "--out", str(out)]
    sessions = []
    for more in ([], ["--steps", "128"], ["--fresh"]):
        assert main([*words, *more]) == 0
        sessions.append(
            [session["steps"] for session in json.loads((out / "run.json").read_text())["sessions"]]
        )
    assert sessions == [[0], [0, 64], [0]]
    capsys.readouterr()
    for more, told in (
        (
            ["--seed", "9"],
            f"--seed 9: {out} was begun with 0; leave it out, name another --out, or add --fresh",
        ),
        (["--envs", "9"], f"--envs 9: {out} was begun with "),
        (
            ["--seeds", "0", "1"],
            f"{out} holds a training; `motion-cueing train` without --seeds",
        ),
    ):
        assert told in complaint([*words, *more], capsys)
    config.write_text(re.sub("log_every: .*", "log_every: 17", config.read_text()))
    assert f"--config {config}: {out} was begun with another log_every; " in complaint(words, capsys)
    assert "holds a training" in complaint(["search", *words[1:], "--trials", "2"], capsys)


def test_ctrl_c_twice_interrupts_at_once():
    asked = interrupt.Interrupt()
    earlier = signal.getsignal(signal.SIGINT)
    with asked.caught():
        signal.raise_signal(signal.SIGINT)
        assert asked.asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is earlier


@pytest.mark.usefixtures("undrawn")
def test_other_versions_at_resuming_are_told(tmp_path, capsys):
    folder = RunFolder.create(tmp_path / "run", tiny.config(tmp_path, "ppo", steps=64))
    Training(folder).train()
    record = json.loads((folder.path / "run.json").read_text())
    record["sessions"][0]["versions"]["torch"] = "1.0"
    (folder.path / "run.json").write_text(json.dumps(record))
    assert main(["train", "--out", str(folder.path)]) == 0
    assert "note: torch was 1.0, is " in capsys.readouterr().err


def complaint(words: list[str], capsys) -> str:
    """The one line of a refusal."""
    assert main(words) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"motion-cueing {words[0]}: ")
    return lines[0]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["train"], "--algorithm is missing; use one of ppo, trpo, recurrent-ppo, sac"),
        (["train", "--algorithm", "poo"], "unknown algorithm 'poo'. Did you mean ppo"),
        (["train", "--algorithm", "ppo", "--steps", "0"], "field 'steps'"),
        (["train", "--algorithm", "ppo", "--steps", "many"], "--steps takes a whole number, found 'many'"),
        (["train", "--algorithm", "ppo", "--steps", "1.5"], "--steps takes a whole number, found '1.5'"),
        (["train", "--algorithm", "ppo", "--config", "none.yaml"], "none.yaml: cannot be read"),
        (["train", "--algorithm", "ppo", "--config", "broken.yaml"], "broken.yaml: not YAML (line 2"),
        (
            ["train", "--algorithm", "ppo", "--config", "typo.yaml"],
            "unknown field 'n_step'. Did you mean n_steps",
        ),
        (["train", "--algorithm", "ppo", "--config", "drive.yaml"], "task.episode.drives names braking"),
        (["train", "--algorithm", "td3", "--config", "together.yaml"], "hyperparameters: "),
        (["train", "--algorithm", "ppo", "--out", "."], "there is something already that no training wrote"),
        (
            ["train", "--resume", "nowhere"],
            "--resume is not needed now: a command goes on",
        ),
        (["train", "--search", "3"], "a command of its own now: motion-cueing search"),
        (["train", "--population", "3"], "a command of its own now: motion-cueing population"),
        (["train", "--jobs", "3"], "--jobs is called --workers now"),
        (
            ["train", "--algorithm", "ppo", "--workers", "2"],
            "--workers is of use only where",
        ),
        (
            ["train", "--algorithm", "ppo", "--seeds", "4"],
            "such as 0 1 2 3, found 4",
        ),
        (["train", "--algorithm", "ppo", "--seeds", "0", "2"], "such as 0 1 2 3, found 0 2"),
        (["train", "--algorithm", "ppo", "--engine", "rey"], "local, ray, found 'rey'. Did you mean ray?"),
        (["train", "--algorithm", "ppo", "--address", "a:1"], "--address is of use only with --engine ray"),
        (["population", "--algorithm", "ppo", "--members", "1"], "field 'population.members'"),
        (["population", "--algorithm", "ppo", "--config", "nothing.yaml"], "search is empty"),
        (["population", "--algorithm", "ppo", "--config", "shape.yaml"], "cannot change in the middle"),
        (["population", "--algorithm", "ppo", "--config", "reward.yaml"], "cannot be compared by reward"),
        (["search", "--algorithm", "ppo", "--trials", "0"], "--trials must be at least 1"),
        (["search", "--algorithm", "ppo"], "--trials must be given"),
        (["search", "--algorithm", "ppo", "--config", "nothing.yaml", "--trials", "1"], "search is empty"),
        (
            ["search", "--algorithm", "ppo", "--config", "wrong.yaml", "--trials", "1"],
            "field 'validation.drives'",
        ),
    ],
)
def test_what_is_wrong_is_told_in_one_line_and_nothing_is_written(
    words, message, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    files = {
        "broken": "a: 1\nb: [",
        "typo": "hyperparameters: {n_step: 3}",
        "drive": "task: {episode: {drives: [braking]}}",
        "together": "hyperparameters: {train_freq: [1, year]}\ntask: {episode: {library: 1}}",
        "nothing": "search: {}",
        "shape": "search: {hyperparameters.policy_kwargs.net_arch: {choices: [[4], [5]]}}",
        "reward": "search: {task.reward.tilt_rate: {low: 0.1, high: 1.0}}\nvalidation: {best: reward}",
        "wrong": "search: {validation.drives: {low: 0, high: 3, integer: true}}",
    }
    for name, text in files.items():
        Path(f"{name}.yaml").write_text(text)
    assert message in complaint(words, capsys)
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.yaml" for name in files}


def test_an_agent_for_a_machine_of_ones_own_goes_on_from_one_for_any(tmp_path):
    mine = tmp_path / "mine.yaml"
    platform = replace(get_platform("24-inch"), name="mine")
    mine.write_text(yaml.safe_dump(to_dict(platform)), encoding="utf-8")
    command = train_command.TrainCommand(platform=str(mine), steps=1000)
    config = train_command.new_config(command)
    assert (config.algo, config.initial, config.steps) == ("apg", "learned-any-now", 1000)
    assert config.task.platform == platform
    assert config.task.randomization.platform is None
    assert initial_network(config) is not None
    # Another configuration may be for the machine, too.
    other = train_command.new_config(replace(command, config=Path("learned")))
    assert (other.initial, other.task.platform) == (None, platform)
    wrong = replace(other, initial="learned")
    with pytest.raises(ConfigurationError, match=r"initial learned: its task\.platform is"):
        initial_network(wrong)
    RunFolder.create(tmp_path / "run", config)
    with pytest.raises(ConfigurationError, match=r"--for paper: .* was begun with another task"):
        train_command.check_same(replace(command, platform="paper", out=tmp_path / "run"), config)


def test_a_missing_package_is_told(monkeypatch):
    monkeypatch.setattr(train_command, "find_spec", lambda name: None if name == "torch" else object())
    with pytest.raises(ConfigurationError, match=r"needs torch: pip install 'motion-cueing-gym\[train\]'"):
        train_command.run(train_command.TrainCommand(algorithm="ppo"))


def test_help_needs_no_learning_library():
    code = (
        "import sys; from motion_cueing.cli.main import main; main(['train', '--help']); "
        "print(sorted({'torch', 'stable_baselines3', 'optuna'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]")
    assert "--fresh" in done.stdout


def test_folders_are_numbered_where_none_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "ppo-1").mkdir(parents=True)
    assert RunFolder.create(None, tiny.config(tmp_path, "ppo")).path == Path("runs/ppo-2")
