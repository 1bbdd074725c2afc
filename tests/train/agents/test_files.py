"""An agent's file: the same agent comes back, and nothing broken or foreign is taken for one."""

from __future__ import annotations

import json
import struct
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from motion_cueing.envs.errors import ConfigurationError, DataError, MotionCueingError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.task import ActionOptions, EpisodeOptions, ObservationOptions, TaskOptions
from motion_cueing.train.agents import Agent, agent_names, get_agent
from motion_cueing.train.agents import names as shipped
from motion_cueing.train.agents.files import FORMAT, checksum, read, write

from . import agent

pytestmark = pytest.mark.slow

TASKS = {
    "default": (TaskOptions(), None),
    "preview": (
        TaskOptions(
            observation=ObservationOptions(preview=3, perceived=True, stack=2),
            action=ActionOptions(mode="jerk", repeat=5, frozen=("turntable",)),
            episode=EpisodeOptions(library=4),
        ),
        None,
    ),
    "residual": (TaskOptions(action=ActionOptions(mode="residual", authority=0.2)), "est1"),
    "gains": (TaskOptions(action=ActionOptions(mode="gains"), platform="24-inch"), "classical"),
    "own machine": (TaskOptions(platform=get_platform("paper").without_turntable()), None),
}


@pytest.fixture
def path(tmp_path):
    """A saved agent."""
    agent().save(tmp_path / "a.safetensors")
    return tmp_path / "a.safetensors"


def rewritten(path, change) -> None:
    """Write the file anew after a change of its values, with a fitting checksum."""
    arrays, values = read(path)
    change(arrays, values)
    write(path, arrays, values)


@pytest.mark.parametrize("name", list(TASKS))
def test_the_same_agent_comes_back(name, tmp_path):
    task, base = TASKS[name]
    one = agent(task, base, activation="elu", squash="tanh", skip=True, clip=4.0)
    one.save(tmp_path / "one.safetensors")
    other = Agent.load(str(tmp_path / "one.safetensors"))
    assert (other.name, other.task, other.record, other.base) == (one.name, one.task, one.record, one.base)
    for field in ("activation", "squash", "skip", "clip"):
        assert getattr(other.network, field) == getattr(one.network, field)
    seen = np.random.default_rng(0).normal(size=(50, one.layout.size))
    assert np.array_equal(other.predict(seen)[0], one.predict(seen)[0])
    assert other.platform == one.platform


def test_without_normalization(tmp_path):
    one = agent(normalized=False)
    one.save(tmp_path / "one.safetensors")
    other = Agent.load(tmp_path / "one.safetensors")
    assert other.network.mean is None
    assert other.network.variance is None


def test_the_same_agent_gives_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        agent().save(tmp_path / f"{name}.safetensors")
    assert (tmp_path / "one.safetensors").read_bytes() == (tmp_path / "two.safetensors").read_bytes()
    with pytest.raises(ConfigurationError, match=r"ends in \.safetensors"):
        agent().save(tmp_path / "one.pkl")
    assert len(list(tmp_path.iterdir())) == 2


def test_missing_and_foreign_files_are_refused(tmp_path):
    with pytest.raises(DataError, match="there is no such file"):
        Agent.load(tmp_path / "none.safetensors")
    with pytest.raises(DataError, match="cannot be read"):
        Agent.load(tmp_path)
    foreign = tmp_path / "foreign.safetensors"
    for content in (b"", b"PK\x03\x04" * 9, b"\x80\x04\x95" + bytes(40), b"name: washout\nsource: none\n"):
        foreign.write_bytes(content)
        with pytest.raises(DataError, match=r"not an agent; expected a \.safetensors file"):
            Agent.load(foreign)
    save_file({"weight": np.zeros(3)}, foreign, metadata={"format": "pt"})
    with pytest.raises(DataError, match="not an agent"):
        Agent.load(foreign)


def test_a_newer_version_is_refused(path):
    arrays, _ = read(path)
    about = {"format": FORMAT + 1, "whatever": 1}
    save_file(arrays, path, metadata={"motion-cueing-agent": json.dumps(about)})
    with pytest.raises(DataError, match="format 2, this package reads 1; update motion-cueing-gym"):
        Agent.load(path)


