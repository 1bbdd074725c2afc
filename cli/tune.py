"""What a person sees of a search: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Final, Literal

import yaml
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from tyro.conf import FlagCreatePairsOff, Positional, arg

from ..baselines.tuning.search import Status
from ..baselines.washout.families import FAMILIES, AnyWashout, algorithm_of, load_of
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, DataError
from ..envs.provenance import command_line, commit, hardware, now, versions
from ..envs.settings import to_dict
from ..envs.storage import check_file, write_text
from ..evaluation.selection import find_car, find_maneuvers, find_platform
from ..train.training import Interrupt

if TYPE_CHECKING:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import Record, Search, TuningOptions
    from ..envs.car import Car

_LINES: Final = 20
"""Lines in all where the output is no terminal."""


class TuningProgress:
    """A bar with hours simulated, the best so far and the time left.

    Args:
        budget: Hours to simulate.
        console: Where to write; default: the error stream.
    """

    def __init__(self, budget: float, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._budget, self._told = budget, -1
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f} h"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
            transient=True,
        )
        self._task = self._bar.add_task("tuning", total=budget)

    def __enter__(self) -> TuningProgress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it."""
        self._bar.stop()

    def tell(self, status: Status) -> None:
        """Move the bar; without a terminal, write a line when another part of the budget is spent."""
        best = "tuning" if status.best is None else f"best {status.best:.4f}"
        self._bar.update(self._task, completed=min(status.hours, self._budget), description=best)
        part = int(_LINES * status.hours / self._budget)
        if not self._console.is_terminal and status.best is not None and part > self._told:
            self._told = part
            line = f"{status.hours:8.0f} h  {best}  ({status.steps} steps)"
            self._console.print(line, highlight=False, soft_wrap=True)


# ``motion-cueing tune``: search for an algorithm's best parameters.


_SUCCESS: Final = 0
_INTERRUPTED: Final = 130
_MADE_BY: Final = "Made by: "
"""What a file of this command begins with."""
_TRACK: Final = "random track drive"
"""Source of a random drive on a handling track."""


@dataclass(frozen=True)
class TuneCommand:
    """Search for the parameters with which an algorithm is at its best on random drives or named maneuvers.

    Writes a policy for `motion-cueing evaluate
    --policy FILE`. Ctrl-C stops after the generation at hand; --resume goes on.
    """

    algorithm: Positional[Annotated[str, arg(metavar="|".join(FAMILIES))]]
    """What to tune."""
    objective: Literal["J", "perceived"] = "J"
    """What to minimize: J, or J of what the driver senses."""
    method: Literal["cma", "gradient"] = "cma"
    """Search with CMA-ES, or, classical only, along the gradient of J through the machine's equations."""
    maneuvers: Annotated[tuple[str, ...], arg(metavar="train|NAME|FILE ...")] = ("train",)
    """Random drives, or maneuvers and recordings by name or cue CSV file."""
    limits: Literal["roads", "all"] = "roads"
    """Where no limit of the machine may be met: on roads, or also in random drives on a track."""
    drives: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 256)")] = None
    """Random drives, each of a minute."""
    budget: Annotated[float | None, arg(metavar="HOURS", help_behavior_hint="(default: 1000)")] = None
    """Hours to simulate; generations up to the next trial on all drives, five at most, follow."""
    seed: Annotated[int | None, arg(metavar="S", help_behavior_hint="(default: 0)")] = None
    """Of everything that the search draws."""
    start: Annotated[
        str | None, arg(metavar="NAME|FILE", help_behavior_hint="(default: the set that is set by hand)")
    ] = None
    """Set to begin with, by name or YAML file; orders of filters and blocks that are off stay as in it."""
    platform: Annotated[str, arg(metavar="NAME|FILE")] = "paper"
    """Motion base, by name or YAML file."""
    car: Annotated[str, arg(metavar="NAME|FILE")] = "sedan"
    """Car that drives named maneuvers, by name or YAML file."""
    threads: int = 1
    """Cores to use."""
    out: Annotated[
        Path | None, arg(metavar="FILE.yaml", help_behavior_hint="(default: my-classical.yaml and so on)")
    ] = None
    """Policy to write; its name is that of the file. The search is kept beside it, as FILE.search.json."""
    resume: Annotated[bool, FlagCreatePairsOff] = False
    """Go on with the search kept beside --out; --budget may extend it."""


