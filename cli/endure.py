"""``motion-cueing endure``: hours of random drives, other cars and slower actuators."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from tyro.conf import FlagCreatePairsOff, arg

from ..envs.errors import ConfigurationError
from ..envs.storage import check_folder, check_own_json
from ..evaluation.reporting.text import how_many, print_table, save_markdown, table_console, words_of
from ..evaluation.selection import find_platform, find_policies

if TYPE_CHECKING:
    from ..evaluation.endurance import Endurance
    from ..evaluation.endurance.results import EnduranceResults
    from ..evaluation.endurance.run import EnduranceOutcome, EnduranceRequest
    from ..evaluation.endurance.run import Progress as Tell

_WITHSTOOD: Final = 0
_FAILED: Final = 1
_INTERRUPTED: Final = 130

Name = Annotated[str, arg(metavar="NAME|FILE")]


@dataclass(frozen=True)
class EndureCommand:
    """Drive policies for hours and count what they exceed.

    Drives are random, of every kind of road, by every car, with tires of different grip. Each is driven
    twice: on the motion base as it should be, and on one whose actuators have a lag and a dead time. Limits
    are checked on the true motion, not by the limiter. Drives that are done are kept in the output folder.
    The exit status is 1 if a limit was exceeded or an action was not finite.
    """

    policy: Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")] = ("learned-preview",)
    """Policies, by name or file."""
    hours: float = 1.0
    """Of drives."""
    seed: int = 0
    """Of the drives."""
    only: Annotated[tuple[int, ...], arg(metavar="SEED ...")] = ()
    """Drive these, by the number in their names, and write their cues as CSV; default: as many as fill the
    hours."""
    duration: float = 120.0
    """Of a drive, s."""
    platform: Name = "paper"
    """Motion base, by name or YAML file."""
    friction: tuple[float, float] = (0.7, 1.0)
    """Range of a factor on the tires' friction."""
    lag: tuple[float, float] = (30.0, 90.0)
    """Range of the natural frequency of the actuators' lag, rad/s."""
    dead_time: tuple[float, float] = (0.0, 0.05)
    """Range of the actuators' dead time, s."""
    envs: int = 256
    """Drives side by side."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("endurance")
    """Folder for everything that is written; made if missing."""
    fresh: Annotated[bool, FlagCreatePairsOff] = False
    """Drive again what these policies have driven."""


def run(command: EndureCommand) -> int:
    """Drive what is not done yet, print and write what came of it all.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.endurance.run import EnduranceRun

    asked = _asked(command)
    driving = EnduranceRun(asked, command.fresh)
    with _progress(driving.seconds) as tell:
        found = driving.drive(tell)
    results = _results(command, asked, found)
    _write(command, asked, results)
    _print(command, results, found)
    if not found.finished:
        return _INTERRUPTED
    return _WITHSTOOD if all(one.withstood for one in results.summaries.values()) else _FAILED


def _asked(command: EndureCommand) -> EnduranceRequest:
    from ..envs.maneuvers import drive_seeds
    from ..evaluation.endurance.run import EnduranceRequest

    for name, value in (("hours", command.hours), ("duration", command.duration), ("envs", command.envs)):
        if not 0 < value < math.inf:
            raise ConfigurationError(f"--{name} must be positive and finite, found {value:g}")
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "endurance.json", frozenset({"schema", "endurance"}))
    platform = find_platform(command.platform)
    count = math.ceil(3600.0 * command.hours / command.duration)
    return EnduranceRequest(
        endurance=_endurance(command),
        platform=platform,
        policies=find_policies(command.policy, platform),
        seeds=command.only or drive_seeds(count, command.seed),
        batch=command.envs,
        folder=command.out,
    )


def _endurance(command: EndureCommand) -> Endurance:
    from ..evaluation.endurance import Endurance

    return Endurance(
        duration=command.duration,
        friction=command.friction,
        natural_frequency=command.lag,
        dead_time=command.dead_time,
    )


@contextmanager
def _progress(seconds: float) -> Iterator[Tell]:
    """A bar on the error stream; Ctrl-C stops the drive when the bar next moves."""
    from ..evaluation.endurance.run import Stopped
    from ..train.training import Interrupt

    interrupt = Interrupt()
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    with interrupt.caught(), Progress(*columns, *times, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=seconds)

        def tell(what: str, done: float) -> None:
            bar.update(task, description=what, advance=done)
            if interrupt.asked:
                raise Stopped

        yield tell


def _results(command: EndureCommand, asked: EnduranceRequest, found: EnduranceOutcome) -> EnduranceResults:
    from ..envs.simulator.simulator import TIME_STEP
    from ..evaluation.endurance.results import EnduranceResults, summarized

    driven = {name: one for name, one in found.policies.items() if one.drives}
    return EnduranceResults(
        **EnduranceResults.head(words_of("endure", command)),
        platform=asked.platform.name,
        endurance=asked.endurance,
        finished=found.finished,
        summaries={name: summarized(one.drives, TIME_STEP) for name, one in driven.items()},
        policies=driven,
    )


def _write(command: EndureCommand, asked: EnduranceRequest, results: EnduranceResults) -> None:
    from ..evaluation.endurance.results import tables
    from ..evaluation.endurance.run import seeded_drives

    results.save_json(command.out / "endurance.json")
    results.save_csv(command.out / "endurance.csv")
    save_markdown(command.out / "endurance.md", *tables(results))
    for drive in seeded_drives(asked.endurance, command.only):
        drive.cues.to_csv(command.out / f"{drive.cues.name}.csv")


def _print(command: EndureCommand, results: EnduranceResults, found: EnduranceOutcome) -> None:
    from ..evaluation.endurance.results import tables

    console = table_console()
    for table in tables(results):
        print_table(console, table)
    if found.skipped:
        told = how_many(len(found.skipped), "drive")
        console.print(f"{told} left out: the car left the range of its model", highlight=False)
    state = "" if found.finished else "interrupted, the same command goes on; "
    console.print(
        f"{state}{how_many(found.driven, 'drive')} driven now; everything is in {command.out}",
        highlight=False,
        markup=False,
    )
