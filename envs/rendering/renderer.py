"""The renderer: pictures of a simulator's state, the machine in its hall beside the panel of cues."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..cues import GRAVITY
from ..errors import ConfigurationError
from ..platform.kernels.step import CARRIAGE, LEGS, TURNTABLE
from ..platform.machines import Platform
from . import theme
from .drawing import SUPERSAMPLING, Camera, Canvas, Floats, Mesh, Painter, load_pygame, orbit
from .instruments import PANEL_WIDTH, CueHistory, draw_panel
from .machine_model import (
    Frame,
    Legs,
    MachineParts,
    MotionView,
    carriage_frame,
    head,
    joints,
    leg_use,
    machine_parts,
    neutral_view,
    platform_frame,
    turntable_frame,
)
from .surroundings import Shadow, grid_lines, shadow, travel_lines


def motion_of(state: Any) -> MotionView:
    """The pose in one row of :attr:`..simulator.Simulator.state`."""
    motion = state["motion"]
    position = motion["position"]
    return MotionView(
        carriage=position[CARRIAGE],
        hexapod=np.concatenate([motion["displacement"], motion["beta"]]),
        turntable=float(position[TURNTABLE]),
        legs=position[LEGS],
    )


def append_state(history: CueHistory, time: float, state: Any) -> None:
    """Add the cues in one row of :attr:`..simulator.Simulator.state` to a history."""
    reference, simulated = (
        np.concatenate([state[name]["force"], state[name]["rate"]])
        for name in ("reference_cue", "simulator_cue")
    )
    history.append(time, reference, simulated)


_AZIMUTH: Final = np.radians(-134.0)
"""Where the camera stands: behind the machine, on its left."""
_ELEVATION: Final = np.radians(17.0)
_FIELD: Final = np.radians(30.0)
"""Vertical angle of view."""
_FOLLOW: Final = 0.93
"""Share of the carriage's way the camera goes along; the rest is seen as motion across the picture."""
_ARROW_LENGTH: Final = 1.1
"""Of the arrow of one g, m."""


@dataclass(frozen=True, eq=False)
class Arrows:
    """Specific force at the driver's head, in the axes of car and cab, m/s^2.

    Args:
        reference_cue: (3,) in the car.
        simulator_cue: (3,) in the simulator.
    """

    reference_cue: Floats
    simulator_cue: Floats


class Scene:
    """Draws a machine in its hall, in three dimensions."""

    def __init__(self, platform: Platform, pygame: ModuleType) -> None:
        self._platform, self._pygame = platform, pygame
        self._parts: MachineParts = machine_parts(platform)
        self._legs = Legs.of(platform.hexapod, self._parts.scale)
        self._shadow: Shadow | None = None
        self._grid = grid_lines(self._parts.floor)
        self._top = (
            platform.hexapod.neutral[2]
            + platform.cab.reference_point[2]
            + platform.cab.head[2]
            - _ARROW_LENGTH
        )

    def camera(self, motion: MotionView, width: int, height: int) -> Camera:
        """The camera that follows a machine, for a picture of a size in pixels."""
        tall = self._parts.floor - self._top
        middle = self._parts.floor - 0.5 * tall
        target = np.array([*(_FOLLOW * motion.carriage), middle])
        wide = max(1.0, 1.25 * height / width)
        distance = wide * 1.3 * tall / (2.0 * np.tan(0.5 * _FIELD))
        focal = 0.5 * height / np.tan(0.5 * _FIELD)
        return orbit(target, distance, _AZIMUTH, _ELEVATION, focal, (0.5 * width, 0.5 * height))

    def draw(self, surface: Any, motion: MotionView, arrows: Arrows | None = None) -> None:
        """Draw a machine on a surface whose background is already there."""
        camera = self.camera(motion, *surface.get_size())
        reach = float(np.linalg.norm(camera.position - camera.target))
        painter = Painter(self._pygame, surface, camera, (1.1 * reach, 3.4 * reach))
        self._floor(painter, motion)
        base = platform_frame(self._platform, motion)
        groups = [self._below(motion), [placed(self._parts.platform, base)], self._above(camera, motion)]
        # The platform's plane parts what is below from what is above: the far side first is exact.
        above = (camera.position - base.origin) @ base.rotation[:, 2] < 0.0
        painter.meshes(*(mesh for group in (groups if above else groups[::-1]) for mesh in group))
        if arrows is not None:
            self._arrows(painter, motion, arrows)

    def _floor(self, painter: Painter, motion: MotionView) -> None:
        unit = painter.surface.get_height() / 600.0
        painter.lines(*self._grid, theme.GRID, unit)
        carriage = self._platform.carriage
        if carriage is not None:
            painter.lines(
                *travel_lines(carriage.travel_x, carriage.travel_y, self._parts.floor), theme.TRAVEL, 2 * unit
            )
        self._soft_shadow(painter, motion)
        if self._parts.rails is not None and self._parts.bridge is not None:
            painter.meshes(self._parts.rails, self._parts.bridge.moved((motion.carriage[0], 0.0, 0.0)))

    def _soft_shadow(self, painter: Painter, motion: MotionView) -> None:
        """The machine's shadow under a wide lamp: made once, as it lies in the middle, and moved along."""
        size = painter.surface.get_size()
        if self._shadow is None or self._shadow.size != size:
            middle = self.camera(neutral_view(), *size)
            self._shadow = shadow(self._pygame, middle, size, self._parts.scale, self._parts.floor)
        target = painter.camera.target
        points = np.array([[*motion.carriage, self._parts.floor], [*target[:2], self._parts.floor]])
        here, there = painter.camera.project(points)
        painter.surface.blit(
            self._shadow.picture, np.round(self._shadow.corner + here - there).astype(int).tolist()
        )

    def _below(self, motion: MotionView) -> list[Mesh]:
        """What lies under the platform, from the floor up."""
        legs = self._legs.mesh(*joints(self._platform, motion), leg_use(self._platform, motion))
        return [placed(self._parts.carriage, carriage_frame(motion)), legs]

    def _above(self, camera: Camera, motion: MotionView) -> list[Mesh]:
        """What stands on the platform, in the order in which it hides the rest."""
        frame, cab = turntable_frame(self._platform, motion), self._parts.cab
        deck = [part for part in (self._parts.turntable, self._parts.marks) if part is not None]
        to_camera = (camera.position - frame(cab.driver)) @ frame.rotation
        furniture = cab.furniture if to_camera[0] < 0.0 else cab.furniture[::-1]
        shell = [] if cab.shell is None else [cab.shell]
        wheels = cab.wheels[int(to_camera[1] > 0.0)]
        return [placed(part, frame) for part in (*deck, *cab.inside, *furniture, *shell, *wheels)]

    def _arrows(self, painter: Painter, motion: MotionView, arrows: Arrows) -> None:
        """Specific force as arrows from the driver's head; one g is as long as an arm span."""
        frame = turntable_frame(self._platform, motion)
        start = head(self._platform, motion)
        for force, color in (
            (arrows.reference_cue, theme.REFERENCE),
            (arrows.simulator_cue, theme.SIMULATOR),
        ):
            tip = start + frame.rotation @ force * (_ARROW_LENGTH / GRAVITY)
            painter.arrow(start, tip, color)


