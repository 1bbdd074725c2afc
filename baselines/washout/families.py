"""The washouts by algorithm: parameter sets of any family by name or file, and their policies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias

from pydantic import Discriminator, Tag

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError, UnknownNameError
from ...envs.platform.machines import Cab, Platform
from ...envs.settings import configuration, from_dict, read_yaml
from ...envs.simulator.simulator import TIME_STEP
from ..policy import WHOLE_DRIVE, Policy
from ..presets import named
from .adaptive import AdaptiveParameters, AdaptiveWashout, adaptive_presets, load_adaptive
from .adaptive.policy import ADAPTIVE
from .optimal import OptimalParameters, OptimalWashout, load_optimal, optimal_presets
from .optimal.policy import OPTIMAL
from .parameters import WashoutParameters, load_washout, washout_presets
from .policy import CLASSICAL, ClassicalWashout, Family


def algorithm_of(parameters: Any) -> str:
    """Name of the family that a parameter set, or the values of one in a file, belong to."""
    if isinstance(parameters, dict):
        return str(parameters.get("algorithm", "classical"))
    return str(getattr(parameters, "algorithm", "classical"))


AnyWashout: TypeAlias = Annotated[
    Annotated[WashoutParameters, Tag("classical")]
    | Annotated[AdaptiveParameters, Tag("adaptive")]
    | Annotated[OptimalParameters, Tag("optimal")],
    Discriminator(algorithm_of),
]
"""A parameter set of any family."""


@dataclass(frozen=True)
class Algorithm:
    """One family, for people and searches.

    Args:
        description: What it is called in a sentence.
        start: The preset that is set by hand.
        parameters: Class of its parameter sets.
        kernels: It as kernels.
        presets: Names of its shipped sets.
        load: A set by preset name.
        make: The policy of a set on a machine.
    """

    description: str
    start: str
    parameters: type[Any]
    kernels: Family
    presets: Callable[[], list[str]]
    load: Callable[[str], AnyWashout]
    make: Callable[[Any, Cab], Policy]


ALGORITHMS: Final[Mapping[str, Algorithm]] = {
    "classical": Algorithm(
        "the classical washout",
        "classical",
        WashoutParameters,
        CLASSICAL,
        washout_presets,
        load_washout,
        ClassicalWashout,
    ),
    "adaptive": Algorithm(
        "the adaptive washout",
        "adaptive",
        AdaptiveParameters,
        ADAPTIVE,
        adaptive_presets,
        load_adaptive,
        AdaptiveWashout,
    ),
    "optimal": Algorithm(
        "the optimal washout",
        "optimal-washout",
        OptimalParameters,
        OPTIMAL,
        optimal_presets,
        load_optimal,
        OptimalWashout,
    ),
}
"""Every family by name."""


def family_presets() -> list[str]:
    """Names of the shipped sets of all families."""
    return [name for algorithm in ALGORITHMS.values() for name in algorithm.presets()]


def load_parameters(name: str | Path) -> AnyWashout:
    """A parameter set of any family, by preset name or from a YAML file.

    A file says by ``algorithm`` which family it is of; without, it is a classical one.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    if Path(name).suffix in (".yaml", ".yml"):
        values = read_yaml(name)
        algorithm = ALGORITHMS[check_algorithm(algorithm_of(values), name, ALGORITHMS)]
        cls = algorithm.parameters
        return from_dict(cls, named(cls, values, name), str(name))  # type: ignore[no-any-return]
    for algorithm in ALGORITHMS.values():
        if str(name) in algorithm.presets():
            return algorithm.load(str(name))
    raise UnknownNameError("washout preset", str(name), family_presets())


def check_algorithm(algorithm: str, path: str | Path, known: Iterable[str]) -> str:
    """The algorithm that a file names.

    Args:
        algorithm: Found in the file.
        path: Of the file, for the message.
        known: That it may be.

    Raises:
        ConfigurationError: it is none of them.
    """
    if algorithm not in known:
        names = ", ".join(known)
        raise ConfigurationError(f"{path}: field 'algorithm' is {algorithm!r}; it is one of {names}")
    return algorithm


def load_of(family: str, name: str | Path) -> AnyWashout:
    """A parameter set of one family, by preset name or from a YAML file.

    Raises:
        ConfigurationError: it is of another family; otherwise as :func:`load_parameters`.
    """
    found = load_parameters(name)
    if algorithm_of(found) != family:
        raise ConfigurationError(
            f"{name} is a set of {ALGORITHMS[algorithm_of(found)].description}; "
            f"give one of {ALGORITHMS[family].description}"
        )
    return found


def make_washout(parameters: AnyWashout, cab: Cab) -> Policy:
    """The policy of a parameter set of any family, for a cab."""
    return ALGORITHMS[algorithm_of(parameters)].make(parameters, cab)


def kernels_of(parameters: AnyWashout) -> Family:
    """The family of a parameter set as kernels."""
    return ALGORITHMS[algorithm_of(parameters)].kernels


# An oracle: for each standard maneuver the parameter set that is best for it alone.


_SETS: Final = Path(__file__).parent / "presets" / "per-maneuver"
PER_MANEUVER: Final = "classical-per-maneuver"


@configuration
class PerManeuverParameters:
    """The sets.

    Args:
        sets: By maneuver.
    """

    sets: dict[str, WashoutParameters]


def tuned_maneuvers() -> list[str]:
    """Names of the maneuvers there are sets for."""
    return sorted(path.stem for path in _SETS.glob("*.yaml"))


def load_per_maneuver(maneuver: str) -> WashoutParameters:
    """The best set for a maneuver.

    Raises:
        UnknownNameError: there is none.
    """
    if maneuver not in tuned_maneuvers():
        raise UnknownNameError(f"maneuver of {PER_MANEUVER}", maneuver, tuned_maneuvers())
    return load_washout(_SETS / f"{maneuver}.yaml")


class PerManeuverWashout(Policy):
    """The classical washout with the best set for the maneuver at hand: an oracle, not a controller.

    It shows how far the structure of the classical washout reaches. Without a turntable it yaws the cab with
    the hexapod (k_T = 0), as the paper's EST3: the sets are tuned on a machine with one.

    Args:
        platform: The machine.
        dt: Time step, s.
    """

    name = PER_MANEUVER
    information = WHOLE_DRIVE

    def __init__(self, platform: Platform, dt: float = TIME_STEP) -> None:
        self.platform: Platform = platform
        self.time_step: float = dt
        sets = {name: load_per_maneuver(name) for name in tuned_maneuvers()}
        if platform.turntable is None:
            sets = {name: replace(tuned, turntable_share=0.0) for name, tuned in sets.items()}
        self.parameters: PerManeuverParameters = PerManeuverParameters(sets)

    def for_drive(self, cues: CueTrace) -> Policy:
        """The washout for a maneuver, found by the name of its cues.

        Raises:
            UnknownNameError: no set has been tuned for it.
        """
        sets = self.parameters.sets
        if cues.name not in sets:
            raise UnknownNameError(f"maneuver of {self.name}", cues.name, sets)
        return ClassicalWashout(replace(sets[cues.name], name=self.name), self.platform.cab, self.time_step)
