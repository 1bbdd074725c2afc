"""Frames of a batch's environments, as Gymnasium's render modes want them; imported where one is chosen."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ..rendering import FRAMES_PER_SECOND, CueHistory, Renderer, append_state, motion_of
from ..rendering.renderer import SIZE, Picture
from .batch import Batch, Mask

FRAME_SIZE: Final = (960, 540)
"""Pixels of a frame of the mode "rgb_array": films are collected in memory by those who record them."""
_DRIVER: Final = "agent"
"""Who acts in an environment, as the pictures name it."""


class Pictures:
    """Follows the environments of a batch, and draws them when asked.

    A frame is good for :attr:`hold` steps, so that there are about 30 a second: whoever asks again
    before gets the same array. It is read-only for that reason.

    Args:
        batch: The environments.
        mode: "rgb_array", or "human": a window that shows the first environment.
        size: Width and height of a frame, pixels; default: 960 x 540, of a window 1280 x 720.

    Raises:
        RenderingUnavailableError: pygame is not installed.
        ConfigurationError: the size is too small or too narrow.
    """

    def __init__(self, batch: Batch, mode: str, size: tuple[int, int] | None = None) -> None:
        self._batch, self._human = batch, mode == "human"
        self._size = size or (SIZE if self._human else FRAME_SIZE)
        self._renderer = Renderer(batch.platform, self._size)
        # One for each machine that looks different; the first also has the window.
        self._renderers = {0: self._renderer}
        self.hold = max(1, round(1.0 / (FRAMES_PER_SECOND * batch.time_step)))
        """Steps between two frames."""
        self._views = [_View(batch.time_step) for _ in range(1 if self._human else batch.n)]

    def begin(self, mask: Mask) -> None:
        """Episodes have begun in the masked environments."""
        self._look(mask, begins=True)

    def follow(self, mask: Mask) -> None:
        """The masked environments have made a step."""
        self._look(mask, begins=False)

    def _look(self, mask: Mask, begins: bool) -> None:
        if self._renderer.closed_by_user:
            return
        simulator, drives = self._batch.simulator, self._batch.drives
        states = simulator.state
        for i in np.flatnonzero(mask[: len(self._views)]).tolist():
            drive = drives[int(simulator.drive_of[i])]
            if begins:
                self._views[i].begin(drive.name)
            sample = min(int(states[i]["sample"]), len(drive) - 1)
            self._views[i].append(float(drive.time[sample]), states[i])
        if self._human:
            self.show()

    def show(self) -> None:
        """Show a frame, if one is due and the user has not closed the window, at the pace of the drive."""
        view = self._views[0]
        if self._renderer.closed_by_user or not view.due(self.hold):
            return
        self._renderer.show(self.frame(0), 1.0 / (self.hold * self._batch.time_step))

    def frame(self, i: int) -> Picture:
        """The frame (height, width, 3) of an environment."""
        view = self._views[i]
        if view.frame is None or view.due(self.hold):
            view.frame = self._renderer_of(i).frame(motion_of(self._batch.simulator.state[i]), view.cues)
            view.frame.setflags(write=False)
            view.age = 0
        return view.frame

    def _renderer_of(self, i: int) -> Renderer:
        """Draws the machine of an environment."""
        simulator = self._batch.simulator
        several = self._batch.options.randomization.platform is not None
        which = int(simulator.platform_of[i]) if several else 0
        if which not in self._renderers:
            self._renderers[which] = Renderer(simulator.platforms[which], self._size)
        return self._renderers[which]

    def render(self) -> tuple[Picture, ...] | None:
        """The frame of each environment; None in the mode "human", where steps show themselves."""
        if self._human:
            self.show()
            return None
        return tuple(self.frame(i) for i in range(len(self._views)))

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()


class _View:
    """An environment between frames: its cues, its last frame and the steps since."""

    def __init__(self, dt: float) -> None:
        self.cues = CueHistory("", _DRIVER, dt)
        self.frame: Picture | None = None
        self.age = 0

    def begin(self, drive: str) -> None:
        self.cues.maneuver = drive
        self.cues.clear()
        self.frame = None

    def append(self, time: float, state: Any) -> None:
        # A step after the end of a drive stays at its last sample.
        if not len(self.cues) or time > self.cues.time:
            append_state(self.cues, time, state)
        self.age += 1

    def due(self, hold: int) -> bool:
        return self.frame is None or self.age >= hold
