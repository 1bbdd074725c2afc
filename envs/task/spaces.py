"""The spaces of an environment, and options as an environment's constructor takes them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space

from ..errors import ConfigurationError
from ..settings import from_dict
from .batch import Batch
from .options import TaskOptions


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


def checked_render_mode(mode: str | None, metadata: dict[str, Any]) -> str | None:
    """``mode``, if an environment with this metadata has it.

    Raises:
        ConfigurationError: it has not.
    """
    known = metadata["render_modes"]
    if mode is not None and mode not in known:
        raise ConfigurationError(f"render_mode {mode!r} is none of {known}; leave it out")
    return mode
