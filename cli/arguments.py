"""Arguments of commands: their types, and the policies, maneuvers, platforms and cars that they name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from cyclopts import Parameter, Token

from ..envs.errors import ConfigurationError, DataError, MotionCueingError, UnknownNameError
from ..envs.storage import is_file

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..envs.cues import CueTrace
    from ..envs.platform import Platform
    from ..evaluation.suite import CueSource

ALL: Final = "all"
"""Stands for every maneuver and recording, or every motion base."""
BENCHMARK: Final = "benchmark"
"""Stands for the policies of the benchmark."""


def whole_number(kind: Any, tokens: Sequence[Token]) -> int:
    """A whole number, also as ``1e6``."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        value = float(text)
        if value != round(value):
            raise ValueError(f"{text} is no whole number") from None
        return round(value)


def option(metavar: str, **others: Any) -> Parameter:
    """Of an option.

    Args:
        metavar: What stands for its value in the help.
        **others: More about it, as Cyclopts has it; its version 4, for Python 3.10, lacks some.
    """
    options = {"metavar": metavar, **others}
    return Parameter(**{name: value for name, value in options.items() if hasattr(Parameter, name)})


def with_flags(message: str, names: Iterable[str]) -> str:
    """A message with options in place of the fields it names: ``--gaps bridge`` for ``gaps='bridge'``.

    Args:
        message: Of a library.
        names: Fields that are options. One without an underscore may be a plain word, unless a value follows.
    """
    for name in names:
        flag = "--" + name.replace("_", "-")
        message = re.sub(rf"(?<![\w-]){name}='?([\w.+-]+)'?", rf"{flag} \1", message)
        if "_" in name:
            message = re.sub(rf"(?<![\w-]){name}(?!\w)", flag, message)
    return message


def several(metavar: str, **others: Any) -> Parameter:
    """Of an option that takes one or more values."""
    return option(metavar, consume_multiple=(1, None), **others)


def named(*titles: str) -> Callable[[object], dict[str, str]]:
    """Completes the names that `motion-cueing list` shows under these titles, each with its description."""

    def names(context: object) -> dict[str, str]:
        from .list import catalogue

        return {name: line for title, rows in catalogue() if title in titles for name, line in rows}

    return names


_POLICIES: Final = named("Policies")
_MANEUVERS: Final = named("Maneuvers", "Recorded drives")
_POLICY: Final = "NAME|FILE|MODULE:CLASS"
Whole = Annotated[int, option("N", converter=whole_number)]
Name = Annotated[str, option("NAME|FILE")]
Names = Annotated[tuple[str, ...], several("NAME|FILE ...")]
PolicyName = Annotated[
    str, option(_POLICY, completer=_POLICIES, help="Policy, by name, by file, or a class of your own.")
]
PolicyNames = Annotated[
    tuple[str, ...],
    several(
        f"{_POLICY} ...",
        completer=_POLICIES,
        help="Policies, by name, by file, or classes of your own; `benchmark` for those of the benchmark.",
    ),
]
ManeuverName = Annotated[
    str, option("NAME|FILE", completer=_MANEUVERS, help="Maneuver or recording, by name or cue CSV file.")
]
ManeuverNames = Annotated[
    tuple[str, ...],
    several(
        "NAME|FILE ...",
        completer=_MANEUVERS,
        help="Maneuvers and recordings, by name or cue CSV file; `all` for every one of them.",
    ),
]
PlatformName = Annotated[
    str, option("NAME|FILE", completer=named("Motion bases"), help="Motion base, by name or YAML file.")
]
CarName = Annotated[str, option("NAME|FILE", completer=named("Cars"), help="Car, by name or YAML file.")]
ScaleText = Annotated[
    str,
    option(
        "SCALE",
        help="Motion scale of the reference: a number, or one each of force, rates or axes x, y, z, roll, "
        "pitch and yaw, as `force=0.6,rates=0.5`.",
    ),
]
OutFolder = Annotated[Path, option("DIR", help="Folder for everything that is written; made if missing.")]
Workers = Annotated[
    int, option("N", converter=whole_number, help="Processes or threads that work at a time.")
]
Compensate = Annotated[
    bool,
    Parameter(
        help="Let policies know the machine's lag and dead time, and compensate them: "
        "cues are taken earlier, or predicted."
    ),
]
Fresh = Annotated[bool, Parameter(help="Begin anew instead of going on from what is in --out.")]


# From names and files to what they mean.


def with_previews(
    sources: Mapping[str, CueSource], preview: Literal["true", "held", "predicted"], predictor: str
) -> dict[str, CueSource]:
    """The same drives, whose previews come from somewhere else.

    Raises:
        DataError: the predictor's file is missing or broken.
    """
    from ..envs.task.predictor import find_predictor

    if preview == "predicted":
        find_predictor(predictor)
    return {label: partial(_previewed, source, preview, predictor) for label, source in sources.items()}


def _previewed(source: CueSource, preview: Literal["true", "held", "predicted"], predictor: str) -> CueTrace:
    from ..envs.task.predictor import with_preview

    return with_preview(source(), preview, predictor)


def find_platform(name: str) -> Platform:
    """A machine by name or YAML file."""
    from ..envs.platform import get_platform, load_platform, platform_names

    if name not in platform_names() and is_file(name):
        return load_platform(_existing("platform", name))
    return get_platform(name)


