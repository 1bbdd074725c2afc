"""What stands in an agent's file: arrays by name, and the rest as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from numpy.typing import NDArray

from ...baselines.washout import WashoutParameters
from ...envs.errors import ConfigurationError, DataError
from ...envs.platform.machines import Platform
from ...envs.settings import Positive, configuration, from_dict, to_dict
from ...envs.task.library import platform_of
from ...envs.task.options import TaskOptions
from .network import Activation, Network, Squash
from .record import Record

Arrays = dict[str, NDArray[Any]]

_MEAN: Final = "observation.mean"
_VARIANCE: Final = "observation.variance"


@configuration
class Contents:
    """Everything in an agent's file but its arrays.

    Args:
        name: Of the agent.
        task: Its environment.
        platform: The machine in full: a name in ``task`` may mean another one later.
        record: How it was made.
        activation: Of the network, as the following.
        squash: Of its last layer.
        skip: Whether the last layer sees the observation, too.
        clip: Of the normalised observation.
        layers: Of the network.
        base: Washout under the agent.
    """

    name: str
    task: TaskOptions
    platform: Platform
    record: Record
    activation: Activation
    squash: Squash
    skip: bool
    clip: Positive
    layers: int
    base: WashoutParameters | None = None


def contents_of(
    name: str, task: TaskOptions, network: Network, record: Record, base: WashoutParameters | None
) -> tuple[Arrays, dict[str, Any]]:
    """Arrays by name, and plain values, of an agent."""
    contents = Contents(
        name=name,
        task=task,
        platform=platform_of(task),
        record=record,
        activation=network.activation,
        squash=network.squash,
        skip=network.skip,
        clip=network.clip,
        layers=len(network.weights),
        base=base,
    )
    arrays: Arrays = {}
    for k, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        arrays[_weight(k)], arrays[_bias(k)] = weight, bias
    if network.mean is not None and network.variance is not None:
        arrays[_MEAN], arrays[_VARIANCE] = network.mean, network.variance
    return arrays, to_dict(contents)


def network_of(arrays: Mapping[str, NDArray[Any]], values: object, source: str) -> tuple[Contents, Network]:
    """The contents and the network of a file.

    Args:
        arrays: By name.
        values: Plain values.
        source: Of both, for messages.

    Raises:
        DataError: an array is missing, too many or of the wrong shape.
        ConfigurationError: a value is unknown, missing or out of range, or the machine is another one now.
    """
    contents = from_dict(Contents, values, source)
    _check_platform(contents, source)
    layers = range(contents.layers)
    expected = {_weight(k) for k in layers} | {_bias(k) for k in layers}
    normalised = {_MEAN, _VARIANCE} & arrays.keys()
    if arrays.keys() - normalised != expected:
        wrong = ", ".join(sorted((arrays.keys() - normalised) ^ expected))
        raise DataError(f"{source}: arrays missing or unknown: {wrong}")
    network = Network(
        weights=tuple(arrays[_weight(k)] for k in layers),
        biases=tuple(arrays[_bias(k)] for k in layers),
        activation=contents.activation,
        squash=contents.squash,
        skip=contents.skip,
        mean=arrays.get(_MEAN),
        variance=arrays.get(_VARIANCE),
        clip=contents.clip,
    )
    return contents, network


def _check_platform(contents: Contents, source: str) -> None:
    now, then = to_dict(platform_of(contents.task)), to_dict(contents.platform)
    # Words about a machine may change, what it can do may not.
    changed = [name for name in now if name != "description" and now[name] != then[name]]
    if changed:
        raise ConfigurationError(
            f"{source}: the motion base {contents.platform.name!r} differs in {', '.join(changed)} "
            "from the one the agent was trained on; use the version in its record, or train again"
        )


def _weight(k: int) -> str:
    return f"layers.{k}.weight"


def _bias(k: int) -> str:
    return f"layers.{k}.bias"
