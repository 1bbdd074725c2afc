"""What is known of a machine's lateness, by hand."""

import pytest

from motion_cueing.baselines.compensation import CompensationOptions, lateness_of
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.machines import ActuatorDynamics

PAPER = get_platform("paper")
MIXED = PAPER.with_dynamics(
    {
        "carriage": ActuatorDynamics(natural_frequency=20.0, damping=1.5, dead_time=0.02),
        "hexapod": ActuatorDynamics(natural_frequency=80.0, dead_time=0.03),
    }
)


def test_a_slow_lag_is_led_by_at_most_its_factor_and_a_fast_one_is_not():
    known = lateness_of(MIXED, CompensationOptions(bandwidth=60.0, most_lead=2.0))
    carriage, hexapod, turntable = known.subsystems
    assert (carriage.led, hexapod.led, turntable.led) == (40.0, None, None)
    # 20 ms + 2 / 40; 30 ms + 2 / 80; nothing.
    assert [one.left for one in known.subsystems] == pytest.approx([0.07, 0.055, 0.0])
    assert carriage.dynamics.lateness == pytest.approx(0.02 + 2.0 * 1.5 / 20.0)


def test_all_subsystems_wait_for_the_latest():
    known = lateness_of(MIXED, CompensationOptions(bandwidth=60.0, most_lead=2.0))
    assert known.common == pytest.approx(0.07)
    assert [known.delay(k) for k in range(3)] == pytest.approx([0.0, 0.015, 0.07])


def test_a_known_lateness_that_is_wrong_is_wrong_by_its_factor():
    known = lateness_of(MIXED, CompensationOptions(known=1.3))
    for one, true in zip(known.subsystems, MIXED.dynamics.values(), strict=True):
        assert one.dynamics.lateness == pytest.approx(1.3 * true.lateness)


def test_a_machine_without_lag_is_not_late():
    assert lateness_of(PAPER).common == 0.0


def test_a_missing_subsystem_is_not_late():
    slow = get_platform("paper-hexapod-only").with_dynamics(ActuatorDynamics(dead_time=0.04))
    assert list(slow.dynamics) == ["hexapod"]
    assert [one.left for one in lateness_of(slow).subsystems] == [0.0, 0.04, 0.0]


def test_a_lead_that_makes_a_subsystem_slower_is_refused():
    with pytest.raises(ConfigurationError, match="most_lead"):
        CompensationOptions(most_lead=0.5)
