"""Parameters of predictive controllers, good and bad."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace

import pytest

from motion_cueing.baselines import symbolic as library
from motion_cueing.baselines.mpc import (
    Forecast,
    Margins,
    MpcParameters,
    load_mpc,
    mpc_presets,
    solver,
)
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.settings import save


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"nodes": (0.01, 0.5, 0.3)}, "nodes must increase"),
        ({"nodes": (0.001, 0.5)}, "nodes must increase from at least 0.01"),
        ({"nodes": (0.01,)}, "nodes"),
        ({"nodes": (0.01, 0.1), "every": 20}, "every = 20"),
        ({"every": 0}, "every"),
        ({"objective": "comfort"}, "objective"),
        ({"penalty": 0.0}, "penalty"),
        ({"rounds": 0}, "rounds"),
        ({"horizon": 3.0}, "unknown field 'horizon'"),
        ({"forecast": {"preview": -1.0}}, "preview"),
        ({"margins": {"rate": 1.5}}, "rate"),
        ({"weights": {"tilt": {"position": float("nan")}}}, "position"),
        ({"iterations": 0}, "iterations"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_bad_parameters_are_refused(fields, told):
    with pytest.raises(ConfigurationError, match=told):
        MpcParameters(**fields)


def test_an_unknown_model_of_perception_is_named():
    from motion_cueing.baselines.mpc import make_mpc
    from motion_cueing.envs.platform import get_platform

    parameters = MpcParameters(objective="perceived", vestibular="zacharas", compile=False)
    with pytest.raises(UnknownNameError, match="zacharias"):
        make_mpc(get_platform("paper"), parameters)


def test_parameters_round_trip_through_yaml(tmp_path):
    mine = MpcParameters(
        nodes=(0.02, 0.5),
        forecast=Forecast(preview=0.4),
        margins=Margins(rate=0.5),
        nonlinear=True,
        iterations=3,
        tolerance=0.1,
    )
    save(mine, tmp_path / "mine.yaml")
    assert load_mpc(tmp_path / "mine.yaml") == mine


def test_a_file_of_the_nonlinear_controller_of_before_is_read(tmp_path):
    file = tmp_path / "old.yaml"
    file.write_text("algorithm: nmpc\nmpc: {nodes: [0.02, 0.5], forecast: {preview: 0.4}}\niterations: 3\n")
    expected = MpcParameters(nodes=(0.02, 0.5), forecast=Forecast(preview=0.4), nonlinear=True, iterations=3)
    assert load_mpc(file) == expected
    file.write_text("algorithm: nmpc\nmpc: 3\n")
    with pytest.raises(ConfigurationError, match=r"old\.yaml: field 'mpc'"):
        load_mpc(file)


def test_sets_go_by_name_and_differ_in_what_they_know():
    assert mpc_presets() == ["mpc", "mpc-full", "mpc-preview", "mpc-tuned", "nmpc", "nmpc-preview"]
    mpc, tuned = load_mpc("mpc"), load_mpc("mpc-tuned")
    assert tuned.weights != mpc.weights
    assert replace(tuned, weights=mpc.weights, forecast=mpc.forecast) == mpc
    assert tuned.forecast.preview == 0.0
    for name in ("mpc", "mpc-preview"):
        assert load_mpc(f"n{name}") == replace(load_mpc(name), nonlinear=True)
    known = [load_mpc(name).forecast.preview for name in ("mpc", "mpc-preview")]
    assert known == [0.0, 2.0]
    full = load_mpc("mpc-full")
    assert full.forecast.preview >= full.horizon
    with pytest.raises(UnknownNameError, match="mpc-preview"):
        load_mpc("mpc-previw")
    with pytest.raises(DataError, match="cannot be read"):
        load_mpc("nowhere.yaml")


@pytest.mark.parametrize(("name", "user"), [("casadi", library), ("daqp", solver)])
def test_a_missing_library_is_named_with_its_remedy(monkeypatch, name, user):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ConfigurationError, match=r"pip install 'motion-cueing-gym\[optimal\]'"):
        importlib.reload(user)