@pytest.mark.parametrize(
    "about", ["{", "[]", '{"format": "new"}', '{"format": 1}', '{"format": 1, "sha256": ""}']
)
def test_a_damaged_description_is_refused(path, about):
    arrays, _ = read(path)
    save_file(arrays, path, metadata={"motion-cueing-agent": about})
    with pytest.raises(DataError, match="damaged"):
        Agent.load(path)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_no_flipped_bit_and_no_cut_goes_unnoticed(data, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "flipped.safetensors"
    agent().save(path)
    whole = path.read_bytes()
    Agent.load(path)
    header = struct.unpack("<Q", whole[:8])[0]
    where = data.draw(st.integers(0, len(whole) - 1) | st.integers(0, header + 8), label="byte")
    if data.draw(st.booleans(), label="cut"):
        path.write_bytes(whole[:where])
    else:
        flipped = bytearray(whole)
        flipped[where] ^= 1 << data.draw(st.integers(0, 7), label="bit")
        path.write_bytes(bytes(flipped))
    try:
        found = Agent.load(path)
    except MotionCueingError:
        return
    # Spaces between the header's words carry nothing.
    arrays, values = read(path)
    found.save(path)
    assert path.read_bytes() == whole
    assert checksum(arrays, values) == checksum(*read(path))


def test_another_checksum_for_every_change(path):
    arrays, values = read(path)
    before = checksum(arrays, values)
    assert checksum(arrays, {**values, "name": "other"}) != before
    assert checksum({**arrays, "more": np.zeros(1)}, values) != before
    name = "layers.0.weight"
    assert checksum({**arrays, name: arrays[name].T.copy()}, values) != before


@pytest.mark.parametrize(
    ("change", "error", "told"),
    [
        (
            lambda a, v: v["task"].update(platform="holo"),
            ConfigurationError,
            "unknown platform 'holo",
        ),
        (lambda a, v: v["task"]["action"].update(moed="jerk"), ConfigurationError, "unknown field.*moed"),
        (lambda a, v: v["task"]["action"].update(mode="warp"), ConfigurationError, "task.action.mode"),
        (lambda a, v: v["task"]["action"].update(mode="gains"), ConfigurationError, "'gains' needs a base"),
        (lambda a, v: v["task"]["observation"].update(preview=2), DataError, "entries of observation"),
        (
            lambda a, v: v["platform"]["hexapod"].update(velocity=9.0),
            ConfigurationError,
            "in hexapod",
        ),
        (lambda a, v: v["record"].update(seed="x"), ConfigurationError, "record.seed"),
        (lambda a, v: v.update(activation="gelu"), ConfigurationError, "activation"),
        (lambda a, v: v.update(layers=2), DataError, "missing or unknown: layers.2.bias"),
        (lambda a, v: a.pop("layers.1.bias"), DataError, "missing or unknown: layers.1.bias"),
        (lambda a, v: a.pop("observation.mean"), DataError, "mean and variance together"),
        (lambda a, v: a.update({"layers.2.bias": np.zeros(8)}), DataError, "biases 2"),
        (lambda a, v: a.update({"layers.2.bias": np.full(9, np.inf)}), DataError, "not finite"),
    ],
)
def test_what_does_not_fit_is_refused(change, error, told, path):
    rewritten(path, change)
    with pytest.raises(error, match=told):
        Agent.load(path)


def test_words_about_a_machine_may_change(path):
    rewritten(path, lambda arrays, values: values["platform"].update(description="as it was called then"))
    assert Agent.load(path).platform == get_platform("paper")


def test_agents_of_the_package_have_names(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "FOLDER", tmp_path / "none")
    assert agent_names() == []
    with pytest.raises(DataError, match="no agent comes with this package"):
        get_agent("fast")
    monkeypatch.setattr(shipped, "FOLDER", tmp_path)
    agent(name="fast").save(tmp_path / "fast.safetensors")
    assert agent_names() == ["fast"]
    assert get_agent("fast").name == "fast"
    with pytest.raises(UnknownNameError, match="Did you mean fast"):
        get_agent("fats")


def test_every_shipped_agent_loads_and_is_called_as_its_file():
    names = agent_names()
    assert [get_agent(name).name for name in names] == names


def test_reading_needs_no_learning_library(path):
    code = (
        "import sys\nfrom motion_cueing.train.agents import Agent\n"
        f"Agent.load({str(path)!r})\n"
        "print([n for n in ('torch', 'stable_baselines3', 'onnx', 'onnxruntime') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
