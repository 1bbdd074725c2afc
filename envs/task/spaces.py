"""The spaces of an environment, and options as an environment's constructor takes them."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium import logger
from gymnasium.spaces import Box, Space

from ..errors import ConfigurationError
from ..settings import from_dict
from .batch import Batch
from .options import TaskOptions

if TYPE_CHECKING:
    from ..rendering.renderer import Picture
    from .pictures import Pictures

RENDER_MODES: Final = ("human", "rgb_array")
"""What ``render_mode`` may be, beside None."""


def observation_space(batch: Batch) -> Space[Any]:
    """Of one environment: float32, bounded by each row's bound."""
    bounds = batch.layout.bounds
    return Box(-bounds, bounds, dtype=np.float32)


def action_space(batch: Batch) -> Space[Any]:
    """Of one environment: float32 in [-1, 1]."""
    return Box(-1.0, 1.0, (batch.action_size,), dtype=np.float32)


def task_options(task: TaskOptions | None, fields: dict[str, Any]) -> TaskOptions:
    """``task`` (default: all defaults) with some fields replaced; nested ones may be plain dictionaries.

    Raises:
        ConfigurationError: a field is unknown, of the wrong type or out of range.
    """
    start = {} if task is None else {f.name: getattr(task, f.name) for f in dataclasses.fields(TaskOptions)}
    return from_dict(TaskOptions, start | fields, "environment options")


def pictures_of(batch: Batch, mode: str | None, size: tuple[int, int] | None) -> Pictures | None:
    """What draws a batch; None without a render mode, and then nothing that draws is imported.

    Raises:
        ConfigurationError: there is no such mode, or ``size`` cannot be drawn or is given without one.
        RenderingUnavailableError: the extra ``render`` is not installed.
    """
    if mode is None:
        if size is not None:
            raise ConfigurationError("render_size is of no use without a render_mode; leave it out")
        return None
    if mode not in RENDER_MODES:
        raise ConfigurationError(f"render_mode {mode!r} is none of {', '.join(RENDER_MODES)}; leave it out")
    from .pictures import Pictures

    return Pictures(batch, mode, size)


def rendered(pictures: Pictures | None) -> tuple[Picture, ...] | None:
    """What ``render`` returns of a batch; without a render mode it warns, as Gymnasium's environments do."""
    if pictures is None:
        logger.warn('render() draws nothing without a render mode; give render_mode="rgb_array" or "human"')
        return None
    return pictures.render()


def frames_per_second(batch: Batch) -> float:
    """Gymnasium's ``render_fps``: one frame a step, so that a film of all of them runs at true speed."""
    return 1.0 / batch.time_step
