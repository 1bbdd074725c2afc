"""An agent's file: safetensors with arrays by name, and JSON with version and checksum as metadata.

It holds the network, the task with its platform, and the record of how the agent was made.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from ...baselines.mpc.parameters import MpcParameters
from ...baselines.washout.families import AnyWashout, FamilyParameters
from ...envs.errors import ConfigurationError, DataError
from ...envs.limits import LARGEST_AGENT, MOST_LAYERS, check_size, parse_json
from ...envs.platform.machines import Platform
from ...envs.settings import NonNegative, Positive, configuration, to_dict
from ...envs.storage import write_bytes
from ...envs.task.episode import platform_of
from ...envs.task.options import TaskOptions
from .names import LENGTH, METADATA
from .network import Activation, LstmLayer, Network, PolicyNetwork, Squash
from .recurrent import RecurrentNetwork


@configuration
class Record:
    """How an agent was made; everything that is needed to make it again.

    Args:
        algo: The algorithm.
        seed: Of the training.
        command: The command line.
        steps: Actions taken in training, over all environments.
        wall_time: Of the training, s.
        hardware: The machine it was trained on.
        versions: Of this package and the libraries, by name.
        created: When, ISO 8601.
        validation: J on the validation drives; None where it was not measured.
        initial: How the agent was made that the training began with; None where it began anew.
    """

    algo: str
    seed: int
    command: str = ""
    steps: int = 0
    wall_time: NonNegative = 0.0
    hardware: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    created: str = ""
    validation: NonNegative | None = None
    initial: Record | None = None


Arrays = dict[str, NDArray[Any]]
Layers = Annotated[int, Field(ge=0, le=MOST_LAYERS)]

_MEAN: Final = "observation.mean"
_VARIANCE: Final = "observation.variance"
_BASE: Final = "base."
"""Before the names of arrays of the agent under an agent."""


@configuration
class Contents:
    """Everything in an agent's file but its arrays.

    Args:
        name: Of the agent.
        task: Its environment.
        platform: The machine in full: a name in ``task`` may mean another one later.
        record: How it was made.
        activation: Of the network, as the following.
        squash: Of its output layer.
        skip: Whether there is a skip connection to the output layer.
        clip: Of the normalized observation.
        layers: Of the network.
        base: Parameters of the washout or the predictive controller under the agent.
        bound: Of its actions.
        agent: The agent under the agent.
        memory: LSTM layers of the network, before those that ``layers`` counts.
    """

    name: str
    task: TaskOptions
    platform: Platform
    record: Record
    activation: Activation
    squash: Squash
    skip: bool
    clip: Positive
    layers: Layers
    base: MpcParameters | AnyWashout | None = None
    bound: Positive = 1.0
    agent: Contents | None = None
    memory: Layers = 0


def contents_of(
    name: str,
    task: TaskOptions,
    network: PolicyNetwork,
    record: Record,
    base: MpcParameters | FamilyParameters | tuple[Arrays, Contents] | None,
) -> tuple[Arrays, Contents]:
    """Arrays by name, and contents, of an agent; ``base`` is a parameter set, or the same of an agent."""
    head = network.head
    below, inner = base if isinstance(base, tuple) else ({}, None)
    contents = Contents(
        name=name,
        task=task,
        platform=platform_of(task),
        record=record,
        activation=head.activation,
        squash=head.squash,
        skip=head.skip,
        clip=network.clip,
        layers=len(head.weights),
        base=None if isinstance(base, tuple) else base,
        bound=network.bound,
        agent=inner,
        memory=len(network.lstm),
    )
    arrays: Arrays = {f"{_BASE}{key}": array for key, array in below.items()}
    for k, (weight, bias) in enumerate(zip(head.weights, head.biases, strict=True)):
        arrays[_weight(k)], arrays[_bias(k)] = weight, bias
    for k, layer in enumerate(network.lstm):
        arrays |= zip(_lstm(k), layer, strict=True)
    if network.mean is not None and network.variance is not None:
        arrays[_MEAN], arrays[_VARIANCE] = network.mean, network.variance
    return arrays, contents


def network_of(arrays: Mapping[str, NDArray[Any]], contents: Contents, source: str) -> PolicyNetwork:
    """The network of an agent.

    Args:
        arrays: By name, those of the agent under it left out.
        contents: Of its file.
        source: Of both, for messages.

    Raises:
        DataError: an array is missing, too many or of the wrong shape.
        ConfigurationError: the machine is another one now.
    """
    _check_platform(contents, source)
    layers, memory = range(contents.layers), [_lstm(k) for k in range(contents.memory)]
    expected = {_weight(k) for k in layers} | {_bias(k) for k in layers}
    expected |= {name for names in memory for name in names}
    normalized = {_MEAN, _VARIANCE} & arrays.keys()
    if arrays.keys() - normalized != expected:
        wrong = ", ".join(sorted((arrays.keys() - normalized) ^ expected))
        raise DataError(f"{source}: arrays missing or unknown: {wrong}")
    mean, variance = arrays.get(_MEAN), arrays.get(_VARIANCE)
    head = partial(
        Network,
        weights=tuple(arrays[_weight(k)] for k in layers),
        biases=tuple(arrays[_bias(k)] for k in layers),
        activation=contents.activation,
        squash=contents.squash,
        skip=contents.skip,
        bound=contents.bound,
    )
    if not memory:
        return head(mean=mean, variance=variance, clip=contents.clip)
    lstm = tuple(LstmLayer(*(arrays[name] for name in names)) for names in memory)
    return RecurrentNetwork(lstm, head(), mean, variance, contents.clip)


def arrays_below(arrays: Mapping[str, NDArray[Any]]) -> tuple[Arrays, Arrays]:
    """The arrays of an agent, and those of the agent under it."""
    own = {name: array for name, array in arrays.items() if not name.startswith(_BASE)}
    below = {name[len(_BASE) :]: array for name, array in arrays.items() if name.startswith(_BASE)}
    return own, below


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


def _lstm(k: int) -> list[str]:
    return [f"lstm.{k}.{name}" for name in LstmLayer._fields]


# An agent's file: safetensors with one entry of metadata, JSON with version and checksum.


FORMAT: Final = 1
"""Version of the file; a reader refuses newer ones."""


def write(path: str | Path, arrays: Mapping[str, NDArray[Any]], values: Mapping[str, Any]) -> None:
    """Write arrays and plain values, whole or not at all; the same contents give the same bytes."""
    about = {"format": FORMAT, "sha256": checksum(arrays, values), "contents": values}
    plain = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    # One entry: the library writes several in an order that changes.
    write_bytes(path, save(plain, metadata={METADATA: json.dumps(about, sort_keys=True)}))


def read(path: str | Path) -> tuple[dict[str, NDArray[Any]], Any]:
    """Arrays and plain values of a file that :func:`write` wrote.

    Raises:
        DataError: the file is missing, broken, something else, or of a newer version.
    """
    _check_kind(path)
    try:
        with safe_open(path, framework="numpy") as file:
            about = _about(path, file.metadata())
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, TypeError, OverflowError) as error:
        raise DataError(f"{path}: broken or cut off ({error}); copy or download it again") from None
    if about["sha256"] != checksum(arrays, about["contents"]):
        raise DataError(f"{path}: damaged, its checksum does not fit; copy or download it again")
    return arrays, about["contents"]


def checksum(arrays: Mapping[str, NDArray[Any]], values: Mapping[str, Any]) -> str:
    """SHA-256 of everything in a file: the values as sorted JSON, then the arrays by name."""
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _check_kind(path: str | Path) -> None:
    try:
        with open(path, "rb") as file:
            head = file.read(LENGTH + 1)
        check_size(path, LARGEST_AGENT)
    except FileNotFoundError:
        raise DataError(f"agent {path}: there is no such file") from None
    except OSError as error:
        raise DataError(f"agent {path}: cannot be read ({error.strerror})") from None
    if head[LENGTH:] != b"{":
        raise _foreign(path)


def _about(path: str | Path, metadata: Mapping[str, str] | None) -> dict[str, Any]:
    if not metadata or METADATA not in metadata:
        raise _foreign(path)
    try:
        about = parse_json(metadata[METADATA])
        version = int(about["format"])
    except (ValueError, KeyError, TypeError, OverflowError):
        raise DataError(f"{path}: damaged, its description is no JSON; copy or download it again") from None
    if version > FORMAT:
        raise DataError(
            f"{path}: an agent of format {version}, this package reads {FORMAT}; update motion-cueing-gym"
        )
    if not {"sha256", "contents"} <= about.keys():
        raise DataError(f"{path}: damaged, its checksum or contents are missing; copy or download it again")
    return dict(about)


def _foreign(path: str | Path) -> DataError:
    return DataError(f"{path}: not an agent; expected a .safetensors file written by `motion-cueing train`")
