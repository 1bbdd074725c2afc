"""Machines as configurations: presets, YAML, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from motion_cueing.envs.errors import ConfigurationError, DataError, GeometryError, UnknownNameError
from motion_cueing.envs.platform import (
    Carriage,
    Hexapod,
    Platform,
    Turntable,
    actuator_limits,
    get_platform,
    load_platform,
    platform_names,
)
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.platform.presets import neutral_height, paired_hexapod
from motion_cueing.envs.settings import save, to_dict

from .platforms_under_test import PRESETS, sluggish


def broken(**fields) -> dict:
    """The paper's machine as plain values, with fields of its hexapod replaced."""
    values = to_dict(get_platform("paper"))
    values["hexapod"].update(fields)
    return values


def load(values: object, folder) -> Platform:
    path = folder / "machine.yaml"
    path.write_text(yaml.safe_dump(values))
    return load_platform(path)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_round_trip_through_yaml(name, tmp_path):
    for platform in (PRESETS[name], sluggish(PRESETS[name])):
        save(platform, tmp_path / "machine.yaml")
        assert load_platform(tmp_path / "machine.yaml") == platform


def test_presets_are_what_is_published():
    assert {"paper", "dim-hexapod", "24-inch", "nads-1"} <= set(platform_names())
    paper, dim = PRESETS["paper"], PRESETS["dim-hexapod"]
    assert paper.hexapod.extension == (-0.67, 0.67)
    assert paper.carriage.travel_x == paper.carriage.travel_y == (-13.72, 13.72)
    assert paper.turntable.travel is None
    np.testing.assert_allclose(paper.hexapod.neutral_lengths, 2.750, atol=1e-3)
    np.testing.assert_allclose(dim.hexapod.neutral_lengths, 1.210, atol=1e-3)
    table = PRESETS["24-inch"].hexapod
    np.testing.assert_allclose(table.neutral_lengths + table.extension[0], 1.1604, atol=1e-9)
    np.testing.assert_allclose(table.neutral_lengths + table.extension[1], 1.7700, atol=1e-9)
    assert PRESETS["nads-1"].carriage.travel_x == (-9.75, 9.75)


def test_presets_are_frozen():
    with pytest.raises(AttributeError):
        PRESETS["paper"].hexapod.velocity = 2.0


def test_missing_subsystems_are_locked_at_zero():
    platform = PRESETS["paper"].without_carriage().without_turntable()
    limits = actuator_limits(platform)
    for actuator in (0, 1, 8):
        assert limits["position_min"][actuator] == limits["position_max"][actuator] == 0.0
    assert np.isinf(actuator_limits(PRESETS["paper"])["position_max"][8])
    assert platform.name == "paper, no carriage, no turntable"


def test_unknown_machines_name_the_nearest():
    with pytest.raises(UnknownNameError, match=r"unknown platform 'papper'\. Did you mean paper"):
        get_platform("papper")


def test_unknown_fields_are_refused(tmp_path):
    values = to_dict(PRESETS["paper"])
    values["carriage"]["travel"] = [0.0, 1.0]
    with pytest.raises(ConfigurationError, match=r"unknown field 'carriage\.travel'"):
        load(values, tmp_path)


def test_missing_fields_are_named(tmp_path):
    values = to_dict(PRESETS["paper"])
    del values["hexapod"]["neutral"]
    with pytest.raises(ConfigurationError, match=r"'hexapod\.neutral' is missing"):
        load(values, tmp_path)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("velocity", 0.0),
        ("velocity", -1.0),
        ("acceleration", float("nan")),
        ("acceleration", float("inf")),
        ("velocity", "fast"),
        ("neutral", [0.0, 0.0]),
        ("upper_joints", [[0.0, 0.0, 0.0]] * 5),
        ("dynamics", {"damping": 0.5}),
        ("dynamics", {"dead_time": -0.1}),
    ],
)
def test_fields_out_of_range_are_named(field, value, tmp_path):
    with pytest.raises(ConfigurationError, match=rf"hexapod\.{field}"):
        load(broken(**{field: value}), tmp_path)


@pytest.mark.parametrize("extension", [[0.1, 0.5], [-0.5, -0.1], [-3.0, 0.5]])
def test_travel_that_leaves_out_neutral_or_the_leg_is_refused(extension, tmp_path):
    with pytest.raises(ConfigurationError, match="extension"):
        load(broken(extension=extension), tmp_path)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Carriage(travel_x=(1.0, 2.0), travel_y=(-1.0, 1.0), velocity=1.0, acceleration=1.0),
        lambda: Turntable(travel=(-2.0, -1.0), velocity=1.0, acceleration=1.0),
    ],
)
def test_travel_that_leaves_out_zero_is_refused(make):
    with pytest.raises(ConfigurationError, match="must contain 0"):
        make()


def test_lags_that_would_overshoot_are_refused():
    with pytest.raises(ValueError, match="damping"):
        ActuatorDynamics(natural_frequency=10.0, damping=0.7)


def vertical(joints) -> Hexapod:
    """Six parallel legs: they hold nothing sideways."""
    return Hexapod(
        upper_joints=joints,
        lower_joints=joints,
        neutral=(0.0, 0.0, -1.0),
        extension=(-0.1, 0.1),
        velocity=1.0,
        acceleration=1.0,
    )


def test_parallel_legs_are_singular_at_neutral(tmp_path):
    joints = PRESETS["paper"].hexapod.upper_joints
    platform = replace(PRESETS["paper"], hexapod=vertical(joints))
    save(platform, tmp_path / "machine.yaml")
    with pytest.raises(GeometryError, match="singular at neutral"):
        load_platform(tmp_path / "machine.yaml")


def test_legs_that_meet_one_point_are_singular_at_neutral(tmp_path):
    # A smaller copy of the base right above it: produced upwards, all legs meet one point.
    upper = [[0.5 * x for x in joint] for joint in PRESETS["paper"].hexapod.lower_joints]
    with pytest.raises(GeometryError, match="singular at neutral"):
        load(broken(upper_joints=upper), tmp_path)


def test_joints_at_one_point_are_refused(tmp_path):
    with pytest.raises(GeometryError, match="upper_joints"):
        load(broken(upper_joints=[[0.0, 0.0, 0.0]] * 6), tmp_path)


def test_legs_too_short_to_close_are_refused():
    upper, lower = paired_hexapod((0.7, 0.25), (1.15, 0.25))
    assert neutral_height(upper, lower, 1.210)[2] == pytest.approx(-0.9055, abs=1e-3)
    with pytest.raises(GeometryError, match="cannot close"):
        neutral_height(upper, lower, 0.5)


@pytest.mark.parametrize("text", ["", "- 1\n", "{name: [", "\x00"])
def test_files_that_hold_no_machine_are_refused(text, tmp_path):
    path = tmp_path / "machine.yaml"
    path.write_text(text)
    with pytest.raises((ConfigurationError, DataError), match=r"machine\.yaml"):
        load_platform(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DataError, match=r"nowhere\.yaml"):
        load_platform(tmp_path / "nowhere.yaml")
