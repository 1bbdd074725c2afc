"""``motion-cueing evaluate``: every policy on every maneuver, with tables, figures and a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import FlagCreatePairsOff, arg

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, MotionCueingError
from ..envs.storage import check_folder, check_own_json, write_bytes
from ..evaluation.benchmark import BENCHMARK, benchmark_table, save_benchmark
from ..evaluation.reporting.figures import benchmark_figure, maneuver_figure, png
from ..evaluation.reporting.report import save_report
from ..evaluation.reporting.tables import print_results
from ..evaluation.reporting.text import file_names, print_table, table_console, words_of
from ..evaluation.results import Provenance, Results
from ..evaluation.selection import ALL, find_car, find_maneuvers, find_platform, find_policies
from ..evaluation.suite import (
    DRIVEN,
    CueSource,
    Drive,
    Outcome,
    cue_sources,
    load_drives,
    run_suite,
    suite_progress,
)
from ..evaluation.trajectory import Trajectory

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..envs.platform import Platform

Name = Annotated[str, arg(metavar="NAME|FILE")]
Names = Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")]
Files = Annotated[tuple[Path, ...], arg(metavar="FILE.npz ...")]
Folder = Annotated[Path, arg(metavar="DIR")]


@dataclass(frozen=True)
class EvaluateCommand:
    """Drive maneuvers with policies, and say which policy is better, by how much, and why.

    Writes results.json, results.csv, report.html, the benchmark over all maneuvers, one figure a maneuver,
    and every trajectory.
    `motion-cueing list` shows all names.
    """

    policy: Names = ()
    """Policies, by name or file; default: the ones meant for comparison; `benchmark` for all controllers."""
    maneuver: Names = (ALL,)
    """Maneuvers and recordings, by name or cue CSV file; `all` for every one of them."""
    replay: Files = ()
    """Drives to score as they were driven, and their cues to drive: logs of `motion-cueing serve`."""
    platform: Name = "paper"
    """Motion base, by name or YAML file."""
    car: Name = "sedan"
    """Car, by name or YAML file."""
    out: Folder = Path("results")
    """Folder for everything that is written; made if missing."""
    paper: Annotated[bool, FlagCreatePairsOff] = False
    """Make the six cases and the figures of the paper instead, with a pass or a fail for each number."""


@dataclass(frozen=True)
class Plan:
    """What a command asks for, all names resolved.

    Args:
        maneuvers: Sources of cues by label.
        policies: Drives by label.
        platform: The motion base.
        car: The car.
        out: Folder of the output.
        arguments: The command line that asks for it.
        left_out: Policies of the benchmark that cannot be driven here, and why.
    """

    maneuvers: Mapping[str, CueSource]
    policies: Mapping[str, Drive]
    platform: Platform
    car: Car
    out: Path
    arguments: tuple[str, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)


@dataclass(eq=False)
class _Output:
    """Writes what belongs to one maneuver as soon as it is driven; keeps the figures for the report.

    Maneuvers and policies are labels with their part of a file name.
    """

    folder: Path
    maneuvers: Mapping[str, str]
    policies: Mapping[str, str]
    figures: dict[str, bytes] = field(default_factory=dict)

    def finish(self, maneuver: str, drives: Mapping[str, Trajectory]) -> None:
        """Save trajectories and figure of a maneuver."""
        for policy, drive in drives.items():
            name = f"{self.maneuvers[maneuver]}--{self.policies[policy]}.npz"
            drive.save(self.folder / "trajectories" / name)
        self.figures[maneuver] = png(maneuver_figure(drives, list(self.policies)))
        write_bytes(self.folder / f"{self.maneuvers[maneuver]}.png", self.figures[maneuver])


def run(command: EvaluateCommand) -> int:
    """Evaluate; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    if command.paper:
        return _run_paper(command)
    plan = make_plan(command)
    results, figures = evaluate(plan)
    save(results, figures, plan.out)
    console = table_console()
    print_results(console, results)
    if BENCHMARK in command.policy and results.scores:
        print_table(console, benchmark_table(results))
    console.print(
        f"Everything is in {plan.out}; open {plan.out / 'report.html'}", highlight=False, markup=False
    )
    return 1 if results.failures else 0


