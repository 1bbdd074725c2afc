"""``motion-cueing tune``: search for a washout's best parameters."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from ..envs.errors import ConfigurationError, DataError
from ..envs.progress import Bars
from ..envs.storage import check_file, write_text
from .arguments import (
    CarName,
    Fresh,
    Names,
    PlatformName,
    ScaleText,
    Whole,
    Workers,
    find_car,
    find_maneuvers,
    find_platform,
    option,
)

if TYPE_CHECKING:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import Record, Search, Status, TuningOptions
    from ..baselines.washout.families import AnyWashout
    from ..envs.car import Car
    from ..envs.cues import CueTrace

_LINES: Final = 20
"""Lines in all where the output is no terminal."""
_SUCCESS: Final = 0
_INTERRUPTED: Final = 130
_MADE_BY: Final = "Made by: "
"""What a file of this command begins with."""
_SPARED: Final = tuple(f"random {kind} drive" for kind in ("track", "circuit", "limit"))
"""Sources of random drives in which limits may be met."""
_HELD: Final = ("objective", "method", "limits", "maneuvers", "drives", "seed")
"""Options that a search keeps to its end."""
_ELSE: Final = "leave it out, name another --out, or add --fresh to begin anew"


@dataclass(frozen=True, kw_only=True)
class TuneCommand:
    """Search for the parameters with which a washout is at its best on random drives or named maneuvers.

    Writes a policy for `motion-cueing evaluate --policies FILE`. Ctrl-C stops after the generation at hand;
    the same command goes on from the search kept beside --out, and another --hours makes it longer.
    """

    algorithm: Annotated[str, option("classical|adaptive|optimal")]
    """What to tune."""
    objective: Literal["J", "perceived"] = "J"
    """What to minimize: J, or J of the perceived cues."""
    method: Literal["cma", "gradient"] = "cma"
    """Search with CMA-ES, or, classical only, along the gradient of J through the machine's equations."""
    maneuvers: Names = ("train",)
    """Maneuvers and recordings, by name or cue CSV file; `train` for random drives."""
    limits: Literal["none", "roads", "all"] = "roads"
    """Where no limit of the machine may be met: none (J alone counts), roads, or also on tracks,
    circuits and sliding tires."""
    drives: Whole | None = None
    """Random drives, each of a minute; default: 256."""
    hours: float | None = None
    """Hours to simulate; generations up to the next trial on all drives, five at most, follow; default:
    1000."""
    seed: Whole | None = None
    """Of everything that the search draws; default: 0."""
    start: Annotated[str | None, option("NAME|FILE")] = None
    """Set to begin with, by name or YAML file; orders of filters and blocks that are off stay as in it;
    default: the set that is set by hand."""
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    scale: ScaleText = "1"
    workers: Workers = 1
    out: Annotated[Path | None, option("FILE.yaml")] = None
    """Policy to write; its name is that of the file. The search is kept beside it, as FILE.search.json;
    default: my-classical.yaml and so on."""
    fresh: Fresh = False


def run(command: TuneCommand) -> int:
    """Search, and write the best parameters."""
    from ..baselines.washout.families import FAMILIES
    from ..envs.progress import Interrupt

    FAMILIES[command.algorithm]  # refuses an unknown one
    command = replace(command, out=_out(command))
    _check(command)
    goes_on = _kept(command).exists() and not command.fresh
    record = _begun(command) if goes_on else _new(command)
    search = _search(record, command, goes_on)
    interrupt = Interrupt()
    with interrupt.caught(), Bars() as bars:
        show = SearchProgress(bars, search.options.budget)
        stopped = search.run(show, lambda: interrupt.asked)
    _write(command, search, goes_on)
    status = search.status
    if stopped:
        on = f"motion-cueing tune --algorithm {command.algorithm} --out {_out(command)}"
        print(f"stopped after {status.hours:.3g} h; go on with: {on}", file=sys.stderr)
        return _INTERRUPTED
    if status.hours < search.options.budget:
        print(f"nothing better to be found after {status.hours:.3g} h", file=sys.stderr)
    return _SUCCESS


