"""Frames of the paper's machine at full size, without a display, beside the rate a film needs."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.rendering import FRAMES_PER_SECOND, Renderer
from tests.rendering.moments import moment, weaving

from .test_step import describe


def test_frame(benchmark):
    platform = get_platform("paper")
    renderer, cues = Renderer(platform), weaving(900)
    motion = moment(platform, (0.1, 0.1, 0.0, 0.1, 0.05, 0.0), (1.0, 2.0), 0.3)
    describe(benchmark, "frame of 1280 x 720", "renderer", 1, frames_per_second_wanted=FRAMES_PER_SECOND)
    frame = benchmark(renderer.frame, motion, cues)
    assert np.any(frame)
