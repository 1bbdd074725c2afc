"""Washout families by name: what one declares, how it is registered, and parameter sets of any of them.

A family is a motion cueing algorithm of filters: classical, adaptive, optimal. Its folder declares everything
in one :class:`Family`: parameters, kernels, presets, and the coordinates of a search. One registration adds
it to policies, presets, batches and tuning::

    from motion_cueing.baselines.washout import register_family

    register_family("mine", FAMILY, "my washout")

An installed package does the same by an entry point of the group ``motion_cueing.washouts``. A parameter file
names its family as ``algorithm``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Protocol, TypeAlias

from pydantic import PlainValidator

from ...envs.errors import ConfigurationError, UnknownNameError
from ...envs.registry import Registry
from ...envs.settings import Vector2, Vector3, configuration, from_dict, load, named, preset_names, read_yaml
from ..registry import register_presets
from .kernels.launch import Kernels


class FamilyParameters(Protocol):
    """A parameter set of any family; a configuration. Those of other families have a field ``algorithm``."""

    @property
    def name(self) -> str:
        """Name of the set."""
        ...

    @property
    def description(self) -> str:
        """One line for people."""
        ...

    @property
    def turntable_share(self) -> float:
        """k_T: 1 turns the cab with the turntable, 0 with the hexapod."""
        ...

    @property
    def start_carriage(self) -> Vector2:
        """Where the carriage begins a drive, m."""
        ...

    @property
    def start_hexapod(self) -> Vector3:
        """Where the hexapod begins a drive, m from neutral."""
        ...


@configuration
class Coordinate:
    """One number that a search may change.

    Args:
        path: Its place in the parameters, as "hps.0.frequency".
        low: Smallest value, in the unit of the parameter.
        high: Largest value.
        log: Whether equal steps are equal factors.
    """

    path: str
    low: float
    high: float
    log: bool = True

    def value(self, place: float) -> float:
        """The value at a place between 0 (``low``) and 1 (``high``)."""
        inside = min(max(float(place), 0.0), 1.0)
        if self.log:
            return float(self.low * (self.high / self.low) ** inside)
        return self.low + (self.high - self.low) * inside

    def place(self, value: float) -> float:
        """The place of a value; values outside of the range at its nearer end."""
        inside = min(max(value, self.low), self.high)
        if self.log:
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)


def coordinates(path: str, count: int, bounds: tuple[float, float], log: bool = True) -> list[Coordinate]:
    """Coordinates of several axes with the same range; ``{}`` in the path is the axis."""
    return [Coordinate(path.format(axis), *bounds, log) for axis in range(count)]


@dataclass(frozen=True)
class Family:
    """A washout algorithm.

    Args:
        name: Name in files (``algorithm``) and commands.
        title: Name in sentences: "the adaptive washout".
        parameters: Configuration class of its parameter sets.
        kernels: Warp kernels, see :func:`.kernels.launch.make_kernels`.
        presets: Folder of its parameter sets, one YAML file each.
        start: Preset that is set by hand: the default, and where a search begins.
        coordinates: Numbers that a search may change.
    """

    name: str
    title: str
    parameters: type[Any]
    kernels: Kernels
    presets: Path
    start: str
    coordinates: tuple[Coordinate, ...]


FAMILIES: Final[Registry[Family]] = Registry("algorithm", "motion_cueing.washouts")
"""Every family by name."""


def register_family(name: str, family: Family | str, description: str = "") -> None:
    """Add a family.

    Args:
        name: ``Family.name``.
        family: The family, whose presets become policies by name; or ``"module:attribute"`` where to find it.
        description: One line for lists.
    """
    FAMILIES.register(name, family, description)
    if isinstance(family, Family):
        register_presets(family.presets)


register_family("classical", f"{__package__}.classical.family:FAMILY", "the classical washout")
register_family("adaptive", f"{__package__}.adaptive.family:FAMILY", "the adaptive washout")
register_family("optimal", f"{__package__}.optimal.family:FAMILY", "the optimal washout")


def algorithm_of(parameters: Any) -> str:
    """Name of the family of a parameter set, or of the values of one in a file; default: classical."""
    if isinstance(parameters, dict):
        return str(parameters.get("algorithm", "classical"))
    return str(getattr(parameters, "algorithm", "classical"))


def family_of(parameters: FamilyParameters) -> Family:
    """Family of a parameter set."""
    return FAMILIES[algorithm_of(parameters)]


def check_algorithm(algorithm: str, path: str | Path, known: Iterable[str]) -> str:
    """The algorithm that a file names.

    Args:
        algorithm: As the file has it.
        path: Of the file, for the message.
        known: Algorithms to choose from.

    Raises:
        ConfigurationError: it is none of them.
    """
    if algorithm not in known:
        names = ", ".join(known)
        raise ConfigurationError(f"{path}: field 'algorithm' is {algorithm!r}; it is one of {names}")
    return algorithm


def family_presets() -> list[str]:
    """Names of the shipped sets of all families."""
    return [name for family in FAMILIES for name in preset_names(FAMILIES[family].presets)]


def load_parameters(name: str | Path, platform: str | None = None) -> Any:
    """A parameter set of any family, by preset name or from a YAML file.

    Args:
        name: Of the preset or the file.
        platform: Name of a motion base, whose own set of this name is taken where one was tuned for it.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    if Path(name).suffix in (".yaml", ".yml"):
        values = read_yaml(name)
        kind = FAMILIES[check_algorithm(algorithm_of(values), name, FAMILIES)].parameters
        return from_dict(kind, named(kind, values, name), str(name))
    for family in map(FAMILIES.__getitem__, FAMILIES):
        if str(name) in preset_names(family.presets):
            own = family.presets / str(platform) / f"{name}.yaml"
            return load(family.parameters, own if own.is_file() else family.presets / f"{name}.yaml")
    raise UnknownNameError("washout preset", str(name), family_presets())


def load_of(family: str, name: str | Path) -> Any:
    """A parameter set of one family, by preset name or from a YAML file.

    Raises:
        ConfigurationError: it is of another family; otherwise as :func:`load_parameters`.
    """
    parameters = load_parameters(name)
    if algorithm_of(parameters) != family:
        raise ConfigurationError(
            f"{name} is a set of {family_of(parameters).title}; give one of {FAMILIES[family].title}"
        )
    return parameters


def _parsed(values: Any) -> Any:
    """A parameter set, from itself or from plain values."""
    family = FAMILIES[check_algorithm(algorithm_of(values), "parameters", FAMILIES)]
    if isinstance(values, dict):
        return from_dict(family.parameters, named(family.parameters, values, "parameters"), family.title)
    if not isinstance(values, family.parameters):
        raise ConfigurationError(f"expected the parameters of a washout, found {type(values).__name__}")
    return values


if TYPE_CHECKING:
    AnyWashout: TypeAlias = FamilyParameters
else:
    AnyWashout = Annotated[Any, PlainValidator(_parsed)]
"""A parameter set of any family, as the field of a configuration."""
