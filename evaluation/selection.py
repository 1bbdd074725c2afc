"""From the names and files of a command line to policies, maneuvers, machines and cars."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, DataError, UnknownNameError
from ..envs.settings import load
from .benchmark import BENCHMARK, benchmark_policies
from .suite import CueSource, labels

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..envs.platform import Platform

ALL: Final = "all"
"""Every maneuver and recording."""


def is_file(name: str) -> bool:
    """Whether an argument means a file rather than a registered name."""
    return bool(Path(name).suffix) or len(Path(name).parts) > 1 or Path(name).exists()


def find_platform(name: str) -> Platform:
    """A machine by name or YAML file."""
    from ..envs.platform import get_platform, load_platform, platform_names

    if name not in platform_names() and is_file(name):
        return load_platform(_existing("platform", name))
    return get_platform(name)


def find_car(name: str) -> Car:
    """A car by name or YAML file."""
    from ..envs.car import Car, car_names, get_car

    if name not in car_names() and is_file(name):
        return load(Car, _existing("car", name))
    return get_car(name)


def find_policies(names: Sequence[str], platform: Platform) -> dict[str, str]:
    """Label and name (or file) of each policy; those meant for a machine where none is named.

    `benchmark` stands for its policies. A file is never labeled as a shipped policy: scores refer to those.
    """
    from .policies import default_policies, policy_names

    if "ladder" in names:
        raise ConfigurationError(f"unknown policy 'ladder'; it is called {BENCHMARK!r} now")
    known = policy_names()
    asked = list(names) or default_policies(platform)
    wanted = [
        name for given in asked for name in (benchmark_policies(known) if given == BENCHMARK else [given])
    ]
    found = labels(wanted, [_label("policy", name, [*known, BENCHMARK]) for name in wanted], known)
    return {label: name for name, label in found.items()}


def find_maneuvers(names: Sequence[str], car: Car) -> dict[str, CueSource]:
    """Label and source of the cues of each maneuver, recording or CSV file.

    Files are read here, so that a broken one is refused before anything is driven.
    """
    from ..envs.maneuvers import get_maneuver, get_recording, maneuver_names, recording_names

    maneuvers, recordings = maneuver_names(), recording_names()
    known = [*maneuvers, *recordings]
    wanted = [name for given in names for name in (known if given == ALL else [given])]
    found = labels(wanted, [_label("maneuver", name, [*known, ALL]) for name in wanted])
    sources: dict[str, CueSource] = {}
    for name, label in found.items():
        if name in maneuvers:
            sources[label] = partial(get_maneuver(name).drive, car)
        elif name in recordings:
            sources[label] = partial(get_recording, name)
        else:
            sources[label] = partial(_same, CueTrace.from_csv(name, label))
    return sources


def _same(cues: CueTrace) -> CueTrace:
    return cues


def _label(kind: str, name: str, known: Iterable[str]) -> str:
    """The name itself, or the stem of a file."""
    known = list(known)
    if name in known:
        return name
    if is_file(name):
        file = Path(_existing(kind, name))
        return file.name.removesuffix(".gz").removesuffix(".csv") if kind == "maneuver" else file.stem
    raise UnknownNameError(kind, name, known)


def _existing(kind: str, name: str) -> str:
    if not name:
        raise ConfigurationError(f"--{kind}: a name is empty; give a name of `motion-cueing list` or a file")
    if not Path(name).exists():
        raise DataError(f"{kind} {name}: there is no such file")
    return name