def run(command: TuneCommand) -> int:
    """Search, and write what was found.

    Raises:
        MotionCueingError: an argument or a file is wrong, or there is no search to go on with.
    """
    FAMILIES[command.algorithm]  # refuses unknown ones
    command = replace(command, out=_out(command))
    _check(command)
    record = _record(command)
    search = _search(command, record)
    interrupt = Interrupt()
    with interrupt.caught(), TuningProgress(search.options.budget) as progress:
        stopped = search.run(progress.tell, lambda: interrupt.asked)
    _write(command, search)
    status = search.status
    if stopped:
        on = f"motion-cueing tune {command.algorithm} --out {_out(command)} --resume"
        print(f"stopped after {status.hours:.3g} h; go on with: {on}", file=sys.stderr)
        return _INTERRUPTED
    if status.hours < search.options.budget:
        print(f"nothing better to be found after {status.hours:.3g} h", file=sys.stderr)
    return _SUCCESS


def _out(command: TuneCommand) -> Path:
    return command.out or Path(f"my-{FAMILIES[command.algorithm].start}.yaml")


def _check(command: TuneCommand) -> None:
    if _out(command).suffix not in (".yaml", ".yml"):
        raise ConfigurationError(f"--out {command.out}: a policy's file ends in .yaml")
    if command.threads < 1:
        raise ConfigurationError(f"--threads must be at least 1, found {command.threads}")
    if command.drives is not None and "train" not in command.maneuvers:
        raise ConfigurationError("--drives counts random drives; leave it out, or add `train` to --maneuvers")
    _check_out(_out(command))
    kept = _kept(command)
    if not command.resume and kept.exists():
        raise ConfigurationError(f"{kept} holds a search; go on with --resume, or name another --out")
    if command.resume:
        _check_resumed(command)


def _check_out(out: Path) -> None:
    """Refuse what cannot be written, and a file that no search has made: a set by hand is not replaced."""
    check_file("--out", out)
    if out.exists() and not out.read_bytes().startswith(f"# {_MADE_BY}".encode()):
        raise DataError(f"{out} was not written by this command; move it away, or name another --out")


def _check_resumed(command: TuneCommand) -> None:
    """A search that is taken up keeps its options."""
    fresh = TuneCommand(command.algorithm)
    for name in ("objective", "method", "limits", "maneuvers", "drives", "seed", "start", "platform", "car"):
        if getattr(command, name) != getattr(fresh, name):
            raise ConfigurationError(f"--{name} was chosen when the search was begun; leave it out")


def _check_algorithm(command: TuneCommand, record: Record) -> None:
    begun = algorithm_of(record.options.start)
    if begun != command.algorithm:
        raise ConfigurationError(
            f"{_kept(command)} is a search of {begun}; go on with: motion-cueing tune {begun}"
        )


def _kept(command: TuneCommand) -> Path:
    return _out(command).with_suffix(".search.json")


def _record(command: TuneCommand) -> Record:
    """The record of an earlier session, or an empty one of a new search."""
    from ..baselines.tuning.search import Record, load_record

    if command.resume:
        record = load_record(_kept(command))
        _check_algorithm(command, record)
        budget = command.budget or record.options.budget
        return replace(record, options=replace(record.options, budget=budget))
    return Record(_options(command), command.platform, command.car, "", command=command_line())


def _options(command: TuneCommand) -> TuningOptions:
    from ..baselines.tuning.search import TuningOptions

    given = {name: getattr(command, name) for name in ("drives", "budget", "seed")}
    return TuningOptions(
        start=load_of(command.algorithm, command.start or FAMILIES[command.algorithm].start),
        objective=command.objective,
        method=command.method,
        limits=command.limits,
        maneuvers=command.maneuvers,
        **{name: value for name, value in given.items() if value is not None},
    )


