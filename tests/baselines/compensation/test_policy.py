"""Compensated policies: what late machines do, held against ideal ones."""

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.baselines.compensation import Compensated, CompensationOptions
from motion_cueing.baselines.interface import Machines
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.machines import ActuatorDynamics
from motion_cueing.evaluation.policies import make_policy as make_any
from motion_cueing.evaluation.rollout import Rollout, record, rollout

PAPER = get_platform("paper")
NO_LEAD = CompensationOptions(bandwidth=1e-3)
DEAD = ActuatorDynamics(dead_time=0.06)


def drive(n=300):
    time = 0.01 * np.arange(n)
    rise = np.clip(time - 0.5, 0.0, 1.0)
    force = np.stack([1.5 * rise, np.sin(2.0 * time) * rise, np.full(n, -9.81)], axis=1)
    return CueTrace("bend", time, force, np.stack([0.02 * rise, 0.03 * rise, 0.2 * np.sin(time)], axis=1))


CUES = drive()


def setpoints(trajectory):
    return np.hstack([trajectory.carriage, trajectory.hexapod, trajectory.turntable[:, None]])


@pytest.mark.parametrize("name", ["classical", "learned", "learned-preview"])
def test_a_machine_that_is_not_late_is_driven_as_without_compensation(name):
    bare = rollout(make_any(name, PAPER), CUES, PAPER)
    compensated = rollout(Compensated(make_any(name, PAPER)), CUES, PAPER)
    np.testing.assert_array_equal(compensated.action, bare.action)
    np.testing.assert_array_equal(compensated.f_simulator, bare.f_simulator)


def test_with_preview_a_pure_dead_time_is_made_good():
    """The late machine does at each sample what an ideal one does in the drive itself, but for its start."""
    agent, late = make_any("learned-preview", PAPER), PAPER.with_dynamics(DEAD)
    known = CUES.time >= 0.06
    ahead = CueTrace("ahead", CUES.time[:-6], CUES.specific_force[6:], CUES.angular_velocity[6:])
    ideal = rollout(agent, ahead, PAPER)
    compensated = rollout(Compensated(agent, NO_LEAD).for_platform(late), CUES, late)
    moved, expected = setpoints(compensated)[known], setpoints(ideal)
    # The ideal machine's legs are a hair slower, which the agent sees in its rows.
    np.testing.assert_allclose(moved, expected, atol=2e-4)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_array_equal(compensated.f_reference, rollout(agent, CUES, PAPER).f_reference)


def test_the_preview_reaches_further_by_the_lateness():
    agent, late = make_any("learned-preview", PAPER), PAPER.with_dynamics(DEAD)
    assert Compensated(agent, NO_LEAD).for_platform(late).information.seconds == pytest.approx(2.06)
    assert Compensated(make_any("learned", PAPER)).for_platform(late).information.kind == "now"


def test_subsystems_that_are_less_late_wait_for_the_latest():
    """The carriage alone is late: the turntable's motion is that of the ideal machine, as late as its."""
    late = PAPER.with_dynamics({"carriage": ActuatorDynamics(dead_time=0.05)})
    agent = make_any("learned-preview", PAPER)
    compensated = rollout(Compensated(agent, NO_LEAD).on(late), CUES, late)
    everywhere = PAPER.with_dynamics(ActuatorDynamics(dead_time=0.05))
    alike = rollout(Compensated(agent, NO_LEAD).on(everywhere), CUES, everywhere)
    np.testing.assert_allclose(setpoints(compensated), setpoints(alike), atol=1e-9)


def test_a_led_lag_moves_as_one_of_the_higher_bandwidth():
    """The lead is the inverse of the lag before one of its own bandwidth."""
    options = CompensationOptions(bandwidth=60.0, most_lead=2.0)
    slow = PAPER.with_dynamics(ActuatorDynamics(natural_frequency=30.0))
    quick = PAPER.with_dynamics(ActuatorDynamics(natural_frequency=60.0))
    agent = make_any("learned-any", PAPER)
    led = rollout(Compensated(agent, options).on(slow), CUES, slow)
    plain = rollout(Compensated(agent, NO_LEAD).on(quick), CUES, quick)
    assert np.abs(setpoints(plain)).max() > 0.05
    np.testing.assert_allclose(setpoints(led), setpoints(plain), atol=1e-5)


def test_late_machines_in_a_batch_are_driven_as_alone():
    platforms = [
        PAPER,
        PAPER.with_dynamics(DEAD),
        PAPER.with_dynamics(ActuatorDynamics(natural_frequency=25.0)),
    ]
    policy = Compensated(make_policy("classical", PAPER))
    run = Rollout(policy, Machines([CUES] * 3, platforms, [0, 1, 2]))
    for recorded, platform in zip(record(run), platforms, strict=True):
        alone = rollout(policy, CUES, platform)
        np.testing.assert_allclose(recorded.states["motion"]["position"][:, 8], alone.turntable, atol=1e-12)
        np.testing.assert_allclose(recorded.actions, alone.action, atol=1e-9)


def test_a_policy_that_plans_for_its_drive_plans_for_the_earlier_cues():
    late = PAPER.with_dynamics(DEAD)
    short = drive(60)
    trajectory = rollout(Compensated(make_policy("mpc-preview", PAPER)).on(late), short, late)
    bare = rollout(make_policy("mpc-preview", PAPER), short, late)
    assert not np.array_equal(trajectory.action, bare.action)
    assert float(trajectory.metadata["lateness_known_s"]) == pytest.approx(0.06)


def test_an_agent_runs_on_a_copy_of_its_machine_that_is_late_and_on_no_other():
    agent = Compensated(make_any("learned-preview", PAPER))
    mine = replace(PAPER, name="mine").with_dynamics(DEAD)
    assert agent.for_platform(mine).platform == mine
    with pytest.raises(ConfigurationError, match="was made for the motion base 'paper'"):
        agent.for_platform(get_platform("nads-1"))
    assert make_any("learned-preview", mine, compensation=CompensationOptions()).platform == mine


def test_compensation_pays_where_a_machine_is_late():
    late = PAPER.with_dynamics(ActuatorDynamics(natural_frequency=30.0, dead_time=0.05))
    agent = make_any("learned-preview", PAPER)

    def error(trajectory):
        return np.mean((trajectory.f_simulator - trajectory.f_reference)[50:] ** 2)

    nominal = error(rollout(agent, CUES, PAPER))
    bare = error(rollout(agent.on(late), CUES, late))
    compensated = error(rollout(Compensated(agent).on(late), CUES, late))
    assert compensated < 0.5 * bare + 0.5 * nominal
    assert bare > 1.2 * nominal
