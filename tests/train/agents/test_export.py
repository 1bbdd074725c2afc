"""ONNX files hold what the agent computes, and say what it means."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from motion_cueing.cli.main import main
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.train.agents import Network, export
from motion_cueing.train.agents.export import ExportError, export_onnx
from motion_cueing.train.networks import TorchNetwork

from . import agent, network


@pytest.fixture(autouse=True)
def few_timings(monkeypatch):
    monkeypatch.setattr(export, "_TIMED", 20)
    monkeypatch.setattr(export, "_WARM_UP", 5)


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu", "silu"])
@pytest.mark.parametrize(("squash", "skip", "normalized"), [("clip", True, True), ("tanh", False, False)])
def test_pytorch_computes_what_numpy_does(activation, squash, skip, normalized):
    net = network((20, 32, 24, 5), activation=activation, squash=squash, skip=skip, normalized=normalized)
    observation = np.random.default_rng(1).normal(scale=3.0, size=(100, 20)).astype(np.float32)
    with torch.no_grad():
        found = TorchNetwork(net)(torch.from_numpy(observation)).numpy()
    assert np.abs(found - net(observation)).max() < 3e-6


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu", "silu"])
def test_the_file_computes_what_the_agent_does(activation, tmp_path):
    one = agent(activation=activation, skip=True)
    found = export_onnx(one, tmp_path / "a.onnx")
    assert max(found.torch_difference, found.numpy_difference) <= 1e-5
    assert found.size == (tmp_path / "a.onnx").stat().st_size
    assert 0.0 < found.mean <= found.longest
    session = onnxruntime.InferenceSession(tmp_path / "a.onnx", providers=["CPUExecutionProvider"])
    seen = np.random.default_rng(5).normal(size=(3, one.layout.size)).astype(np.float32)
    (action,) = session.run(["action"], {"observation": seen})
    assert np.allclose(action, one.predict(seen)[0], atol=1e-5)
    assert session.run(["action"], {"observation": seen[:1]})[0].shape == (1, 9)


def test_the_file_says_what_its_numbers_mean(tmp_path):
    task = TaskOptions(
        observation=ObservationOptions(preview=2), action=ActionOptions(mode="jerk", authority=0.5, repeat=4)
    )
    one = agent(task)
    export_onnx(one, tmp_path / "a.onnx")
    model = onnx.load(tmp_path / "a.onnx")
    onnx.checker.check_model(model, full_check=True)
    assert model.opset_import[0].version == 18
    told = {entry.key: entry.value for entry in model.metadata_props}
    rows = json.loads(told["rows"])
    assert sum(row["size"] for row in rows) * json.loads(told["stack"]) == one.layout.size
    assert {"name": "preview", "unit": "10 m/s^2, rad/s"}.items() <= rows[-1].items()
    action = json.loads(told["action"])
    assert (action["mode"], action["repeat"], len(action["scale"])) == ("jerk", 4, 9)
    assert json.loads(told["record"])["seed"] == one.record.seed
    assert told["name"] == one.name


def test_a_file_that_computes_something_else_is_not_written(tmp_path, monkeypatch):
    one = agent()
    other = replace(one, network=network((one.layout.size, 8, 9), seed=9))
    monkeypatch.setattr("motion_cueing.train.networks.TorchNetwork", lambda net: TorchNetwork(other.network))
    with pytest.raises(ExportError, match="nothing was written"):
        export_onnx(one, tmp_path / "a.onnx")
    assert not list(tmp_path.iterdir())


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(export, "import_module", missing)
    with pytest.raises(ExportError, match=r"export needs torch: pip install 'motion-cueing-gym\[export\]'"):
        export_onnx(agent(), tmp_path / "a.onnx")


def test_the_command_exports_and_reports(tmp_path, capsys):
    agent(name="mine").save(tmp_path / "a.safetensors")
    words = ["export", "--policy", str(tmp_path / "a.safetensors"), "--out", str(tmp_path / "a.onnx")]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "a.onnx: mine" in said
    for word in ("10,000 observations", "from PyTorch", "from NumPy", "mean", "p99", "max", "us"):
        assert word in said


@pytest.mark.parametrize(
    ("policy", "out", "told"),
    [
        ("a.safetensors", "a.txt", "--out a.txt: name a file that ends in .onnx"),
        ("none.safetensors", "a.onnx", "there is no such file"),
        ("a.yaml", "a.onnx", "is no trained network"),
        ("nosuch", "a.onnx", "nosuch"),
    ],
)
def test_wrong_arguments_of_the_command(policy, out, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    agent().save("a.safetensors")
    (tmp_path / "a.yaml").write_text("name: washout\nsource: none\n")
    assert main(["export", "--policy", policy, "--out", out]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / out).exists()


def test_a_single_layer_is_exported(tmp_path):
    one = agent()
    linear = Network((np.full((9, one.layout.size), 0.01),), (np.zeros(9),))
    assert export_onnx(replace(one, network=linear), tmp_path / "a.onnx").torch_difference < 1e-6
