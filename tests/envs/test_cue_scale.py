"""Motion scale: what it does to cues, and where it is applied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.cues import GRAVITY, UNSCALED, CueScale, CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task.episode import library_of
from motion_cueing.envs.task.options import EpisodeOptions, RandomizationOptions, load_task

SCALES = ("0.6", "force=0.6,rates=0.5", "x=0.3,y=0.4,z=0.5,roll=0.6,pitch=0.7,yaw=0.8", "force=0.5,z=0")


def trace(seed: int = 3, n: int = 60) -> CueTrace:
    rng = np.random.default_rng(seed)
    force = rng.normal(size=(n, 3)) - np.array([0.0, 0.0, GRAVITY])
    speed = {"speed_m_s": rng.random(n)}
    return CueTrace("noise", 0.01 * np.arange(n), force, rng.normal(size=(n, 3)), channels=speed)


@pytest.mark.parametrize("text", SCALES)
def test_a_scale_is_read_as_it_is_written(text):
    scale = CueScale.parse(text)
    assert CueScale.parse(str(scale)) == scale


def test_axes_by_name():
    scale = CueScale.parse("force=0.6,rates=0.5,yaw=0.9")
    assert scale == CueScale((0.6, 0.6, 0.6), (0.5, 0.5, 0.9))
    assert CueScale.parse("1") == UNSCALED
    assert CueScale.parse("force=1,rates=1").neutral


@pytest.mark.parametrize("text", ["", "half", "surge=0.5", "x=", "x=1,2=3"])
def test_what_is_no_scale_is_refused(text):
    with pytest.raises(ConfigurationError, match="not understood"):
        CueScale.parse(text)


@pytest.mark.parametrize("text", ["-0.5", "nan", "inf", "yaw=-1"])
def test_a_scale_is_a_finite_number_from_zero_up(text):
    with pytest.raises(ConfigurationError):
        CueScale.parse(text)


@pytest.mark.parametrize("text", SCALES)
def test_cues_are_scaled_about_rest_axis_by_axis(text):
    """f = a - g: the acceleration that a driver feels is scaled, gravity is not."""
    scale, cues = CueScale.parse(text), trace()
    scaled = cues.scaled(scale)
    gravity = np.array([0.0, 0.0, GRAVITY])
    np.testing.assert_allclose(
        scaled.specific_force + gravity, (cues.specific_force + gravity) * scale.force, atol=1e-12
    )
    np.testing.assert_allclose(scaled.angular_velocity, cues.angular_velocity * scale.rates, atol=1e-12)
    # The derivative of the scaled rates.
    slope = np.gradient(scaled.angular_velocity, cues.dt, axis=0)
    np.testing.assert_allclose(scaled.angular_acceleration, slope, atol=1e-9)
    np.testing.assert_array_equal(scaled.channels["speed_m_s"], cues.channels["speed_m_s"])
    assert scaled.scale == scale
    assert scaled.name == cues.name


def test_a_car_at_rest_is_at_rest_at_any_scale():
    rest = np.tile([0.0, 0.0, -GRAVITY], (10, 1))
    cues = CueTrace("rest", 0.01 * np.arange(10), rest, np.zeros((10, 3)))
    scaled = cues.scaled(CueScale.parse("0.1"))
    np.testing.assert_array_equal(scaled.specific_force, rest)
    assert not scaled.angular_velocity.any()


def test_scaling_is_linear():
    """The scale of a mean of two drives is the mean of the scaled drives."""
    a, b, scale = trace(1), trace(2), CueScale.parse("x=0.3,y=0.4,z=0.5,yaw=0.8")
    middle = replace(
        a,
        specific_force=0.5 * (a.specific_force + b.specific_force),
        angular_velocity=0.5 * (a.angular_velocity + b.angular_velocity),
        angular_acceleration=None,
    )
    both = [one.scaled(scale) for one in (a, b)]
    np.testing.assert_allclose(
        middle.scaled(scale).specific_force, 0.5 * sum(one.specific_force for one in both), atol=1e-12
    )


def test_scales_multiply():
    twice = trace().scaled(CueScale.parse("0.5")).scaled(CueScale.parse("force=0.5,rates=0.2"))
    assert twice.scale == CueScale((0.25,) * 3, (0.1,) * 3)
    np.testing.assert_allclose(twice.specific_force, trace().scaled(twice.scale).specific_force, atol=1e-12)


def test_a_neutral_scale_changes_no_bit():
    cues = trace()
    assert cues.scaled(CueScale.parse("1")) is cues
    assert cues.scaled(CueScale.parse("0.5")).digest() != cues.digest()


def test_the_scale_of_a_resampled_drive_stays():
    assert trace().scaled(CueScale.parse("0.5")).resampled(0.02).scale == CueScale.parse("0.5")


def test_a_task_scales_its_drives():
    plain, none = EpisodeOptions(drives=("lane-change",)), RandomizationOptions()
    scaled = replace(plain, scale="force=0.6,rates=0.5")
    (whole,), (small,) = library_of(plain, none), library_of(scaled, none)
    expected = whole.scaled(CueScale.parse("force=0.6,rates=0.5"))
    np.testing.assert_array_equal(small.specific_force, expected.specific_force)
    np.testing.assert_array_equal(small.angular_velocity, expected.angular_velocity)


def test_a_task_takes_a_number():
    assert load_task(None, episode={"scale": 0.6}).episode.scale == CueScale.parse("0.6")
    fields = {"force": [0.5, 0.5, 0.5], "rates": [1.0, 1.0, 1.0]}
    assert load_task(None, episode={"scale": fields}).episode.scale == CueScale.parse("force=0.5")
