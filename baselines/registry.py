"""Predictive controllers by name and from files; their libraries are imported only when one is made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from ..envs.errors import DataError, UnknownNameError
from ..envs.platform.machines import Platform
from ..envs.settings import read_yaml
from .policy import ForeknowingPolicy, NoMotion, Policy
from .washout import PerManeuverWashout, make_washout
from .washout.families import FAMILIES, algorithm_of, check_algorithm, family_presets, load_parameters

DESCRIPTIONS: Final = {
    "mpc": "predictive control that knows nothing of the drive ahead",
    "mpc-preview": "predictive control that sees 2 s of the drive ahead",
    "mpc-full": "predictive control that knows the drive over its whole horizon, 8 s",
    "nmpc": "mpc with exact equations, solved until it converges",
    "nmpc-preview": "mpc-preview with exact equations, solved until it converges",
}
"""One line about each by name."""

PREDICTIVE: Final = ("mpc", "nmpc")
"""What a file calls them, as its ``algorithm``."""


def make_predictive(name: str, platform: Platform) -> Policy | ForeknowingPolicy:
    """The controller of a name of :data:`DESCRIPTIONS` for a machine.

    Raises:
        ConfigurationError: a library is missing; the message says how to get it.
    """
    from .mpc import load_mpc, make_mpc

    return make_mpc(platform, load_mpc(name), name)


def predictive_from_file(path: str | Path, platform: Platform) -> Policy | ForeknowingPolicy:
    """The controller with the parameters of a file.

    Args:
        path: Of the file, whose ``algorithm`` is one of :data:`PREDICTIVE`.
        platform: The machine.

    Raises:
        ConfigurationError: a field is wrong, or a library is missing.
    """
    from .mpc import load_mpc, make_mpc

    return make_mpc(platform, load_mpc(path), Path(path).stem)


# Policies by name or file.


@dataclass(frozen=True)
class Entry:
    """A policy that goes by a name.

    Args:
        description: One line.
        make: The policy for a machine; libraries that only it needs are imported here.
    """

    description: str
    make: Callable[[Platform], Policy | ForeknowingPolicy]


def _predictive(name: str) -> Callable[[Platform], Policy | ForeknowingPolicy]:
    return lambda platform: make_predictive(name, platform)


def _optimum(objective: Literal["J", "perceived"]) -> Callable[[Platform], Policy | ForeknowingPolicy]:
    def make(platform: Platform) -> Policy | ForeknowingPolicy:
        from .optimum import Optimum, OptimumOptions

        return Optimum(platform, OptimumOptions(objective=objective), progress=False)

    return make


_ENTRIES: Final[Mapping[str, Entry]] = {
    NoMotion.name: Entry("the machine stands still", lambda platform: NoMotion()),
    PerManeuverWashout.name: Entry(
        "an oracle: classical with the best set for each standard maneuver", PerManeuverWashout
    ),
    **{name: Entry(told, _predictive(name)) for name, told in DESCRIPTIONS.items()},
    "optimum": Entry("the least J there is: the whole drive known, its motion planned", _optimum("J")),
    "optimum-perceived": Entry("the same for the least perceived J", _optimum("perceived")),
}
"""Policies by name, beside the presets of the washouts."""

_RENAMED: Final = {"classical-ceiling": PerManeuverWashout.name}

_DEFAULT: Final = ("no-motion", "classical", "classical-tuned", "est1", "brk")


def policy_names() -> list[str]:
    """Names :func:`make_policy` knows."""
    return [*_ENTRIES, *family_presets()]


def default_policies() -> list[str]:
    """Policies an evaluation compares unless told otherwise."""
    return list(_DEFAULT)


def describe_policy(name: str) -> str:
    """One line about a policy."""
    if name in _ENTRIES:
        return _ENTRIES[name].description
    return str(load_parameters(name).description)


def make_policy(name: str | Path, platform: Platform) -> Policy | ForeknowingPolicy:
    """A policy for a machine, by name or from the YAML file of a washout or a predictive controller.

    Raises:
        UnknownNameError: no policy has this name.
        DataError: the file does not exist or cannot be read.
        ConfigurationError: a field of the file is wrong.
    """
    if str(name) in _ENTRIES:
        return _ENTRIES[str(name)].make(platform)
    if Path(name).suffix in (".yaml", ".yml"):
        return _from_file(Path(name), platform)
    if str(name) in family_presets():
        return make_washout(load_parameters(str(name)), platform.cab)
    if Path(name).exists():
        raise DataError(
            f"{name}: not a policy; expected the .yaml file of a washout or a predictive controller"
        )
    raise UnknownNameError("policy", str(name), policy_names(), _RENAMED)


def _from_file(path: Path, platform: Platform) -> Policy | ForeknowingPolicy:
    values = read_yaml(path)
    algorithm = check_algorithm(algorithm_of(values), path, (*FAMILIES, *PREDICTIVE))
    if isinstance(values, dict) and algorithm in PREDICTIVE:
        return predictive_from_file(path, platform)
    return make_washout(load_parameters(path), platform.cab)
