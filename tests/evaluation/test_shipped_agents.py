"""The agents that come with the package do what the README says of them."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines import make_policy
from motion_cueing.envs.maneuvers import get_maneuver, maneuver_names
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.evaluation import Metrics, Trajectory, measure, rollout
from motion_cueing.train.agents import Agent, agent_names, get_agent

pytestmark = pytest.mark.slow

REFERENCE = "optimal-washout-tuned"
"""The best washout on the drives that agents are trained on: the zero of the normalized score."""
WASHOUTS = ("classical", REFERENCE)
"""The washout of the paper, and the best one."""
WORSE = {"acceleration"}
"""Where agents without preview have a larger J than the best washout, as docs/results/agents.md says."""
TILTS_MORE = {
    "learned": (
        {"acceleration", "braking", "hill", "steady-turn", "step-steer"},
        {"acceleration", "braking", "steady-turn"},
    ),
    "learned-any-now": ({"braking", "hill", "steady-turn"}, set()),
    "learned-controls": (
        {"acceleration", "braking", "hill", "steady-turn", "step-steer"},
        {"steady-turn"},
    ),
    "learned-perceived": (
        {
            "acceleration",
            "braking",
            "double-lane-change",
            "hill",
            "obstacle-avoidance",
            "steady-turn",
            "step-steer",
            "stop-and-go",
        },
        {"acceleration", "braking", "steady-turn", "stop-and-go"},
    ),
    "learned-ppo-now": (
        {"acceleration", "braking", "hill", "obstacle-avoidance", "steady-turn"},
        {"steady-turn", "step-steer"},
    ),
    "learned-road": ({"hill", "steady-turn", "step-steer"}, set()),
}
"""Where an agent tilts more than the best washout, as docs/results/agents.md says: drives with a larger tilt
rate, and with a large one for longer."""
ERROR_SHARES = {"learned-preview": 0.5, "learned-any-now": 0.9, "learned-ppo-now": 0.9}
"""Largest mean J and perceived J as a share of the best washout's; 0.8 for all others."""
TILT_SHARES = {"learned": 0.65, "learned-perceived": 0.95, "learned-ppo-now": 0.85}
"""Largest mean time of a large tilt rate as a share of the best washout's; 0.6 for all others."""
BEST = "learned-preview"
"""Better on every single maneuver, too."""
BEGINNING = "linear-washout"
"""What agents begin with, of which nothing is said."""


@pytest.fixture(scope="module")
def washouts() -> dict[str, list[Metrics]]:
    """Metrics of the washouts by maneuver."""
    policies = [make_policy(name, get_platform("paper")) for name in WASHOUTS]
    drives = {name: get_maneuver(name).drive() for name in maneuver_names()}
    return {name: [measure(rollout(policy, cues)) for policy in policies] for name, cues in drives.items()}


@pytest.fixture(scope="module", params=[name for name in agent_names() if name != BEGINNING])
def agent(request) -> Agent:
    return get_agent(request.param)


@pytest.fixture(scope="module")
def driven(agent) -> dict[str, Trajectory]:
    return {name: rollout(agent, get_maneuver(name).drive()) for name in maneuver_names()}


def test_they_are_there():
    assert {BEST, "learned", "learned-ppo"} <= set(agent_names())


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("learned", "now"),
        ("learned-controls", "controls"),
        ("learned-road", "road"),
        ("learned-preview", "2 s true"),
    ],
)
def test_tables_name_what_it_knows(name, known):
    assert get_agent(name).information.label == known


def test_the_road_is_worth_more_than_controls_and_these_more_than_nothing():
    drives = [get_maneuver(name).drive() for name in ("braking", "slalom", "roundabout")]
    names = ("learned", "learned-controls", "learned-road")
    scores = [
        np.mean([measure(rollout(get_agent(name), drive)).cue_error for drive in drives]) for name in names
    ]
    assert scores[0] > 1.1 * scores[1] > 1.1 * 1.1 * scores[2]


def test_without_preview_it_is_below_the_best_washout_but_where_it_is_said(washouts):
    agent = get_agent("learned")
    worse = {
        name
        for name, pair in washouts.items()
        if measure(rollout(agent, get_maneuver(name).drive())).cue_error >= pair[1].cue_error
    }
    assert worse == WORSE


@pytest.fixture(scope="module")
def measured(driven) -> dict[str, Metrics]:
    return {name: measure(trajectory) for name, trajectory in driven.items()}


@pytest.mark.parametrize("error", ["cue_error", "perceived_cue_error"])
def test_it_is_better_than_each_washout(agent, measured, washouts, error):
    ours = {name: getattr(metrics, error) for name, metrics in measured.items()}
    theirs = {name: [getattr(metrics, error) for metrics in pair] for name, pair in washouts.items()}
    share = np.mean(list(ours.values())) / np.mean(list(theirs.values()), axis=0).min()
    assert share < ERROR_SHARES.get(agent.name, 0.8)
    worse = [name for name, value in ours.items() if value >= min(theirs[name])]
    assert not worse or agent.name != BEST


def test_it_tilts_no_faster_than_the_best_washout_but_where_it_is_said(agent, measured, washouts):
    tuned = {name: pair[1] for name, pair in washouts.items()}
    shares = [(ours.tilt_rate_share, tuned[name].tilt_rate_share) for name, ours in measured.items()]
    ours, theirs = np.mean(shares, axis=0)
    assert ours < TILT_SHARES.get(agent.name, 0.6) * theirs
    faster = {n for n, ours in measured.items() if ours.tilt_rate_peak > tuned[n].tilt_rate_peak}
    longer = {n for n, ours in measured.items() if ours.tilt_rate_share > tuned[n].tilt_rate_share}
    assert (faster, longer) == TILTS_MORE.get(agent.name, (set(), set()))


def test_it_does_not_chatter_where_the_car_is_driven_gently(measured):
    assert max(measured[n].vibration for n in ("steady-turn", "lane-change", "hill")) < 0.1


@pytest.mark.parametrize("name", [name for name in agent_names() if name != BEGINNING])
def test_late_actuators_change_nothing_of_what_it_asks_for(name):
    """There is no loop through the actuators that lag and dead time could make swing."""
    agent, paper = get_agent(name), get_platform("paper")
    slow = paper.with_dynamics(ActuatorDynamics(natural_frequency=30.0, dead_time=0.05))
    cues = get_maneuver("slalom").drive()
    at_once, late = (rollout(agent.on(platform), cues, platform) for platform in (paper, slow))
    np.testing.assert_allclose(late.action, at_once.action, rtol=0.0, atol=1e-3)
    assert np.abs(late.f_simulator - at_once.f_simulator).max() > 0.1


def test_no_limit_of_the_machine_is_exceeded(driven):
    for name, trajectory in driven.items():
        limits = trajectory.limits
        positions = np.column_stack([trajectory.carriage, trajectory.legs, trajectory.turntable])
        rates = np.column_stack([trajectory.carriage_rate, trajectory.legs_rate, trajectory.turntable_rate])
        assert np.all(positions <= limits.position_max + 1e-9), name
        assert np.all(positions >= limits.position_min - 1e-9), name
        assert np.all(np.abs(rates) <= limits.velocity + 1e-9), name


def test_its_record_says_how_it_was_made(agent):
    record = agent.record
    assert record.command.startswith("motion-cueing train --")
    assert record.steps > 0
    assert record.wall_time < 2.0 * 3600.0
    assert record.hardware
    assert record.validation is not None
    assert {"numpy", "torch", "warp-lang", "motion-cueing-gym"} <= record.versions.keys()