class SearchProgress:
    """Shows a search: a bar of the hours simulated, and lines where there is no terminal.

    Args:
        bars: Where.
        budget: Hours in all.
    """

    def __init__(self, bars: Bars, budget: float) -> None:
        self._bars, self._budget, self._shown = bars, budget, -1
        self._bar = bars.add("tuning", budget, "h")

    def __call__(self, status: Status) -> None:
        """Move the bar; without a terminal, write a line when another part of the budget is spent."""
        best = "tuning" if status.best is None else f"best {status.best:.4f}"
        self._bar.move(min(status.hours, self._budget), best)
        part = int(_LINES * status.hours / self._budget)
        if not self._bars.console.is_terminal and status.best is not None and part > self._shown:
            self._shown = part
            self._bars.line(f"{status.hours:8.0f} h  {best}  ({status.steps} steps)")


def _out(command: TuneCommand) -> Path:
    from ..baselines.washout.families import FAMILIES

    return command.out or Path(f"my-{FAMILIES[command.algorithm].start}.yaml")


def _check(command: TuneCommand) -> None:
    if _out(command).suffix not in (".yaml", ".yml"):
        raise ConfigurationError(f"--out {command.out}: a policy's file ends in .yaml")
    if command.workers < 1:
        raise ConfigurationError(f"--workers must be at least 1, found {command.workers}")
    if command.hours is not None and not command.hours > 0.0:
        raise ConfigurationError(f"--hours must be positive, found {command.hours:g}")
    if command.drives is not None and "train" not in command.maneuvers:
        raise ConfigurationError("--drives counts random drives; leave it out, or add `train` to --maneuvers")
    _check_out(_out(command))


def _check_out(out: Path) -> None:
    """Refuse what cannot be written, and a file that no search has made: a set by hand is not replaced."""
    check_file("--out", out)
    if out.exists() and not out.read_bytes().startswith(f"# {_MADE_BY}".encode()):
        raise DataError(f"{out} was not written by this command; move it away, or name another --out")


def _kept(command: TuneCommand) -> Path:
    return _out(command).with_suffix(".search.json")


def _new(command: TuneCommand) -> Record:
    """The empty record of a new search."""
    from ..baselines.tuning.search import Record
    from ..envs.provenance import command_line

    return Record(_options(command), command.platform, command.car, "", command=command_line())


def _begun(command: TuneCommand) -> Record:
    """The record of an earlier session, with the requested hours."""
    from ..baselines.tuning.search import load_record
    from ..baselines.washout.families import algorithm_of, load_of

    record, default = load_record(_kept(command)), TuneCommand(algorithm=command.algorithm)
    held: dict[str, Any] = {
        "algorithm": algorithm_of(record.options.start),
        "platform": record.platform,
        "car": record.car,
        "scale": str(record.options.scale),
        **{name: getattr(record.options, name) for name in _HELD},
    }
    for name, was in held.items():
        given = getattr(command, name)
        if given != was and (name == "algorithm" or given != getattr(default, name)):
            raise ConfigurationError(f"--{name} {given}: {_kept(command)} was begun with {was}; {_ELSE}")
    if command.start is not None and load_of(command.algorithm, command.start) != record.options.start:
        raise ConfigurationError(f"--start {command.start}: {_kept(command)} was begun with another; {_ELSE}")
    budget = command.hours or record.options.budget
    return replace(record, options=replace(record.options, budget=budget))


def _options(command: TuneCommand) -> TuningOptions:
    from ..baselines.tuning.search import TuningOptions
    from ..baselines.washout.families import FAMILIES, load_of
    from ..envs.cues import CueScale

    given: dict[str, Any] = {"drives": command.drives, "budget": command.hours, "seed": command.seed}
    return TuningOptions(
        start=load_of(command.algorithm, command.start or FAMILIES[command.algorithm].start),
        objective=command.objective,
        method=command.method,
        limits=command.limits,
        maneuvers=command.maneuvers,
        scale=CueScale.parse(command.scale),
        **{name: value for name, value in given.items() if value is not None},
    )