def _search(command: TuneCommand, record: Record) -> Search:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import Search

    options = record.options
    car, platform = find_car(record.car), find_platform(record.platform)
    drives = _drives(options, car)
    spared = _spared(options, drives)
    objective = Objective(drives, platform, options.objective, command.threads, spared)
    names = record.platform, record.car
    search = Search(options, objective, names, _kept(command), record.command)
    if command.resume:
        search.resume(record)
    return search


def _spared(options: TuningOptions, drives: list[CueTrace]) -> list[int]:
    """The random drives in which limits may be met."""
    on_track = [i for i, drive in enumerate(drives) if drive.source == _TRACK]
    return on_track if options.limits == "roads" else []


def _drives(options: TuningOptions, car: Car) -> list[CueTrace]:
    from ..baselines.tuning.search import TRAIN
    from ..envs.maneuvers import random_drives

    named = find_maneuvers([name for name in options.maneuvers if name != TRAIN], car)
    drives: list[CueTrace] = []
    if TRAIN in options.maneuvers:
        drives += random_drives(options.drives, options.duration, options.drives_seed, drives=options.roads)
    for label, source in named.items():
        try:
            drives.append(source())
        except ValueError as error:
            raise DataError(f"maneuver {label}: {error}") from None
    return drives


def _write(command: TuneCommand, search: Search) -> None:
    """The policy, with what is known about it on top."""
    options = search.options
    how = "CMA-ES" if options.method == "cma" else "gradient descent"
    goal = "J" if options.objective == "J" else "perceived J"
    name, drives = _out(command).stem, len(search.objective.drives)
    many = f"{drives} random drives" if options.maneuvers == ("train",) else ", ".join(options.maneuvers)
    spent = f"{search.status.hours:.3g} h"
    told = f"{options.start.name} tuned with {spent} by {how} for {goal} on {many}"
    tuned = search.result(name, told)
    notes = [
        f"{_MADE_BY}{search.command}" + (", stopped and resumed" if command.resume else ""),
        f"{now()}, commit {commit() or 'unknown'}, {hardware('cpu')}",
        ", ".join(f"{package} {version}" for package, version in versions().items()),
        f"{spent} simulated in {search.status.steps} steps (budget {options.budget:g} h, and what was begun "
        f"until the next trial on all drives), seed {options.seed}",
        *_scores(f"on the {many} of the search", search.objective, options.start, tuned),
    ]
    if "train" in options.maneuvers:
        held_out = _held_out(search)
        notes += _scores(f"on {len(held_out.drives)} random drives held out", held_out, options.start, tuned)
    at_bounds = list(search.space.at_bounds(tuned))
    notes.append(f"at a bound of the search: {', '.join(at_bounds) or 'nothing'}")
    text = yaml.safe_dump(to_dict(tuned), sort_keys=False)
    write_text(_out(command), "".join(f"# {note}\n" for note in notes) + text)
    print("\n".join([str(_out(command)), *(f"  {note}" for note in notes[3:])]))


def _held_out(search: Search) -> Objective:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import HELD_OUT, HELD_OUT_SEED
    from ..envs.maneuvers import random_drives

    given, options = search.objective, search.options
    drives = random_drives(HELD_OUT, options.duration, HELD_OUT_SEED, drives=options.roads)
    return Objective(drives, given.platform, given.measure, given.threads, _spared(options, drives))


def _scores(where: str, objective: Objective, start: AnyWashout, tuned: AnyWashout) -> list[str]:
    found = objective.evaluate([start, tuned])
    return [
        f"{where}: {name} J {found.cue_error[i]:.3f}, perceived {found.perceived_error[i]:.3f}, "
        f"{100.0 * found.at_limit[i]:.3f} % of the time at a limit, "
        f"{100.0 * found.violation[i]:.3f} % where none may be met"
        for i, name in enumerate((start.name, tuned.name))
    ]
