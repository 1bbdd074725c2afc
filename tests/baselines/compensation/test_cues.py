"""Earlier and predicted cues."""

import numpy as np
import pytest

from motion_cueing.baselines.compensation import CompensationOptions
from motion_cueing.baselines.compensation.cues import FURTHEST, CuePredictor, earlier
from motion_cueing.envs.cues import CueTrace

OPTIONS = CompensationOptions()
REST = np.array([0.0, 0.0, -9.81])


def drive(n=400, seed=0):
    """A smooth drive of turns and changes of speed."""
    time = 0.01 * np.arange(n)
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.2, 1.0, (6, 3)), rng.uniform(0.0, 6.0, (6, 3))
    size = np.array([1.0, 1.5, 0.3, 0.03, 0.03, 0.1])
    waves = np.sin(2.0 * np.pi * frequency * time[:, None, None] + phase).mean(axis=2) * size
    return CueTrace("waves", time, REST + waves[:, :3], waves[:, 3:])


def test_earlier_cues_are_those_of_later_samples():
    cues = drive()
    shifted = earlier(cues, 7)
    assert len(shifted) == len(cues) - 7
    np.testing.assert_array_equal(shifted.specific_force, cues.specific_force[7:])
    np.testing.assert_array_equal(shifted.angular_acceleration, cues.angular_acceleration[7:])
    held = earlier(cues, 7, hold=True)
    assert len(held) == len(cues)
    np.testing.assert_array_equal(held.angular_velocity[-8:], np.tile(cues.angular_velocity[-1], (8, 1)))


def test_a_drive_shorter_than_the_lateness_holds_its_last_cues():
    cues = drive(5)
    shifted = earlier(cues, 50)
    np.testing.assert_array_equal(shifted.specific_force, np.tile(cues.specific_force[-1], (2, 1)))


def test_no_lateness_leaves_cues_as_they_are():
    cues = drive()
    assert earlier(cues, 0) is cues
    assert CuePredictor(0, OPTIONS).whole(cues) is cues


def test_samples_one_by_one_give_what_the_whole_drive_gives():
    cues, predictor = drive(), CuePredictor(9, OPTIONS)
    now = np.hstack([cues.specific_force, cues.angular_velocity])
    predictor.begin(now[0])
    one_by_one = np.array([predictor.put(sample) for sample in now])
    whole = predictor.whole(cues)
    np.testing.assert_allclose(one_by_one[:, :3], whole.specific_force, atol=1e-12)
    np.testing.assert_allclose(one_by_one[:, 3:], whole.angular_velocity, atol=1e-12)


def test_a_prediction_knows_nothing_of_the_future():
    cues = drive()
    force = np.array(cues.specific_force)
    force[200:] += 3.0
    other = CueTrace("other", cues.time, force, cues.angular_velocity)
    predicted = [CuePredictor(9, OPTIONS).whole(one).specific_force for one in (cues, other)]
    np.testing.assert_array_equal(predicted[0][:200], predicted[1][:200])
    assert not np.array_equal(predicted[0][200], predicted[1][200])


def test_predicted_yaw_is_nearer_to_what_comes_than_the_present_one():
    cues, k = drive(2000), 9
    seen, true = CuePredictor(k, OPTIONS).whole(cues).angular_velocity[:-k, 2], cues.angular_velocity[:, 2]
    error, without = np.std(seen - true[k:]), np.std(true[:-k] - true[k:])
    assert error < 0.6 * without


def test_a_car_that_stands_is_predicted_to_stand():
    n = 100
    still = CueTrace("still", 0.01 * np.arange(n), np.tile(REST, (n, 1)), np.zeros((n, 3)))
    np.testing.assert_array_equal(CuePredictor(12, OPTIONS).whole(still).specific_force, still.specific_force)


def test_predicted_changes_keep_their_limits():
    rng = np.random.default_rng(0)
    wild = CueTrace(
        "wild", 0.01 * np.arange(300), rng.normal(0, 20.0, (300, 3)), rng.normal(0, 5.0, (300, 3))
    )
    limits = CompensationOptions(force_change=0.4, rate_change=0.03)
    seen = CuePredictor(FURTHEST + 10, limits).whole(wild)
    change = np.abs(seen.specific_force - wild.specific_force)
    assert change.max() == pytest.approx(0.4)
    assert np.abs(seen.angular_velocity - wild.angular_velocity).max() == pytest.approx(0.03)
