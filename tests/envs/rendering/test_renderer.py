"""Frames: the same for the same input, other where something moves, without a display."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import Platform, get_platform, platform_names
from motion_cueing.envs.rendering import CueHistory, Renderer, RenderingUnavailableError, theme
from motion_cueing.envs.rendering.drawing import load
from motion_cueing.envs.rendering.instruments import CHANNELS, PANEL_WIDTH, axis_range, shortened, signed
from motion_cueing.envs.rendering.machine_model import head
from motion_cueing.envs.rendering.renderer import Scene

from .moments import SIZE, moment, weaving

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")
STAGE = round(SIZE[0] - PANEL_WIDTH * SIZE[1] / 720)
"""Pixels left of the panel."""


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(PAPER, SIZE)


@pytest.fixture(scope="module")
def cues() -> CueHistory:
    return weaving(500)


def changed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pixels that differ."""
    return np.any(a != b, axis=-1)


def near(frame: np.ndarray, color: tuple[int, int, int], tolerance: int = 30) -> np.ndarray:
    """Rows and columns of pixels close to a color."""
    return np.argwhere(np.abs(frame.astype(int) - color).max(axis=-1) < tolerance)


@pytest.mark.parametrize("name", platform_names())
def test_every_machine_and_its_parts_can_be_drawn(name, cues):
    platform = get_platform(name)
    for machine in (platform, platform.without_carriage().without_turntable()):
        frame = Renderer(machine, SIZE).frame(moment(machine, (0.05, 0.0, 0.0, 0.05, 0.05, 0.0)), cues)
        assert frame.shape == (SIZE[1], SIZE[0], 3)
        assert frame.dtype == np.uint8
        assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 500


def test_frames_depend_on_nothing_but_the_input(renderer, cues):
    motion = moment(PAPER, (0.1, 0.2, -0.1, 0.05, 0.1, 0.0), (3.0, -2.0), 0.4)
    first = renderer.frame(motion, cues)
    renderer.frame(moment(PAPER), weaving(3))
    np.testing.assert_array_equal(renderer.frame(motion, cues), first)
    np.testing.assert_array_equal(Renderer(PAPER, SIZE).frame(motion, cues), first)


@pytest.mark.parametrize(
    "other",
    [
        moment(PAPER, carriage=(2.0, 0.0)),
        moment(PAPER, carriage=(0.0, 2.0)),
        *(moment(PAPER, tuple(row)) for row in 0.12 * np.eye(6)),
        moment(PAPER, turntable=0.2),
    ],
)
def test_each_degree_of_freedom_shows(renderer, cues, other):
    difference = changed(renderer.frame(moment(PAPER), cues), renderer.frame(other, cues))
    assert difference[:, :STAGE].sum() > 500
    assert difference[:, STAGE:].any()  # in the gauges, too


def test_cues_show_in_the_charts_and_as_arrows(renderer):
    weak, strong = (renderer.frame(moment(PAPER), weaving(300, gain)) for gain in (0.5, 0.9))
    difference = changed(weak, strong)
    assert difference[:, STAGE:].sum() > 100
    assert difference[:, :STAGE].sum() > 10


def test_a_frame_without_any_cue_yet(renderer):
    empty = CueHistory("m", "p", 0.01)
    assert not len(near(renderer.frame(moment(PAPER), empty)[:, :STAGE], theme.SIMULATOR))


def test_the_arrow_of_a_car_at_rest_points_straight_up_from_the_head(renderer):
    history = CueHistory("m", "p", 0.01)
    rest = np.array([0.0, 0.0, -9.81, 0.0, 0.0, 0.0])
    history.append(0.0, rest, rest)
    motion = moment(PAPER)
    arrow = near(renderer.frame(motion, history)[:, :STAGE], theme.SIMULATOR)
    camera = Scene(PAPER, load("pygame", "pygame-ce")).camera(motion, STAGE, SIZE[1])
    column, row = camera.project(head(PAPER, motion))
    assert np.abs(arrow[:, 1] - column).max() < 6.0
    assert arrow[:, 0].min() < row - 40.0


def test_a_turn_to_the_right_moves_the_felt_arrow_to_the_right_of_the_cab():
    # Seen along the cab's x axis, f_y > 0 leans the arrow towards +y.
    scene = Scene(PAPER, load("pygame", "pygame-ce"))
    motion = moment(PAPER)
    camera = scene.camera(motion, *SIZE)
    start = head(PAPER, motion)
    upright, leaning = camera.project(start + np.array([[0.0, 0.0, -1.0], [0.0, 0.3, -1.0]]))
    right = camera.project(start + np.array([0.0, 0.3, 0.0])) - camera.project(start)
    assert (leaning - upright) @ right > 0.0


