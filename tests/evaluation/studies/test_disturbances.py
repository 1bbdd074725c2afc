"""Disturbances: each changes one thing, and the controller does not know."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.car import get_car
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.evaluation.results import drive_key
from motion_cueing.evaluation.rollout import rollout
from motion_cueing.evaluation.studies import disturbances
from motion_cueing.evaluation.studies.disturbances import Disturbances, Study, time_scaled

from .bends import PAPER, SEDAN, bend


def test_the_same_way_twice_as_fiercely():
    """A bend keeps its radius a / w^2 and its total angle; roll and pitch, as gravity in f, double."""
    cues = bend(seconds=6.0)
    fierce = time_scaled(cues, 2.0)
    speed = np.sqrt(2.0)
    assert fierce.dt == pytest.approx(cues.dt)
    assert fierce.duration == pytest.approx(cues.duration / speed, abs=0.011)
    inside = fierce.time * speed <= cues.duration
    at = fierce.time[inside] * speed

    def before(values):
        return np.stack([np.interp(at, cues.time, column) for column in values.T], axis=1)

    rest = [0.0, 0.0, -9.81]
    np.testing.assert_allclose(
        fierce.specific_force[inside] - rest, 2.0 * (before(cues.specific_force) - rest), atol=1e-3
    )
    yaw = fierce.angular_velocity[inside, 2]
    np.testing.assert_allclose(yaw, speed * before(cues.angular_velocity)[:, 2], atol=1e-4)
    turned = [c.angular_velocity.sum(axis=0) * c.dt for c in (cues, fierce)]
    np.testing.assert_allclose(turned[1], turned[0] * [2.0, 2.0, 1.0], atol=3e-3)
    change = np.gradient(fierce.angular_velocity, fierce.dt, axis=0)
    np.testing.assert_allclose(change[2:-2], fierce.angular_acceleration[2:-2], atol=2e-3)


def test_no_fiercer_is_the_same():
    cues = bend()
    same = time_scaled(cues, 1.0)
    np.testing.assert_array_equal(same.specific_force, cues.specific_force)
    np.testing.assert_array_equal(same.time, cues.time)


def robust(causal=(), known=()):
    def maneuvers(car):
        return {"bend": lambda: bend(force=1.0 if car.name == "sedan" else 1.5)}

    return Study(PAPER, SEDAN, get_car("volvo-v40"), maneuvers, Disturbances(known=known), frozenset(causal))


def test_each_condition_of_robustness_disturbs_one_thing():
    found = {one.name: one for one in robust().conditions()}
    assert list(found) == ["nominal", "lag", "dead time", "noise", "other car", "time scaling"]
    assert found["lag"].platform.hexapod.dynamics.natural_frequency == 30.0
    assert found["dead time"].platform.carriage.dynamics.dead_time == 0.05
    for name in ("nominal", "noise", "other car", "time scaling"):
        assert found[name].platform == PAPER
    peaks = {name: np.abs(one.maneuvers["bend"]().specific_force[:, 1]).max() for name, one in found.items()}
    assert peaks["other car"] == pytest.approx(1.5 * peaks["nominal"])
    assert peaks["time scaling"] == pytest.approx(2.0 * peaks["nominal"], rel=1e-3)
    assert peaks["noise"] == peaks["lag"] == peaks["nominal"]


def test_dead_time_delays_what_is_felt_and_the_controller_does_not_know():
    found = {one.name: one for one in robust().conditions()}
    felt = {}
    for name in ("nominal", "dead time"):
        one = found[name]
        felt[name] = rollout(one.make("classical"), one.maneuvers["bend"](), one.platform).w_simulator[:, 2]
    np.testing.assert_allclose(felt["dead time"][5:], felt["nominal"][:-5], atol=1e-9)


def test_late_machines_are_driven_with_and_without_what_is_known_of_them():
    found = {one.name: one for one in robust(known=(1.0, 0.7)).conditions()}
    assert list(found)[6:] == ["late", "late, compensated", "late, compensated, known ×0.7"]
    assert found["late"].description == "lag and dead time at once: 117 ms late"
    plain, known, short = (found[name].make("learned-preview") for name in list(found)[6:])
    # 2 s, dead time and 2 / 45 s; 70 % of the dead time, and 2 / 45 s of a known lag of 30 / 0.7.
    assert plain.information.seconds == pytest.approx(2.0)
    assert known.information.seconds == pytest.approx(2.09)
    assert short.information.seconds == pytest.approx(2.08)
    keys = {drive_key(about=dict(one.about)) for one in list(found.values())[6:]}
    assert len(keys) == 3


def test_an_agent_meets_a_machine_it_does_not_know():
    lagging = robust().conditions()[1]
    assert lagging.make("learned-preview").platform == lagging.platform


def test_a_policy_that_knows_the_drive_is_refused_where_it_must_be_causal():
    make = robust(["classical-per-maneuver"]).conditions()[0].make
    with pytest.raises(ConfigurationError, match="knows the drive"):
        make("classical-per-maneuver")
    assert robust().conditions()[0].make("classical-per-maneuver") is not None


def test_drives_under_noise_of_another_definition_are_not_of_the_same(monkeypatch):
    def key():
        noisy = next(one for one in robust().conditions() if one.name == "noise")
        return drive_key(about=dict(noisy.about), cues=bend().digest())

    before = key()
    assert key() == before
    monkeypatch.setattr(disturbances, "NOISE_VERSION", disturbances.NOISE_VERSION + 1)
    assert key() != before
