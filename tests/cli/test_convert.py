"""A saved model becomes an agent by one command."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.train.agents import Agent

pytest.importorskip("sb3_contrib")
from ..train.algorithms.sb3.models import ID, actions, learned, seen

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A model, and where it and its statistics are saved."""
    folder, model = tmp_path_factory.mktemp("model"), learned("trpo")
    model.save(folder / "model.zip")
    model.get_vec_normalize_env().save(folder / "statistics.pkl")
    return model, folder


def convert(folder, *words):
    return main(["convert", str(folder / "model.zip"), *words])


def test_a_model_becomes_an_agent(files, tmp_path, capsys):
    model, folder = files
    out, statistics = tmp_path / "mine.safetensors", str(folder / "statistics.pkl")
    assert convert(folder, "--environment", ID, "--normalize", statistics, "--out", str(out)) == 0
    assert capsys.readouterr().out.startswith(f"{out}: agent by trpo for the motion base paper")
    agent = Agent.load(out)
    assert agent.name == "mine"
    np.testing.assert_allclose(agent.predict(seen(model))[0], actions(model, seen(model)), atol=1e-5)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--environment", ID, "--out", "mine.zip"), "name a file that ends in .safetensors"),
        (("--environment", ID, "--out", "mine.safetensors"), "give its statistics too, --normalize"),
        (("--environment", "cue", "--out", "mine.safetensors"), "unknown task 'cue'"),
        (("--environment", ID, "--algorithm", "a2c", "--out", "mine.safetensors"), "unknown algorithm 'a2c'"),
        (("--environment", ID, "--normalize", "none", "--out", "mine.safetensors"), "none: there is no such"),
    ],
)
def test_the_command_refuses_what_does_not_fit(files, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    assert convert(files[1], *words) == 2
    said = capsys.readouterr().err
    assert message in said
    assert len(said.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_the_help_says_that_loading_executes_code(capsys):
    assert main(["convert", "--help"]) == 0
    assert "executes code" in " ".join(capsys.readouterr().out.split())
