"""``motion-cueing endure``: hours of random drives, other cars and slower actuators."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from ..envs.errors import ConfigurationError
from ..envs.progress import progress
from ..envs.storage import check_folder, check_own_json
from .arguments import (
    Compensate,
    Fresh,
    OutFolder,
    PlatformName,
    PolicyNames,
    Whole,
    find_platform,
    find_policies,
    known_lateness,
    option,
    several,
)

if TYPE_CHECKING:
    from ..evaluation.endurance import Endurance
    from ..evaluation.endurance.results import EnduranceResults
    from ..evaluation.endurance.run import EnduranceOutcome, EnduranceRequest, Progress

_WITHSTOOD: Final = 0
_FAILED: Final = 1
_INTERRUPTED: Final = 130


@dataclass(frozen=True, kw_only=True)
class EndureCommand:
    """Drive policies for hours and count what they exceed.

    Drives are random, of every kind of road, by every car, with tires of different grip. Each is driven
    twice: on the motion base as it should be, and on one whose actuators have a lag and a dead time. Limits
    are checked on the true motion, not by the limiter. Drives that are done are kept in the output folder.
    The exit status is 1 if a limit was exceeded or an action was not finite.
    """

    policies: PolicyNames = ("learned-preview",)
    hours: float = 1.0
    """Of drives."""
    seed: Whole = 0
    """Of the drives."""
    seeds: Annotated[tuple[int, ...], several("SEED ...")] = ()
    """Drive these, by the number in their names, and write their cues as CSV; default: as many as fill the
    hours."""
    duration: float = 120.0
    """Of a drive, s."""
    platform: PlatformName = "paper"
    friction: Annotated[tuple[float, float], option("LOW HIGH")] = (0.7, 1.0)
    """Range of a factor on the tires' friction."""
    lag: Annotated[tuple[float, float], option("LOW HIGH")] = (30.0, 90.0)
    """Range of the natural frequency of the actuators' lag, rad/s."""
    dead_time: Annotated[tuple[float, float], option("LOW HIGH")] = (0.0, 0.05)
    """Range of the actuators' dead time, s."""
    compensate: Compensate = False
    lateness_error: float = 0.3
    """With --compensate, policies are also given a lateness that is wrong by this share; 0 for the true one
    alone."""
    envs: Whole = 256
    """Drives side by side."""
    out: OutFolder = Path("endurance")
    fresh: Fresh = False


def run(command: EndureCommand) -> int:
    """Drive the missing drives, print and write the results."""
    from ..evaluation.endurance.run import EnduranceRun

    request = _request(command)
    driving = EnduranceRun(request, command.fresh)
    with _progress(driving.seconds) as tell:
        outcome = driving.drive(tell)
    results = _results(command, request, outcome)
    _write(command, request, results)
    _print(command, results, outcome)
    if not outcome.finished:
        return _INTERRUPTED
    return _WITHSTOOD if all(one.withstood for one in results.summaries.values()) else _FAILED


def _request(command: EndureCommand) -> EnduranceRequest:
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
        policies=find_policies(command.policies, platform),
        seeds=command.seeds or drive_seeds(count, command.seed),
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
        known=known_lateness(command.compensate, command.lateness_error),
    )


@contextmanager
def _progress(seconds: float) -> Iterator[Progress]:
    """A bar on the error stream; Ctrl-C stops the drive when the bar next moves."""
    from ..envs.progress import Interrupt
    from ..evaluation.endurance.run import Stopped

    interrupt = Interrupt()
    with interrupt.caught(), progress(seconds, "s of drives") as bar:

        def tell(what: str, done: float) -> None:
            bar.move(text=what, advance=done)
            if interrupt.asked:
                raise Stopped

        yield tell


def _results(
    command: EndureCommand, request: EnduranceRequest, outcome: EnduranceOutcome
) -> EnduranceResults:
    from ..envs.simulator.simulator import TIME_STEP
    from ..evaluation.endurance.results import EnduranceResults, summarized
    from ..evaluation.reporting.text import words_of

    driven = {name: one for name, one in outcome.policies.items() if one.drives}
    return EnduranceResults(
        **EnduranceResults.head(words_of("endure", command)),
        platform=request.platform.name,
        endurance=request.endurance,
        finished=outcome.finished,
        summaries={name: summarized(one.drives, TIME_STEP) for name, one in driven.items()},
        policies=driven,
    )


def _write(command: EndureCommand, request: EnduranceRequest, results: EnduranceResults) -> None:
    from ..evaluation.endurance.results import tables
    from ..evaluation.endurance.run import seeded_drives
    from ..evaluation.reporting.text import save_markdown

    results.save_json(command.out / "endurance.json")
    results.save_csv(command.out / "endurance.csv")
    save_markdown(command.out / "endurance.md", *tables(results))
    for drive in seeded_drives(request.endurance, command.seeds):
        drive.cues.to_csv(command.out / f"{drive.cues.name}.csv")


def _print(command: EndureCommand, results: EnduranceResults, outcome: EnduranceOutcome) -> None:
    from ..evaluation.endurance.results import tables
    from ..evaluation.reporting.text import how_many, print_table, table_console

    console = table_console()
    for table in tables(results):
        print_table(console, table)
    if outcome.skipped:
        drives = how_many(len(outcome.skipped), "drive")
        console.print(f"{drives} skipped: the car left the range of its model", highlight=False)
    state = "" if outcome.finished else "interrupted, the same command goes on; "
    console.print(
        f"{state}{how_many(outcome.driven, 'drive')} driven now; everything is in {command.out}",
        highlight=False,
        markup=False,
    )