def placed(mesh: Mesh, frame: Frame) -> Mesh:
    """A body's mesh in F_I."""
    return replace(mesh, vertices=frame(mesh.vertices))


FRAMES_PER_SECOND: Final = 30
"""Rate at which a window shows frames, and films are made."""
SIZE: Final = (1280, 720)
_LEAST_SIZE: Final = (480, 270)

Picture = NDArray[np.uint8]


class Renderer:
    """Draws frames without a display, and shows them in a window if one is wanted.

    Args:
        platform: The machine.
        size: Width and height of a frame, pixels; even numbers suit video codecs.

    Raises:
        RenderingUnavailableError: pygame is not installed.
        ConfigurationError: the size is too small or too narrow.
    """

    def __init__(self, platform: Platform, size: tuple[int, int] = SIZE) -> None:
        width, height = int(size[0]), int(size[1])
        if width < _LEAST_SIZE[0] or height < _LEAST_SIZE[1] or width < height:
            raise ConfigurationError(
                f"size must be at least {_LEAST_SIZE} and wider than high, found {(width, height)}"
            )
        self._pygame: ModuleType = load_pygame()
        self._platform, self.size = platform, (width, height)
        self._canvas = Canvas(self._pygame, self.size)
        self._scene = Scene(platform, self._pygame)
        panel = round(PANEL_WIDTH * self._canvas.unit * SUPERSAMPLING)
        high = height * SUPERSAMPLING
        self._stage = self._canvas.surface.subsurface((0, 0, width * SUPERSAMPLING - panel, high))
        self._backdrop = _backdrop(self._pygame, self._stage.get_size())
        self._window: Any = None
        self._clock: Any = None
        self.closed_by_user = False
        """Whether the user has closed the window; no other one is opened."""

    def frame(self, motion: MotionView, cues: CueHistory) -> Picture:
        """A frame, (height, width, 3); the same input always gives the same pixels.

        The last sample of the cues is drawn as arrows at the driver's head.
        """
        self._stage.blit(self._backdrop, (0, 0))
        arrows = Arrows(cues.reference_cue[-1, :3], cues.simulator_cue[-1, :3]) if len(cues) else None
        self._scene.draw(self._stage, motion, arrows)
        draw_panel(self._canvas, self._platform, motion, cues)
        picture = self._canvas.finish()
        pixels = np.frombuffer(self._pygame.image.tobytes(picture, "RGB"), dtype=np.uint8)
        return pixels.reshape(self.size[1], self.size[0], 3).copy()

    def show(self, frame: Picture, rate: float = FRAMES_PER_SECOND) -> None:
        """Show a frame in a window, made when it is first needed, at no more than ``rate`` frames a second.

        Once the user has closed the window, frames are dropped.
        """
        if self.closed_by_user:
            return
        pygame: Any = self._pygame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode(self.size)
            pygame.display.set_caption("Motion Cueing Gym")
            self._clock = pygame.time.Clock()
        pygame.surfarray.blit_array(self._window, frame.swapaxes(0, 1))
        pygame.display.flip()
        self._clock.tick(rate)
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()
            self.closed_by_user = True

    def close(self) -> None:
        """Close the window, if there is one; frames can still be drawn."""
        if self._window is not None:
            self._window = None
            self._pygame.display.quit()


def _backdrop(pygame: ModuleType, size: tuple[int, int]) -> Any:
    """The empty hall: a floor lit from above that fades into the dark."""
    width, height = size
    x = (np.arange(width)[:, None] / width - 0.5) / 0.62
    y = (np.arange(height)[None, :] / height - 0.68) / 0.52
    glow = np.exp(-(x**2 + y**2) * 1.6)[..., None]
    colors = np.array(theme.BACKDROP) * (1.0 - glow) + np.array(theme.GLOW) * glow
    surface = pygame.Surface(size, depth=32)
    pygame.surfarray.blit_array(surface, colors.round().astype(np.uint8))
    return surface