def find_platforms(names: Sequence[str], ablations: bool = False) -> dict[str, Platform]:
    """Machines by label; ``all`` stands for every whole one.

    Args:
        names: Names and YAML files.
        ablations: Whether each is followed by itself without turntable, without carriage, and without both.

    Raises:
        MotionCueingError: there is no such machine, or two have one name.
    """
    from ..envs import platform

    named = [name for given in names for name in (platform.platform_names() if given == ALL else [given])]
    machines: dict[str, Platform] = {}
    for name in dict.fromkeys(named):
        machine = find_platform(name)
        for one in [machine, *(platform.ablations(machine) if ablations else ())]:
            if machines.setdefault(one.name, one) != one:
                raise ConfigurationError(
                    f"two motion bases have the name {one.name!r}; rename one in its file"
                )
    return machines


def find_car(name: str) -> Car:
    """A car by name or YAML file."""
    from ..envs.car import Car, car_names, get_car
    from ..envs.settings import load

    if name not in car_names() and is_file(name):
        return load(Car, _existing("car", name))
    return get_car(name)


def find_policies(names: Sequence[str], platform: Platform) -> dict[str, str]:
    """Label and name (or file) of each policy; those meant for a machine where none is named.

    A file is never labeled as a shipped policy: normalized scores refer to those.
    """
    from ..evaluation.benchmark.table import benchmark_policies
    from ..evaluation.policies import default_policies, is_reference, name_of_reference, policy_names
    from ..evaluation.suite import labels

    known = policy_names()
    expanded = [
        name
        for given in list(names) or default_policies(platform)
        for name in (benchmark_policies(known) if given == BENCHMARK else [given])
    ]
    stems = [
        name_of_reference(name, platform)
        if is_reference(name)
        else _stem("policy", name, [*known, BENCHMARK])
        for name in expanded
    ]
    return {label: name for name, label in labels(expanded, stems, known).items()}


def make_policies(
    names: Sequence[str], platform: Platform, make: Callable[[str, Platform], Any] | None = None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Policies by label, and the reasons why policies of the benchmark are skipped on this machine.

    Args:
        names: Names, files and references.
        platform: The machine.
        make: Makes a policy, and refuses one that is of no use.

    Raises:
        MotionCueingError: a policy named by the user cannot be made.
    """
    policies: dict[str, Any] = {}
    skipped: dict[str, str] = {}
    for label, name in find_policies(names, platform).items():
        try:
            policies[label] = (make or make_policy)(name, platform)
        except MotionCueingError as error:
            if BENCHMARK not in names or name in names:
                raise
            skipped[label] = str(error)
    return policies, skipped


def make_policy(name: str, platform: Platform, compensate: bool = False) -> Any:
    """A policy for a machine, by name, by file, or by reference to a class.

    Args:
        name: Of the policy.
        platform: The machine.
        compensate: Whether its lag and dead time are compensated.
    """
    from ..evaluation import policies

    if not compensate:
        return policies.make_policy(name, platform)
    from ..baselines.compensation import CompensationOptions

    return policies.make_policy(name, platform, compensation=CompensationOptions())


def known_lateness(compensate: bool, error: float) -> tuple[float, ...]:
    """Lateness over the true one that policies of a study are given: none, the true one, and wrong ones.

    Raises:
        ConfigurationError: the error is not within 0 and 1, or nothing is compensated.
    """
    if not 0.0 <= error < 1.0:
        raise ConfigurationError(f"--lateness-error must be at least 0 and below 1, found {error:g}")
    if not compensate:
        return ()
    return (1.0, 1.0 - error, 1.0 + error) if error else (1.0,)


def find_maneuvers(names: Sequence[str], car: Car, suite: int = 1) -> dict[str, CueSource]:
    """Label and source of the cues of each maneuver, recording or CSV file; ``all`` is those of a suite.

    Files are read here, so that a broken one is refused before anything is driven.
    """
    from ..envs.cues import CueTrace
    from ..envs.maneuvers import get_maneuver, get_recording, maneuver_names, recording_names
    from ..evaluation.suite import labels

    maneuvers, recordings = maneuver_names(None), recording_names()
    known = [*maneuvers, *recordings]
    every = [*maneuver_names(suite), *recordings]
    expanded = [name for given in names for name in (every if given == ALL else [given])]
    by_name = labels(expanded, [_stem("maneuver", name, [*known, ALL]) for name in expanded])
    sources: dict[str, CueSource] = {}
    for name, label in by_name.items():
        if name in maneuvers:
            sources[label] = partial(get_maneuver(name).drive, car)
        elif name in recordings:
            sources[label] = partial(get_recording, name)
        else:
            cues = CueTrace.from_csv(name, label)
            sources[label] = partial(_same, cues)
    return sources


def _same(cues: CueTrace) -> CueTrace:
    return cues


def find_maneuver(name: str, car: Car) -> tuple[str, CueSource]:
    """Label and source of the cues of one maneuver.

    Raises:
        MotionCueingError: there is none, or the name stands for several.
    """
    sources = find_maneuvers((name,), car)
    if len(sources) != 1:
        raise ConfigurationError(f"--maneuver {name} means several drives; name one")
    return next(iter(sources.items()))


def _stem(kind: str, name: str, known: Iterable[str]) -> str:
    """The name itself, or the stem of a file."""
    known = list(known)
    if name in known:
        return name
    if is_file(name):
        file = Path(_existing(kind, name)).name
        return file.removesuffix(".gz").removesuffix(".csv") if kind == "maneuver" else Path(file).stem
    from ..baselines.registry import POLICIES

    renamed = {**POLICIES.renamed, "ladder": BENCHMARK} if kind == "policy" else None
    raise UnknownNameError(kind, name, known, renamed)


def _existing(kind: str, name: str) -> str:
    if not name:
        raise ConfigurationError(f"{kind}: a name is empty; give one of `motion-cueing list` or a file")
    if not Path(name).exists():
        raise DataError(f"{kind} {name}: there is no such file")
    return name
