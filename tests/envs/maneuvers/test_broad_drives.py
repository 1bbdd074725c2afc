"""Named distributions: what they draw, plausible for any seed, and held-out ones apart from training."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import welch

from motion_cueing.envs.car.simulation import RoadRoughness, simulate
from motion_cueing.envs.car.vehicles import RESERVED_CARS
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import (
    HELD_OUT_SEEDS,
    RandomDrives,
    drive_seeds,
    drives_names,
    held_out_drives,
    load_drives,
)
from motion_cueing.envs.maneuvers.bumps import with_bumps
from motion_cueing.envs.maneuvers.circuits import random_circuit
from motion_cueing.envs.maneuvers.drivers import Drivers
from motion_cueing.envs.maneuvers.roads import KINDS
from motion_cueing.envs.task import TaskOptions
from motion_cueing.envs.task.options import load_task

BROAD = load_drives("broad")


def test_names_and_task_files(tmp_path):
    assert drives_names() == ["broad", "held-out"]
    assert load_task(None, episode={"random": "broad"}).episode.random == BROAD
    (tmp_path / "task.yaml").write_text("episode: {random: broad, library: 4}\n")
    assert load_task(tmp_path / "task.yaml").episode.random == BROAD
    with pytest.raises(ConfigurationError, match="Did you mean broad"):
        load_task(None, episode={"random": "brod"})
    assert TaskOptions().episode.random == RandomDrives()


def test_broad_has_every_kind_and_no_reserved_car():
    assert min(getattr(BROAD, kind) for kind in KINDS) > 0.0
    assert not set(BROAD.cars) & set(RESERVED_CARS)
    assert set(load_drives("held-out").cars) == set(RESERVED_CARS)


@given(st.integers(0, 2**63), st.integers(1, 300))
@settings(max_examples=30)
def test_no_training_seed_is_a_held_out_one(seed, count):
    assert max(drive_seeds(count, seed)) < HELD_OUT_SEEDS


def test_held_out_drives_are_always_the_same_by_reserved_cars():
    once, again = held_out_drives(4, 8.0), held_out_drives(4, 8.0)
    for one, same in zip(once, again, strict=True):
        np.testing.assert_array_equal(one.specific_force, same.specific_force)
        assert int(one.name.rsplit("-", 1)[1]) >= HELD_OUT_SEEDS
    # A longer list begins with the same drives.
    assert [drive.name for drive in held_out_drives(6, 8.0)][:4] == [drive.name for drive in once]


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(sorted(KINDS)))
def test_any_drive_is_finite_plausible_and_begins_calm(seed, kind):
    trace = simulate([BROAD.plan(seed, 20.0, kind)])[0]
    force = trace.specific_force
    assert np.isfinite(force).all()
    assert np.isfinite(trace.angular_velocity).all()
    assert np.abs(force[:, :2]).max() < 1.6 * GRAVITY
    assert np.abs(force[:, 2] + GRAVITY).max() < 1.6 * GRAVITY
    assert trace.channels["speed_m_s"].min() > -0.3
    assert np.abs(force[0] - [0.0, 0.0, -GRAVITY]).max() < 0.1


def test_a_standing_car_feels_gravity_alone():
    drives = dataclasses.replace(BROAD, roughness=(0.0, 0.0), bumps=(0.0, 0.0))
    plans = [drives.plan(seed, 60.0, "urban") for seed in range(6)]
    stood = 0
    for trace in simulate(plans):
        # A stop has settled once the car has not moved for a second.
        still = np.abs(trace.channels["speed_m_s"]) < 1e-3
        settled = np.convolve(still, np.ones(100))[: len(still)] == 100
        stood += settled.sum()
        size = np.linalg.norm(trace.specific_force[settled], axis=1)
        np.testing.assert_allclose(size, GRAVITY, atol=0.02)
    assert stood > 100


def test_a_drive_belongs_to_its_seed_alone_or_in_a_batch():
    plans = [BROAD.plan(seed, 15.0) for seed in (3, 4, 5)]
    together = simulate(plans)
    for plan, trace in zip(plans, together, strict=True):
        np.testing.assert_array_equal(simulate([plan])[0].specific_force, trace.specific_force)


def test_drivers_differ_and_a_standard_driver_does_not():
    plans = [BROAD.plan(seed, 5.0) for seed in range(8)]
    assert len({plan.driver.lane_wander for plan in plans}) == 8
    assert all(RandomDrives().plan(seed, 5.0).driver is None for seed in range(4))
    with pytest.raises(ConfigurationError, match="pace"):
        Drivers(pace=(1.2, 0.8))


@pytest.mark.parametrize("seed", range(8))
def test_a_circuit_returns_to_its_start(seed):
    """Integrated as plane geometry by complex numbers, not by the path's own arithmetic."""
    circuit = random_circuit(np.random.default_rng(seed), 0.1)
    heading = np.concatenate(([0.0], np.cumsum(0.5 * circuit.curvature)))
    middle = 0.5 * (heading[1:] + heading[:-1])
    assert abs(np.sum(0.5 * np.exp(1j * middle))) < 3.0
    assert abs(heading[-1]) == pytest.approx(2.0 * np.pi, abs=1e-6)
    assert np.abs(circuit.curvature).max() < 1.0 / 7.0
    # Corners lean to their inside.
    assert np.sum(circuit.bank * circuit.curvature) > 0.0


def test_the_rough_kind_has_the_spectrum_of_iso_8608():
    """Slope -2 and G(n0) of a broken road without bumps, by Welch's method."""
    tracks = RoadRoughness.drawn(1024e-6, 20_000.0, np.random.default_rng(0))
    n, density = welch(tracks.left, fs=10.0, nperseg=4096)
    band = (n > 0.02) & (n < 1.0)
    expected = 1024e-6 * (n[band] / 0.1) ** -2.0
    assert np.exp(np.mean(np.log(density[band] / expected))) == pytest.approx(1.0, rel=0.15)


def test_bumps_come_as_often_as_asked_and_at_most_7_cm():
    smooth = RoadRoughness(np.zeros(200_001), np.zeros(200_001))
    bumpy = with_bumps(smooth, 5.0, np.random.default_rng(1))
    touched = (bumpy.left != 0.0) | (bumpy.right != 0.0)
    events = np.sum(np.diff(touched.astype(int)) == 1)
    assert 60 < events < 140
    assert 0.05 < max(np.abs(bumpy.left).max(), np.abs(bumpy.right).max()) < 0.15
    assert not touched[:500].any()


def test_dampers_that_pass_on_the_wheels_speed_make_a_road_harsher_above_4_hz():
    plan = RandomDrives(roughness=(256.0, 256.0)).plan(3, 40.0, "rural")
    rough = dataclasses.replace(plan, roughness=dataclasses.replace(plan.roughness, harshness=1.0))
    power = []
    for trace in simulate([plan, rough]):
        f, density = welch(trace.specific_force[:, 2], fs=100.0, nperseg=1024)
        power.append(density[(f > 4.0) & (f < 10.0)].sum())
    assert power[1] > 4.0 * power[0]
