"""Uneven roads: spectrum of ISO 8608, a body on springs as an integrator has it, what slopes must give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import csd, welch

from motion_cueing.envs.car import get_car
from motion_cueing.envs.car.simulation import SPACING, RoadRoughness, _sprung, shaking
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import RandomDrives, random_drive, random_drives
from motion_cueing.envs.settings import from_dict

CAR = get_car("sedan")
ROUGH = RandomDrives(roughness=(256.0, 256.0))
DT = 0.01


def test_tracks_have_the_spectrum_of_iso_8608():
    road = RoadRoughness.drawn(64e-6, 40_000.0, np.random.default_rng(0))
    for side in (road.left, road.right):
        n, density = welch(side, 1.0 / SPACING, nperseg=8192)
        for low, high in ((0.2, 0.5), (0.5, 1.0), (1.0, 2.0)):
            there = (n >= low) & (n < high)
            assert np.mean(density[there] * (n[there] / 0.1) ** 2) == pytest.approx(64e-6, rel=0.15)
    n, shared = csd(road.left, road.right, 1.0 / SPACING, nperseg=8192)
    coherence = np.abs(shared) / np.sqrt(
        welch(road.left, nperseg=8192)[1] * welch(road.right, nperseg=8192)[1] * SPACING**2
    )
    assert np.mean(coherence[(n > 0.01) & (n < 0.03)]) > 0.7
    assert np.mean(coherence[(n > 1.0) & (n < 2.0)]) < 0.2


def test_a_body_on_a_spring_moves_as_an_integrator_says():
    frequency, ratio, times = 8.0, 0.3, DT * np.arange(300)
    base = 0.02 * np.sin(5.0 * times) + 0.01 * times
    found = _sprung(base, frequency, ratio, DT)

    def motion(t, y):
        u = np.interp(t, times, base)
        return [y[1], frequency**2 * (u - y[0]) - 2.0 * ratio * frequency * y[1]]

    solved = solve_ivp(motion, (0.0, times[-1]), (0.0, 0.0), t_eval=times, rtol=1e-9, atol=1e-12, max_step=DT)
    np.testing.assert_allclose(found[0], solved.y[0], atol=1e-6)
    np.testing.assert_allclose(found[1], solved.y[1], atol=1e-5)
    acceleration = [motion(t, y)[1] for t, y in zip(times, solved.y.T, strict=True)]
    np.testing.assert_allclose(found[2], acceleration, atol=1e-4)


@pytest.mark.parametrize(("pitch", "roll"), [(0.02, 0.0), (0.0, 0.01), (-0.01, 0.02)])
def test_a_leaning_road_leans_the_car(pitch, roll):
    """After a smooth piece both tracks rise by ``pitch``, and the right one lies lower by ``roll``."""
    distance = 10.0 * DT * np.arange(3000)
    stations = SPACING * np.arange(4000)
    rise = pitch * np.maximum(stations - 20.0, 0.0)
    lean = 0.5 * roll * 0.85 * CAR.width * np.clip(stations - 20.0, 0.0, 1.0)
    added = shaking(CAR, RoadRoughness(rise + lean, rise - lean), distance, DT)
    settled = np.array([GRAVITY * pitch, -GRAVITY * roll, 0.0])
    np.testing.assert_allclose(added.force[-1], settled, atol=1e-3)
    np.testing.assert_allclose(added.rate[-1], 0.0, atol=1e-5)
    np.testing.assert_allclose(DT * added.rate.sum(axis=0), [roll, pitch, 0.0], atol=2e-4)
    np.testing.assert_array_equal(added.force[:100], 0.0)


def test_angular_accelerations_are_derivatives_of_the_rates():
    trace = random_drive(3, 20.0, kind="rural", drives=ROUGH)
    smooth = random_drive(3, 20.0, kind="rural")
    rate = trace.angular_velocity - smooth.angular_velocity
    slope = trace.angular_acceleration - smooth.angular_acceleration
    middle = 0.5 * (slope[1:] + slope[:-1])
    np.testing.assert_allclose(np.diff(rate, axis=0) / DT, middle, atol=0.05 * np.abs(slope).max())
    assert np.abs(slope).max() > 0.1


def test_rough_roads_shake_and_leave_the_rest_of_the_drive_as_it_was():
    smooth = random_drives(6, 30.0, seed=2, kind="urban")
    rough = random_drives(6, 30.0, seed=2, kind="urban", drives=ROUGH)
    rougher = random_drives(6, 30.0, seed=2, kind="urban", drives=RandomDrives(roughness=(1024.0, 1024.0)))
    for a, b, c in zip(smooth, rough, rougher, strict=True):
        np.testing.assert_array_equal(a.channels["speed_m_s"], b.channels["speed_m_s"])
        once, twice = b.specific_force - a.specific_force, c.specific_force - a.specific_force
        # Heights go with the square root of the roughness.
        np.testing.assert_allclose(twice, 2.0 * once, atol=1e-9)
        np.testing.assert_array_equal(b.angular_velocity[:, 2], a.angular_velocity[:, 2])
    shaken = np.concatenate([b.specific_force - a.specific_force for a, b in zip(smooth, rough, strict=True)])
    assert 0.1 < shaken[:, 2].std() < 0.4


def test_the_same_seed_gives_the_same_road_alone_and_in_a_batch():
    one = random_drive(11, 20.0, drives=ROUGH)
    np.testing.assert_array_equal(one.specific_force, random_drive(11, 20.0, drives=ROUGH).specific_force)
    calm = random_drive(11, 20.0, drives=RandomDrives(roughness=(0.0, 256.0)))
    assert np.abs(calm.specific_force - one.specific_force).max() > 0.0


def test_a_range_that_is_none_is_refused():
    with pytest.raises(ConfigurationError, match="roughness must be a range"):
        from_dict(RandomDrives, {"roughness": [100.0, 10.0]}, "random")
