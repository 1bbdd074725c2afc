"""``motion-cueing demonstrate``: drives of a controller, the optimum above all, as data to learn from."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ..envs.errors import ConfigurationError, DataError
from ..envs.progress import drives_progress
from ..envs.storage import check_folder
from .arguments import (
    CarName,
    Fresh,
    ManeuverNames,
    OutFolder,
    PlatformName,
    PolicyName,
    Whole,
    find_car,
    find_maneuvers,
    find_platform,
)

if TYPE_CHECKING:
    from ..envs.cues import CueTrace
    from ..evaluation.demonstrations import Demonstrator
    from ..evaluation.suite import CueSource
    from ..train.algorithms.dagger.demonstrations import DriveEntry, Index


@dataclass(frozen=True, kw_only=True)
class DemonstrateCommand:
    """Record drives of a controller as a dataset for learning.

    Writes one .npz file a drive and index.json. Name drives with --maneuvers, ask for random ones with
    --drives, or both. docs/guides/record-demonstrations.md describes the files.
    """

    policy: PolicyName = "optimum"
    objective: Literal["J", "perceived"] = "J"
    """What the optimum minimizes: J, or J of the perceived cues."""
    maneuvers: ManeuverNames = ()
    drives: Whole = 0
    """Random drives."""
    seed: Whole = 0
    """Of the random drives."""
    duration: float = 60.0
    """Of a random drive, s."""
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    out: OutFolder = Path("demonstrations")
    fresh: Fresh = False


def run(command: DemonstrateCommand) -> int:
    """Record the missing drives."""
    from ..evaluation.demonstrations import Demonstrator

    check_folder("--out", command.out)
    platform = find_platform(command.platform)
    demonstrator = Demonstrator.of(_policy_name(command), platform)
    sources = _sources(command)
    index = _index(command, _setting(command, demonstrator))
    index.save(command.out)
    recorded = 0
    with drives_progress(len(sources)) as advance:
        for name, source in sources.items():
            advance(name, demonstrator.name)
            cues = _cues(name, source).resampled(demonstrator.time_step)
            if _is_done(command.out, index, name, cues):
                continue
            index = index.with_drive(_record(command.out, name, cues, demonstrator))
            index.save(command.out)
            recorded += 1
    print(_summary(command.out, index, recorded))
    return 0


def _is_done(folder: Path, index: Index, name: str, cues: CueTrace) -> bool:
    """Whether the drive of a name is there, and is of these cues; says so if it is of others."""
    from ..train.algorithms.dagger.demonstrations import is_kept

    recorded = next((entry for entry in index.drives if entry.name == name), None)
    if recorded is None or not is_kept(folder, recorded):
        return False
    if recorded.cues != cues.digest():
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
    if command.drives < 0:
        raise ConfigurationError(f"--drives must not be negative, found {command.drives}")
    if not command.maneuvers and not command.drives:
        raise ConfigurationError(
            "nothing to drive: name drives with --maneuvers, or ask for random ones with --drives"
        )
    sources = dict(find_maneuvers(command.maneuvers, find_car(command.car)))
    if command.drives:
        sources |= dict(_random_sources(command))
    return sources


def _random_sources(command: DemonstrateCommand) -> Iterator[tuple[str, CueSource]]:
    from ..envs.maneuvers.sampling import RandomDrives, drive_seeds, random_drive

    for seed in drive_seeds(command.drives, command.seed):
        name = RandomDrives().plan(seed, command.duration).name
        yield f"{name}-{command.duration:g}s", partial(random_drive, seed, command.duration)


def _cues(name: str, source: CueSource) -> CueTrace:
    try:
        return source()
    except ValueError as error:
        raise DataError(f"drive {name}: {error}") from None


def _setting(command: DemonstrateCommand, demonstrator: Demonstrator) -> dict[str, Any]:
    from ..envs.settings import to_dict

    return {
        "policy": demonstrator.name,
        "parameters": demonstrator.parameters,
        "car": to_dict(find_car(command.car)),
        "platform": to_dict(demonstrator.platform),
        "vestibular": demonstrator.vestibular.name,
        "time_step": demonstrator.time_step,
    }


def _index(command: DemonstrateCommand, setting: dict[str, Any]) -> Index:
    """The folder's index, or a new one; with ``--fresh`` the drives of the old one are removed."""
    from ..envs.provenance import command_line, commit, hardware, now, versions
    from ..train.algorithms.dagger.demonstrations import INDEX, Index, load_index

    if (command.out / INDEX).exists():
        index = load_index(command.out)
        if command.fresh:
            for drive in index.drives:
                (command.out / drive.file).unlink(missing_ok=True)
            (command.out / INDEX).unlink()
            return _index(command, setting)
        if index.setting != json.loads(json.dumps(setting)):
            raise ConfigurationError(
                f"{command.out} holds drives of another controller, car or motion base; name another "
                "--out, or add --fresh to begin anew"
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
    from ..evaluation.demonstrations import demonstrate
    from ..evaluation.metrics import measure
    from ..evaluation.rollout import statistics_of
    from ..train.algorithms.dagger.demonstrations import DriveEntry, save_drive

    record, drive = demonstrate(demonstrator, name, cues)
    metrics = measure(record)
    file = f"{name}.npz"
    return DriveEntry(
        name=name,
        file=file,
        sha256=save_drive(folder, file, drive),
        source=cues.source,
        cues=cues.digest(),
        steps=len(drive),
        cue_error=metrics.cue_error,
        perceived_cue_error=metrics.perceived_cue_error,
        at_limit=metrics.at_limit,
        notes=statistics_of(record.metadata),
    )


def _summary(folder: Path, index: Index, recorded: int) -> str:
    from ..evaluation.reporting.text import number

    steps = sum(entry.steps for entry in index.drives)
    mean = sum(entry.cue_error for entry in index.drives) / max(len(index.drives), 1)
    return f"{folder}: {len(index.drives)} drives ({recorded} new), {steps} steps, mean J {number(mean)}"