def test_a_leg_at_its_end_is_red(renderer, cues):
    rest = moment(PAPER)
    ends = replace(rest, legs=np.full(6, PAPER.hexapod.extension[1]))
    assert not len(near(renderer.frame(rest, cues)[:, :STAGE], theme.color_of_use(1.0), 20))
    assert len(near(renderer.frame(ends, cues)[:, :STAGE], theme.color_of_use(1.0), 20)) > 50


def test_the_machine_stays_in_the_picture_wherever_it_goes(renderer):
    scene = Scene(PAPER, load("pygame", "pygame-ce"))
    for x in (-13.72, 0.0, 13.72):
        for y in (-13.72, 0.0, 13.72):
            motion = moment(PAPER, carriage=(x, y))
            column, row = scene.camera(motion, STAGE, SIZE[1]).project(head(PAPER, motion))
            assert 0.1 * STAGE < column < 0.9 * STAGE
            assert 0.05 * SIZE[1] < row < 0.9 * SIZE[1]


@pytest.mark.parametrize("peak", [0.0, 0.3, 0.99, 1.9, 7.3, 47.0, 900.0])
def test_axes_hold_their_peak(peak):
    for channel in CHANNELS:
        assert axis_range(channel, peak) >= max(peak * channel.scale, channel.least_range)


def test_long_names_are_cut():
    assert shortened("short") == "short"
    assert len(shortened("a" * 100)) == 26


@pytest.mark.parametrize("size", [(100, 50), (640, 641), (640, 100)])
def test_sizes_that_cannot_hold_the_panel_are_refused(size):
    with pytest.raises(ConfigurationError, match="size"):
        Renderer(PAPER, size)


def test_a_missing_package_is_named_with_the_extra_that_brings_it():
    with pytest.raises(RenderingUnavailableError, match=r"needs nothing-ce: .*\[render\]"):
        load("no_such_module", "nothing-ce")


def run(code: str, **environment: str) -> str:
    """Output of Python code in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_loads_no_pygame_and_a_frame_needs_no_display_and_prints_nothing():
    code = (
        "import sys\n"
        "from motion_cueing.envs.platform import get_platform\n"
        "from motion_cueing.envs.rendering import CueHistory, Renderer\n"
        "from motion_cueing.envs.rendering.machine_model import neutral_view\n"
        "assert 'pygame' not in sys.modules\n"
        "import pygame\n"
        "renderer, cues = Renderer(get_platform('paper'), (640, 360)), CueHistory('m', 'p', 0.01)\n"
        "frame = renderer.frame(neutral_view(), cues)\n"
        "assert frame.any() and not pygame.display.get_init()\n"
    )
    assert "pygame" not in run(code, PYGAME_HIDE_SUPPORT_PROMPT="1")


class TestWindow:
    """The window, on SDL's driver without a screen."""

    @pytest.fixture
    def platform(self, monkeypatch) -> Platform:
        monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
        return PAPER

    def test_it_shows_the_frame(self, platform, cues):
        pygame = load("pygame", "pygame-ce")
        renderer = Renderer(platform, SIZE)
        frame = renderer.frame(moment(platform), cues)
        renderer.show(frame, rate=1000.0)
        shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        np.testing.assert_array_equal(shown, frame)
        renderer.close()
        renderer.close()
        assert not pygame.display.get_init()
        np.testing.assert_array_equal(renderer.frame(moment(platform), cues), frame)

    def test_once_closed_by_the_user_it_stays_closed(self, platform, cues):
        pygame = load("pygame", "pygame-ce")
        renderer = Renderer(platform, SIZE)
        frame = renderer.frame(moment(platform), cues)
        renderer.show(frame, rate=1000.0)
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        renderer.show(frame, rate=1000.0)
        renderer.show(frame, rate=1000.0)
        assert not pygame.display.get_init()


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [(-0.04, 1, "+0.0"), (-0.0, 0, "+0"), (-0.06, 1, "−0.1"), (2.346, 2, "+2.35"), (-12.0, 0, "−12")],
)
def test_numbers_that_round_to_zero_have_one_sign(value, digits, words):
    assert signed(value, digits) == words
