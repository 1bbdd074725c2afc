"""What searches and populations vary: fields of a configuration by their path, and what they may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from ..envs.errors import ConfigurationError
from ..envs.settings import from_dict, to_dict
from .config import Choice, TrainingConfig


def varied(config: TrainingConfig, values: Mapping[str, Any], **fields: Any) -> TrainingConfig:
    """A configuration with other values, that varies nothing any more.

    Args:
        config: What is common.
        values: By path, as ``hyperparameters.learning_rate``.
        **fields: Other fields of the configuration.

    Raises:
        ConfigurationError: a path is unknown, or a value wrong there.
    """
    found = to_dict(replace(config, search={}, **fields))
    for path, value in values.items():
        _set(found, path, value)
    return from_dict(TrainingConfig, found, "search")


def check_space(config: TrainingConfig) -> None:
    """Refuse a space with nothing in it, or whose ends are no configurations.

    Raises:
        ConfigurationError: there is nothing to vary, or a field cannot be set so.
    """
    if not config.search:
        raise ConfigurationError("search is empty; name fields to vary, as hyperparameters.learning_rate")
    ends: tuple[Callable[[Choice], Any], ...] = (first, last)
    for end in ends:
        varied(config, {path: end(choice) for path, choice in config.search.items()})


def first(choice: Choice) -> Any:
    """The first or smallest value."""
    return choice.choices[0] if choice.choices else _number(choice, choice.low or 0.0)


def last(choice: Choice) -> Any:
    """The last or largest value."""
    return choice.choices[-1] if choice.choices else _number(choice, choice.high or 0.0)


def _number(choice: Choice, value: float) -> float | int:
    return int(value) if choice.integer else value


def _set(values: dict[str, Any], path: str, value: Any) -> None:
    """Set a field by its path.

    Raises:
        ConfigurationError: the path does not lead through fields.
    """
    *parents, last_name = path.split(".")
    for name in parents:
        inner = values.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ConfigurationError(f"search: {path!r} leads through {name!r}, which has no fields")
        values = inner
    values[last_name] = value
