"""Pictures of a machine in motion, beside the cues its driver should feel and does feel."""

from __future__ import annotations

from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError
from ..platform.machines import Platform
from . import theme
from .backend import load_pygame
from .canvas import SUPERSAMPLING, Canvas
from .cue_history import CueHistory
from .motion_view import MotionView
from .panel import PANEL_WIDTH, draw_panel
from .scene import Arrows, Scene

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
        self._closed_by_user = False

    def frame(self, motion: MotionView, cues: CueHistory) -> Picture:
        """A frame, (height, width, 3); the same input always gives the same pixels.

        Args:
            motion: Where the machine stands.
            cues: What is wanted and felt; its last sample is drawn as arrows at the driver's head.
        """
        self._stage.blit(self._backdrop, (0, 0))
        arrows = Arrows(cues.wanted[-1, :3], cues.felt[-1, :3]) if len(cues) else None
        self._scene.draw(self._stage, motion, arrows)
        draw_panel(self._canvas, self._platform, motion, cues)
        picture = self._canvas.finish()
        pixels = np.frombuffer(self._pygame.image.tobytes(picture, "RGB"), dtype=np.uint8)
        return pixels.reshape(self.size[1], self.size[0], 3).copy()

    def show(self, frame: Picture, rate: float = FRAMES_PER_SECOND) -> None:
        """Show a frame in a window, made when it is first needed, at no more than ``rate`` frames a second.

        Once the user has closed the window, frames are dropped.
        """
        if self._closed_by_user:
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
            self._closed_by_user = True

    @property
    def closed_by_user(self) -> bool:
        """Whether the user has closed the window; no other one is opened."""
        return self._closed_by_user

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
    colours = np.array(theme.BACKDROP) * (1.0 - glow) + np.array(theme.GLOW) * glow
    surface = pygame.Surface(size, depth=32)
    pygame.surfarray.blit_array(surface, colours.round().astype(np.uint8))
    return surface
