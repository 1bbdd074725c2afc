"""``motion-cueing evaluate`` and ``paper``: drives, with tables and a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from ..envs.errors import ConfigurationError
from ..envs.progress import drives_progress
from ..envs.storage import check_folder, check_own_json
from . import arguments
from .arguments import (
    ALL,
    BENCHMARK,
    CarName,
    Compensate,
    ManeuverNames,
    OutFolder,
    PlatformName,
    PolicyNames,
    ScaleText,
    option,
    several,
)

if TYPE_CHECKING:
    from ..envs.car import Car
    from ..envs.cues import CueScale, CueTrace
    from ..envs.platform import Platform
    from ..evaluation.reporting.packing import PackedDrive
    from ..evaluation.results import Results
    from ..evaluation.suite import CueSource, Drive, Outcome
    from ..evaluation.trajectory import Trajectory


VIEW: Final = "view.html"
"""The page with the machine, in the folder of an evaluation."""


@dataclass(frozen=True, kw_only=True)
class EvaluateCommand:
    """Drive maneuvers with policies, and say which policy is better, by how much, and why.

    Writes results.json, results.csv, report.html, the benchmark over all maneuvers, and every trajectory.
    Without --policies it drives the ones that are meant for comparison.
    """

    policies: PolicyNames = ()
    maneuvers: ManeuverNames = (ALL,)
    replays: Annotated[tuple[Path, ...], several("FILE.npz ...")] = ()
    """Drives to score as they were driven, and their cues to drive: logs of `motion-cueing serve`."""
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    metrics: Annotated[tuple[Literal["feel"], ...], several("feel")] = ()
    """Tables beside the usual ones. `feel`: what people feel, and whether it agrees with J. It measures the
    incidence of motion sickness, too, and writes feel.md."""
    suite: Literal[1, 2] = 1
    """Version of the standard maneuvers that `all` stands for."""
    scale: ScaleText = "1"
    compensate: Compensate = False
    preview: Literal["true", "held", "predicted"] = "true"
    """Where policies with a preview have it from: the drive itself, the present cue, or a predictor."""
    predictor: Annotated[str, option("NAME|FILE.safetensors")] = "road"
    """The predictor of --preview predicted: that of the package, or the file of another one."""
    figures: bool = False
    """Draw figures for print as well, in PDF and PNG: one a maneuver, and the benchmark."""
    view: bool = False
    """Write view.html as well, the machine in three dimensions, to which the report links from each drive."""
    out: OutFolder = Path("results")


@dataclass(frozen=True, kw_only=True)
class PaperCommand:
    """Drive the six cases of the paper, draw its figures, and check each of its numbers.

    Writes paper.json, paper.html, the figures and the trajectories. The exit status is 1 if a number fails.
    """

    out: OutFolder = Path("paper")


@dataclass(frozen=True)
class Plan:
    """An evaluation, all names resolved.

    Args:
        maneuvers: Sources of cues by label.
        policies: Drives by label.
        out: Folder of the output.
        arguments: The command line.
        scale: Motion scale of the reference.
        skipped: Policies of the benchmark that cannot be driven here, and why; what is left out of a replay.
        feel: Whether the tables of what people feel are shown and written.
        figures: Whether figures for print are drawn.
        view: Whether the page with the machine is written.
    """

    maneuvers: Mapping[str, CueSource]
    policies: Mapping[str, Drive]
    platform: Platform
    car: Car
    out: Path
    arguments: tuple[str, ...]
    scale: CueScale
    skipped: Mapping[str, str] = field(default_factory=dict)
    feel: bool = False
    figures: bool = False
    view: bool = False


@dataclass(eq=False)
class Output:
    """Writes what belongs to one maneuver as soon as it is driven; keeps what the report plots.

    Maneuvers and policies are labels with their part of a file name.
    """

    plan: Plan
    maneuvers: Mapping[str, str]
    policies: Mapping[str, str]
    packed: dict[str, PackedDrive] = field(default_factory=dict)
    viewed: dict[str, PackedDrive] = field(default_factory=dict)

    def finish(self, maneuver: str, drives: Mapping[str, Trajectory]) -> None:
        """Save the trajectories of a maneuver, and its figure where figures are drawn."""
        from ..evaluation.reporting.packing import pack

        for policy, drive in drives.items():
            name = f"{self.maneuvers[maneuver]}--{self.policies[policy]}.npz"
            drive.save(self.plan.out / "trajectories" / name)
        self.packed[maneuver] = pack(drives)
        if self.plan.view:
            from ..evaluation.reporting.view import pack_view

            self.viewed[maneuver] = pack_view(drives, self.plan.maneuvers[maneuver]())
        if self.plan.figures:
            from ..evaluation.reporting.figures import maneuver_figure, save_figure

            save_figure(
                maneuver_figure(drives, list(self.policies)), self.plan.out / self.maneuvers[maneuver]
            )


def run(command: EvaluateCommand) -> int:
    """Evaluate; the exit status is 1 if a drive failed."""
    from ..evaluation.reporting.text import words_of

    return report(make_plan(command, words_of("evaluate", command)), BENCHMARK in command.policies)


def run_paper(command: PaperCommand) -> int:
    """Reproduce the paper; the exit status is 1 if a number fails."""
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "paper.json", frozenset({"schema", "checks"}))
    from ..evaluation.paper.cases import run as reproduce

    return reproduce(command.out)


def report(plan: Plan, ranked: bool) -> int:
    """Drive, write and print; the exit status is 1 if a drive failed.

    Args:
        plan: What is driven.
        ranked: Whether the table of the benchmark is printed as well.
    """
    from ..evaluation.benchmark.table import benchmark_table
    from ..evaluation.reporting.tables import feel_tables, print_results
    from ..evaluation.reporting.text import print_table, save_markdown, table_console

    results, output = evaluate(plan)
    save(results, output)
    if plan.feel:
        save_markdown(plan.out / "feel.md", *feel_tables(results))
    console = table_console()
    print_results(console, results, plan.feel)
    if ranked and results.scores:
        print_table(console, benchmark_table(results))
    console.print(
        f"Everything is in {plan.out}; open {plan.out / 'report.html'}", highlight=False, markup=False
    )
    return 1 if results.failures else 0


def make_plan(command: EvaluateCommand, words: Sequence[str]) -> Plan:
    """Resolve every name of a command before anything is driven.

    Args:
        command: Its arguments.
        words: The command line, program first.
    """
    from ..envs.cues import CueScale
    from ..evaluation.suite import DRIVEN, at_scale, cue_sources, load_drives, scale_of

    check_folder("--out", command.out)
    check_own_json("--out", command.out / "results.json", frozenset({"schema", "provenance"}))
    platform, car = arguments.find_platform(command.platform), arguments.find_car(command.car)
    if command.replays and command.maneuvers != EvaluateCommand().maneuvers:
        raise ConfigurationError("--replays have their own cues; leave --maneuvers out")
    scale = CueScale.parse(command.scale)
    if command.replays and not scale.neutral:
        raise ConfigurationError("--replays have been driven at their own scale; leave --scale out")
    recorded, skipped = load_drives(command.replays, platform)
    drives: dict[str, Drive] = {DRIVEN: lambda cues: recorded[cues.name]} if recorded else {}
    if command.policies or not recorded:
        make = partial(arguments.make_policy, compensate=True) if command.compensate else None
        policies, missing = arguments.make_policies(command.policies, platform, make)
        skipped |= missing
        drives |= {label: partial(_drive, policy, platform, car) for label, policy in policies.items()}
    sources = (
        cue_sources(recorded)
        if recorded
        else at_scale(arguments.find_maneuvers(command.maneuvers, car, command.suite), scale)
    )
    if command.preview != "true":
        sources = arguments.with_previews(sources, command.preview, command.predictor)
    return Plan(
        maneuvers=sources,
        policies=drives,
        platform=platform,
        car=car,
        out=command.out,
        arguments=tuple(words),
        scale=scale_of(recorded) if recorded else scale,
        skipped=skipped,
        feel="feel" in command.metrics,
        figures=command.figures,
        view=command.view,
    )


def _drive(policy: Any, platform: Platform, car: Car, cues: CueTrace) -> Trajectory:
    from ..evaluation.rollout import rollout

    return rollout(policy, cues, platform=platform, car=car)


def evaluate(plan: Plan) -> tuple[Results, Output]:
    """Drive and measure everything; what the report plots comes beside the results."""
    from ..evaluation.reporting.text import file_names
    from ..evaluation.suite import run_suite

    output = Output(plan, file_names(plan.maneuvers), file_names(plan.policies))
    with drives_progress(len(plan.maneuvers) * (len(plan.policies) + 1)) as advance:
        outcome = run_suite(plan.maneuvers, plan.policies, output.finish, advance, costly=plan.feel)
    return collect(plan, outcome), output


def collect(plan: Plan, outcome: Outcome) -> Results:
    """The results of an outcome, with what made them."""
    from ..evaluation.results import Provenance, Results

    origin = Provenance.of(plan.arguments, plan.platform, plan.car, outcome.metadata, plan.scale)
    return Results.of(outcome.maneuvers, outcome.failures, origin, skipped=plan.skipped, notes=outcome.notes)


def save(results: Results, output: Output) -> None:
    """Write results.json, results.csv, the benchmark, report.html, and the view and figures if wanted."""
    from ..evaluation.benchmark.table import save_benchmark
    from ..evaluation.reporting.report import save_report
    from ..evaluation.reporting.view import save_view

    plan, folder = output.plan, output.plan.out
    results.save_json(folder / "results.json")
    results.save_csv(folder / "results.csv")
    if len(results.scores) > 1:
        save_benchmark(results, folder)
    if plan.figures:
        from ..evaluation.reporting.figures import benchmark_figure, save_figure

        if (figure := benchmark_figure(results)) is not None:
            save_figure(figure, folder / "benchmark")
    if output.viewed:
        save_view(
            output.viewed, plan.platform, folder / VIEW, f"Drives on the motion base {plan.platform.name}"
        )
    save_report(results, folder / "report.html", output.packed, VIEW if output.viewed else "")
