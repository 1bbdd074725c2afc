"""The washout under an agent."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from ...baselines.washout import ClassicalWashout, ScheduledWashout, WashoutParameters, load_washout
from ...envs.errors import ConfigurationError
from ...envs.task.episode import platform_of
from ...envs.task.options import TaskOptions

DEFAULT: Final = "classical"
"""The washout where one is needed and none is named."""


def base_parameters(
    base: WashoutParameters | str | Path | None, task: TaskOptions
) -> WashoutParameters | None:
    """The washout that a task's action mode needs under the agent, or None.

    Args:
        base: Its parameters, preset or YAML file; None for :data:`DEFAULT`.
        task: The environment.

    Raises:
        UnknownNameError: no washout has this name.
        ConfigurationError: a base is named, but the action mode has none.
    """
    mode = task.action.mode
    if mode not in ("residual", "gains"):
        if base is not None:
            raise ConfigurationError(f"base is of no use with task.action.mode {mode!r}; leave it out")
        return None
    return base if isinstance(base, WashoutParameters) else load_washout(base or DEFAULT)


def base_policy(base: WashoutParameters | str | Path | None, task: TaskOptions) -> Any:
    """The policy of :func:`base_parameters`, as the environment takes it, or None."""
    parameters = base_parameters(base, task)
    if parameters is None:
        return None
    kind = ScheduledWashout if task.action.mode == "gains" else ClassicalWashout
    return kind(parameters, platform_of(task).cab)
