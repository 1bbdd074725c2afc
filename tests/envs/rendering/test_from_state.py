"""A simulator's state, drawn live, gives the frame its trajectory gives afterwards."""

from __future__ import annotations

import numpy as np

from motion_cueing.baselines import make_policy
from motion_cueing.envs.car import get_car
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.rendering import CueHistory, Renderer, append_state, motion_of
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator
from motion_cueing.evaluation.reporting.film import film_frames
from motion_cueing.evaluation.rollout import rollout

from .moments import SIZE

STEPS = 250


def test_live_frames_are_those_of_the_film():
    platform = get_platform("paper")
    cues = get_maneuver("slalom").drive(get_car("sedan"))
    policy = make_policy("classical", platform)
    trajectory = rollout(policy, cues, platform)
    renderer = Renderer(platform, SIZE)
    moment = STEPS * TIME_STEP
    (filmed,) = film_frames(trajectory, renderer, 1.0, moment, moment)

    simulator = Simulator(platform, cues.resampled(TIME_STEP))
    history = CueHistory(trajectory.maneuver, trajectory.policy, TIME_STEP)
    start = np.zeros(9)
    start[:2], start[2:8] = trajectory.carriage[0], trajectory.hexapod[0]
    append_state(history, 0.0, simulator.reset(start)[0])
    for k in range(1, STEPS + 1):
        append_state(history, k * TIME_STEP, simulator.step(trajectory.action[k])[0])
    live = renderer.frame(motion_of(simulator.state[0]), history)
    np.testing.assert_array_equal(live, filmed)