def make_plan(command: EvaluateCommand) -> Plan:
    """Resolve every name of a command before anything is driven.

    Raises:
        UnknownNameError: a name is not registered.
        ConfigurationError: a YAML file has a wrong field.
        DataError: a file is missing or broken.
    """
    if not command.maneuver:
        raise ConfigurationError("--maneuver needs at least one name; `all` stands for every maneuver")
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "results.json", frozenset({"schema", "provenance"}))
    platform, car = find_platform(command.platform), find_car(command.car)
    recorded = _recorded(command, platform)
    policies, left_out = _line_up(command, platform, car) if command.policy or not recorded else ({}, {})
    return Plan(
        maneuvers=cue_sources(recorded) if recorded else find_maneuvers(command.maneuver, car),
        policies={**_as_driven(recorded), **policies},
        platform=platform,
        car=car,
        out=command.out,
        arguments=command_line(command),
        left_out=left_out,
    )


def _recorded(command: EvaluateCommand, platform: Platform) -> dict[str, Trajectory]:
    """Drives by label that are not to be driven again."""
    if command.replay and command.maneuver != EvaluateCommand().maneuver:
        raise ConfigurationError("--replay has its own cues; leave --maneuver out")
    return load_drives(command.replay, platform)


def _as_driven(recorded: Mapping[str, Trajectory]) -> dict[str, Drive]:
    """What gives the recorded drives, where there are any."""
    return {DRIVEN: lambda cues: recorded[cues.name]} if recorded else {}


def _line_up(
    command: EvaluateCommand, platform: Platform, car: Car
) -> tuple[dict[str, Drive], dict[str, str]]:
    """Drives by label, and the reasons of those left out; a policy that is asked for by its name must fit."""
    drives: dict[str, Drive] = {}
    left_out: dict[str, str] = {}
    for label, name in find_policies(command.policy, platform).items():
        try:
            drives[label] = _drive_with(name, platform, car)
        except MotionCueingError as error:
            if BENCHMARK not in command.policy or name in command.policy:
                raise
            left_out[label] = str(error)
    return drives, left_out


def command_line(command: EvaluateCommand) -> tuple[str, ...]:
    """The words that give this command: the options that differ from their default."""
    return tuple(words_of("evaluate", command))


def evaluate(plan: Plan) -> tuple[Results, dict[str, bytes]]:
    """Drive and measure everything; figures by maneuver come beside the results."""
    output = _Output(plan.out, file_names(plan.maneuvers), file_names(plan.policies))
    with suite_progress(len(plan.maneuvers) * (len(plan.policies) + 1)) as advance:
        outcome = run_suite(plan.maneuvers, plan.policies, output.finish, advance)
    return collect(plan, outcome), output.figures


def collect(plan: Plan, outcome: Outcome) -> Results:
    """The results of an outcome, with what made them."""
    origin = Provenance.of(plan.arguments, plan.platform, plan.car, outcome.metadata)
    return Results.of(outcome.maneuvers, outcome.failures, origin, skipped=plan.left_out, notes=outcome.notes)


def save(results: Results, figures: Mapping[str, bytes], folder: Path) -> None:
    """Write results.json, results.csv, the benchmark and report.html into a folder."""
    results.save_json(folder / "results.json")
    results.save_csv(folder / "results.csv")
    figure = benchmark_figure(results)
    image = None if figure is None else png(figure)
    if image is not None:
        save_benchmark(results, folder)
        write_bytes(folder / "benchmark.png", image)
    save_report(results, figures, folder / "report.html", image)


def _drive_with(name: str, platform: Platform, car: Car) -> Drive:
    from ..evaluation.policies import make_policy
    from ..evaluation.rollout import rollout

    policy = make_policy(name, platform)

    def drive(cues: CueTrace) -> Trajectory:
        return rollout(policy, cues, platform=platform, car=car)

    return drive


def _run_paper(command: EvaluateCommand) -> int:
    own = replace(command, paper=False, out=EvaluateCommand().out)
    if own != EvaluateCommand():
        raise ConfigurationError(
            "--paper has its own cases; leave --policy, --maneuver, --platform and --car out"
        )
    from ..evaluation.paper.cases import run as run_paper

    check_folder("--out", command.out)
    check_own_json("--out", command.out / "paper.json", frozenset({"schema", "checks"}))
    return run_paper(command.out)