def _search(record: Record, command: TuneCommand, goes_on: bool) -> Search:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import Search

    options = record.options
    car, platform = find_car(record.car), find_platform(record.platform)
    drives = _drives(options, car)
    spared = _spared(options, drives)
    objective = Objective(drives, platform, options.objective, command.workers, spared)
    names = record.platform, record.car
    search = Search(options, objective, names, _kept(command), record.command)
    if goes_on:
        search.resume(record)
    return search


def _spared(options: TuningOptions, drives: list[CueTrace]) -> list[int]:
    """The drives in which limits may be met."""
    if options.limits == "none":
        return list(range(len(drives)))
    spared = [i for i, drive in enumerate(drives) if drive.source in _SPARED]
    return spared if options.limits == "roads" else []


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
    return [drive.scaled(options.scale) for drive in drives]


def _write(command: TuneCommand, search: Search, goes_on: bool) -> None:
    """The policy, with its origin and scores on top."""
    import yaml

    from ..envs.provenance import commit, hardware, now, versions
    from ..envs.settings import to_dict

    options = search.options
    how = "CMA-ES" if options.method == "cma" else "gradient descent"
    goal = "J" if options.objective == "J" else "perceived J"
    name, drives = _out(command).stem, len(search.objective.drives)
    many = f"{drives} random drives" if options.maneuvers == ("train",) else ", ".join(options.maneuvers)
    spent = f"{search.status.hours:.3g} h"
    about = f"{options.start.name} tuned with {spent} by {how} for {goal} on {many}"
    if not options.scale.neutral:
        about += f", motion scale {options.scale}"
    tuned = search.result(name, about)
    notes = [
        f"{_MADE_BY}{search.command}" + (", stopped and resumed" if goes_on else ""),
        f"{now()}, commit {commit() or 'unknown'}, {hardware('cpu')}",
        ", ".join(f"{package} {version}" for package, version in versions().items()),
        f"{spent} simulated in {search.status.steps} steps (budget {options.budget:g} h, and what was begun "
        f"until the next trial on all drives), seed {options.seed}",
        *_scores(f"on the {many} of the search", search.objective, options.start, tuned)[0],
    ]
    warning = []
    if "train" in options.maneuvers:
        held_out = _held_out(search)
        where = f"on {len(held_out.drives)} random drives held out"
        lines, (before, after) = _scores(where, held_out, options.start, tuned)
        notes += lines
        if after > before:
            warning.append(
                f"WARNING: {where}, {name} is WORSE than {options.start.name}, where the search began: cost "
                f"{after:.3f} instead of {before:.3f} ({goal}, and more for limits met). "
                f"Simulate more --hours on more --drives, or keep {options.start.name}."
            )
    at_bounds = list(search.space.at_bounds(tuned))
    notes.append(f"at a bound of the search: {', '.join(at_bounds) or 'nothing'}")
    notes += warning
    text = yaml.safe_dump(to_dict(tuned), sort_keys=False)
    write_text(_out(command), "".join(f"# {note}\n" for note in notes) + text)
    print("\n".join([str(_out(command)), *(f"  {note}" for note in notes[3:])]))


def _held_out(search: Search) -> Objective:
    from ..baselines.tuning.objective import Objective
    from ..baselines.tuning.search import HELD_OUT, HELD_OUT_SEED
    from ..envs.maneuvers import random_drives

    given, options = search.objective, search.options
    drives = random_drives(HELD_OUT, options.duration, HELD_OUT_SEED, drives=options.roads)
    drives = [drive.scaled(options.scale) for drive in drives]
    return Objective(drives, given.platform, given.measure, given.threads, _spared(options, drives))


def _scores(
    where: str, objective: Objective, start: AnyWashout, tuned: AnyWashout
) -> tuple[list[str], list[float]]:
    """A line about either set, and their costs, which the search minimizes."""
    scores = objective.evaluate([start, tuned])
    lines = [
        f"{where}: {name} J {scores.cue_error[i]:.3f}, perceived {scores.perceived_error[i]:.3f}, "
        f"{100.0 * scores.at_limit[i]:.3f} % of the time at a limit, "
        f"{100.0 * scores.violation[i]:.3f} % where none may be met"
        for i, name in enumerate((start.name, tuned.name))
    ]
    return lines, [float(cost) for cost in scores.cost]
