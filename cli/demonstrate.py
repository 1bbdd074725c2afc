"""``motion-cueing demonstrate``: drives of a controller, the optimum above all, as data to learn from."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from tyro.conf import arg

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, DataError
from ..envs.provenance import command_line, commit, hardware, now, versions
from ..envs.settings import to_dict
from ..envs.storage import check_folder
from ..evaluation.demonstrations import Demonstrator, demonstrate
from ..evaluation.metrics import measure
from ..evaluation.reporting.text import number
from ..evaluation.rollout import statistics_of
from ..evaluation.selection import find_car, find_maneuvers, find_platform
from ..evaluation.suite import CueSource, suite_progress
from ..train.algorithms.dagger.demonstrations import INDEX, DriveEntry, Index, is_kept, load_index, save_drive

_SUCCESS: Final = 0


@dataclass(frozen=True)
class DemonstrateCommand:
    """Record drives of a controller as a dataset for learning.

    Writes one .npz file a drive and index.json; see docs/demonstrations.md. The same command again goes on
    where it was stopped.
    """

    policy: Annotated[str, arg(metavar="NAME|FILE")] = "optimum"
    """Controller, by name or file."""
    objective: Literal["J", "perceived"] = "J"
    """What the optimum minimizes: J, or J of what the driver senses."""
    maneuver: Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")] = ()
    """Maneuvers and recordings, by name or cue CSV file; `all` for every one of them; default: none."""
    random: int = 0
    """Random drives beside them."""
    seed: int = 0
    """Of the random drives."""
    duration: float = 60.0
    """Of a random drive, s."""
    platform: Annotated[str, arg(metavar="NAME|FILE")] = "paper"
    """Motion base, by name or YAML file."""
    car: Annotated[str, arg(metavar="NAME|FILE")] = "sedan"
    """Car that drives named maneuvers, by name or YAML file."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("demonstrations")
    """Folder of the dataset; made if missing."""


def run(command: DemonstrateCommand) -> int:
    """Record what is not there yet.

    Raises:
        MotionCueingError: an argument is wrong, or the folder holds another recording.
    """
    check_folder("--out", command.out)
    platform = find_platform(command.platform)
    demonstrator = Demonstrator.of(_policy_name(command), platform)
    sources = _sources(command)
    index = _index(command, _setting(command, demonstrator))
    index.save(command.out)
    recorded = 0
    with suite_progress(len(sources)) as advance:
        for name, source in sources.items():
            advance(name, demonstrator.name)
            cues = _cues(name, source).resampled(demonstrator.time_step)
            if _is_done(command.out, index, name, cues):
                continue
            index = index.with_drive(_record(command.out, name, cues, demonstrator))
            index.save(command.out)
            recorded += 1
    print(_summary(command.out, index, recorded))
    return _SUCCESS


def _is_done(folder: Path, index: Index, name: str, cues: CueTrace) -> bool:
    """Whether the drive of a name is there, and is of these cues; says so if it is of others."""
    kept = next((entry for entry in index.drives if entry.name == name), None)
    if kept is None or not is_kept(folder, kept):
        return False
    if kept.cues != cues.digest():
        print(f"{name}: its cues are not those that were recorded; recorded anew")
        return False
    return True


def _policy_name(command: DemonstrateCommand) -> str:
    if command.objective == "J":
        return command.policy
    if command.policy not in ("optimum", "optimum-perceived"):
        raise ConfigurationError(f"--objective perceived is for --policy optimum, not {command.policy!r}")
    return "optimum-perceived"


def _sources(command: DemonstrateCommand) -> dict[str, CueSource]:
    """Cues by the name of the drive."""
    if command.random < 0:
        raise ConfigurationError(f"--random must not be negative, found {command.random}")
    if not command.maneuver and not command.random:
        raise ConfigurationError(
            "nothing to drive: name drives with --maneuver, or ask for random ones with --random"
        )
    sources = dict(find_maneuvers(command.maneuver, find_car(command.car)))
    if command.random:
        sources |= dict(_random_sources(command))
    return sources


def _random_sources(command: DemonstrateCommand) -> Iterator[tuple[str, CueSource]]:
    from functools import partial

    from ..envs.maneuvers.sampling import RandomDrives, drive_seeds, random_drive

    for seed in drive_seeds(command.random, command.seed):
        name = RandomDrives().plan(seed, command.duration).name
        yield f"{name}-{command.duration:g}s", partial(random_drive, seed, command.duration)


def _cues(name: str, source: CueSource) -> CueTrace:
    try:
        return source()
    except ValueError as error:
        raise DataError(f"drive {name}: {error}") from None


def _setting(command: DemonstrateCommand, demonstrator: Demonstrator) -> dict[str, Any]:
    return {
        "policy": demonstrator.name,
        "parameters": demonstrator.parameters,
        "car": to_dict(find_car(command.car)),
        "platform": to_dict(demonstrator.platform),
        "vestibular": demonstrator.vestibular.name,
        "time_step": demonstrator.time_step,
    }


def _index(command: DemonstrateCommand, setting: dict[str, Any]) -> Index:
    """The folder's index, or a new one."""
    if (command.out / INDEX).exists():
        index = load_index(command.out)
        if index.setting != json.loads(json.dumps(setting)):
            raise ConfigurationError(
                f"{command.out} holds drives of another controller, car or motion base; name another --out"
            )
        return index
    provenance = {
        "command": command_line(),
        "commit": commit(),
        "versions": versions(),
        "hardware": hardware("cpu"),
        "begun": now(),
    }
    return Index(setting, provenance)


def _record(folder: Path, name: str, cues: CueTrace, demonstrator: Demonstrator) -> DriveEntry:
    record, drive = demonstrate(demonstrator, name, cues)
    found = measure(record)
    file = f"{name}.npz"
    return DriveEntry(
        name=name,
        file=file,
        sha256=save_drive(folder, file, drive),
        source=cues.source,
        cues=cues.digest(),
        steps=len(drive),
        cue_error=found.cue_error,
        perceived_cue_error=found.perceived_cue_error,
        at_limit=found.at_limit,
        notes=statistics_of(record.metadata),
    )


def _summary(folder: Path, index: Index, recorded: int) -> str:
    steps = sum(entry.steps for entry in index.drives)
    mean = sum(entry.cue_error for entry in index.drives) / max(len(index.drives), 1)
    return f"{folder}: {len(index.drives)} drives ({recorded} new), {steps} steps, mean J {number(mean)}"
