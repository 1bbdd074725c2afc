"""Frames of the paper's machine at full size, without a display, beside the rate a film needs."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from motion_cueing.envs import ENVIRONMENT_ID
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.rendering import FRAMES_PER_SECOND, Renderer
from motion_cueing.envs.rendering.renderer import SIZE
from motion_cueing.envs.simulator.simulator import TIME_STEP
from tests.envs.rendering.moments import moment, weaving

from .test_step import describe

STEPS = round(1.0 / (FRAMES_PER_SECOND * TIME_STEP))
"""Of the environment, from one frame to the next."""
UNPACED = 1e6
"""Frames a second that no machine reaches."""


def test_frame(benchmark):
    platform = get_platform("paper")
    renderer, cues = Renderer(platform), weaving(900)
    motion = moment(platform, (0.1, 0.1, 0.0, 0.1, 0.05, 0.0), (1.0, 2.0), 0.3)
    describe(benchmark, "frame of 1280 x 720", "renderer", 1, frames_per_second_wanted=FRAMES_PER_SECOND)
    frame = benchmark(renderer.frame, motion, cues)
    assert np.any(frame)


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_environment(benchmark, mode, monkeypatch):
    """The steps between two frames and a frame, as who records or watches has them; without waiting."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    show = Renderer.show
    monkeypatch.setattr(Renderer, "show", lambda self, frame, rate: show(self, frame, UNPACED))
    env = gymnasium.make(ENVIRONMENT_ID, render_mode=mode, render_size=SIZE).unwrapped
    env.reset(seed=0)
    action = np.zeros(9, dtype=np.float32)

    def frame() -> None:
        for _ in range(STEPS):
            env.step(action)
        env.render()

    describe(benchmark, f"{mode} of 1280 x 720, with its steps", "environment", 1, steps=STEPS)
    benchmark(frame)
    env.close()
