"""``motion-cueing compare`` and ``robustness``: controllers on several machines, or under disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..envs.progress import drives_progress
from ..envs.storage import check_folder, check_own_json, write_bytes
from .arguments import (
    ALL,
    BENCHMARK,
    CarName,
    Compensate,
    Fresh,
    ManeuverNames,
    Name,
    Names,
    OutFolder,
    PlatformName,
    PolicyNames,
    find_car,
    find_maneuvers,
    find_platform,
    find_platforms,
    find_policies,
    known_lateness,
    several,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..envs.car import Car
    from ..evaluation.reporting.text import TextTable
    from ..evaluation.studies.disturbances import Study
    from ..evaluation.studies.results import StudyResults
    from ..evaluation.studies.study import Condition, StudyOutcome
    from ..evaluation.suite import CueSource


@dataclass(frozen=True, kw_only=True)
class CompareCommand:
    """Drive maneuvers on several machines with several policies: how much machine does a controller need?

    With several --scales each machine is driven at each, and J over that of standing still is shown.
    Drives that are done are kept in the output folder and not driven again.
    """

    platforms: Names = (ALL,)
    """Motion bases, by name or YAML file; `all` for every whole one."""
    policies: PolicyNames = (BENCHMARK,)
    maneuvers: ManeuverNames = (ALL,)
    ablations: bool = False
    """Also each machine without its turntable, without its carriage, and with its hexapod alone."""
    scales: Annotated[tuple[str, ...], several("SCALE ...")] = ("1",)
    """Motion scales of the reference, each as `evaluate --scale` takes it."""
    car: CarName = "sedan"
    out: OutFolder = Path("comparison")
    fresh: Fresh = False


@dataclass(frozen=True, kw_only=True)
class RobustnessCommand:
    """Drive policies with slower actuators, dead time, noisy sensors, another car, and in faster drives.

    Each policy is made for the machine as it should be and knows nothing of the disturbance. Policies of the
    benchmark that know the drive beforehand are skipped. Without --maneuvers the standard maneuvers are
    driven. Drives that are done are kept in the output folder and not driven again.
    """

    policies: PolicyNames = (BENCHMARK,)
    maneuvers: ManeuverNames = ()
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    other_car: Name = "e-class-suv"
    """The other car, by name or YAML file."""
    lag: float = 30.0
    """Natural frequency of the actuators' lag, rad/s."""
    dead_time: float = 0.05
    """Dead time of the actuators, s."""
    force_noise: float = 0.05
    """Standard deviation of the noise on specific forces, m/s^2."""
    rate_noise: float = 0.3
    """Standard deviation of the noise on angular velocities, deg/s."""
    time_scaling: float = 2.0
    """Factor on all accelerations of the drives."""
    compensate: Compensate = False
    """Drive with lag and dead time at once as well: uncompensated, compensated, and with a lateness that is
    wrong."""
    lateness_error: float = 0.3
    """With --compensate, policies are also given a lateness that is wrong by this share; 0 for the true one
    alone."""
    out: OutFolder = Path("robustness")
    fresh: Fresh = False


@dataclass(frozen=True, kw_only=True)
class MapFaultsCommand:
    """Drive policies that see the road ahead with wrong maps, gaps, and events that nobody announced.

    The drives are the same under each condition; what is known of the road is not. Without --maneuvers the
    standard maneuvers are driven. Drives that are done are kept in the output folder and not driven again.
    """

    policies: PolicyNames = ("classical", "learned", "learned-road")
    maneuvers: ManeuverNames = ()
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    low: float = 0.8
    """Smaller factor on the curvature of the map."""
    high: float = 1.2
    """Larger factor on it."""
    shift: float = 10.0
    """Error of the place along the way, m, in either sense."""
    gap: float = 5.0
    """Length of a gap in the map, s; one in every 15 s."""
    out: OutFolder = Path("map-faults")
    fresh: Fresh = False


def run_compare(command: CompareCommand) -> int:
    """Compare; the exit status is 1 if a drive failed."""
    from ..envs.cues import CueScale
    from ..evaluation.policies import make_policy
    from ..evaluation.reporting.text import words_of
    from ..evaluation.studies.figures import lines_figure
    from ..evaluation.studies.study import Condition
    from ..evaluation.suite import at_scale

    machines = find_platforms(command.platforms, command.ablations)
    car = find_car(command.car)
    maneuvers = find_maneuvers(command.maneuvers, car)
    policies = find_policies(command.policies, next(iter(machines.values())))
    prepare(command.out, command.fresh)
    scales = [CueScale.parse(text) for text in command.scales]
    conditions = [
        Condition(
            name if scale.neutral else f"{name} at {scale}",
            machine.description,
            machine,
            car,
            at_scale(maneuvers, scale),
            partial(make_policy, platform=machine, force=True),
        )
        for name, machine in machines.items()
        for scale in dict.fromkeys(scales)
    ]
    return run_and_save(
        conditions,
        policies,
        command.out,
        words_of("compare", command),
        "How much machine does a controller need?",
        False,
        lines_figure,
        still=any(not scale.neutral for scale in scales),
    )


def run_robustness(command: RobustnessCommand) -> int:
    """Drive everything; the exit status is 1 if a drive failed."""
    from ..evaluation.reporting.text import words_of
    from ..evaluation.studies.figures import heat_figure

    study = make_study(command)
    policies = find_policies(command.policies, study.platform)
    prepare(command.out, command.fresh)
    return run_and_save(
        study.conditions(),
        policies,
        command.out,
        words_of("robustness", command),
        "What happens to a controller?",
        True,
        heat_figure,
    )


def run_map_faults(command: MapFaultsCommand) -> int:
    """Drive everything; the exit status is 1 if a drive failed."""
    from ..envs.maneuvers import maneuver_names
    from ..evaluation.reporting.text import words_of
    from ..evaluation.studies.figures import heat_figure
    from ..evaluation.studies.roads import MapFaults, road_conditions, worst_seconds_table

    platform, car = find_platform(command.platform), find_car(command.car)
    maneuvers = find_maneuvers(command.maneuvers or tuple(maneuver_names()), car)
    faults = MapFaults(low=command.low, high=command.high, shift=command.shift, gap=command.gap)
    policies = find_policies(command.policies, platform)
    prepare(command.out, command.fresh)
    return run_and_save(
        road_conditions(platform, car, maneuvers, faults),
        policies,
        command.out,
        words_of("map-faults", command),
        "What happens when the map is wrong?",
        True,
        heat_figure,
        more=lambda results: [worst_seconds_table(results.metrics)],
    )


def make_study(command: RobustnessCommand) -> Study:
    """Everything but the policies, all names resolved."""
    from ..envs.maneuvers import maneuver_names
    from ..evaluation.benchmark.table import benchmark_policies
    from ..evaluation.policies import policy_names
    from ..evaluation.studies.disturbances import Disturbances, SensorNoise, Study

    names = command.maneuvers or tuple(maneuver_names())

    def maneuvers(driven: Car) -> Mapping[str, CueSource]:
        return find_maneuvers(names, driven)

    rows = benchmark_policies(policy_names()) if BENCHMARK in command.policies else []
    return Study(
        platform=find_platform(command.platform),
        car=find_car(command.car),
        other=find_car(command.other_car),
        maneuvers=maneuvers,
        causal=frozenset(rows) - set(command.policies),
        disturbances=Disturbances(
            lag=command.lag,
            dead_time=command.dead_time,
            noise=SensorNoise(force=command.force_noise, rate=math.radians(command.rate_noise)),
            time_scaling=command.time_scaling,
            known=known_lateness(command.compensate, command.lateness_error),
        ),
    )


def prepare(out: Path, fresh: bool) -> None:
    """Refuse a folder that cannot be used; with ``fresh``, remove the finished drives.

    Raises:
        DataError: ``out`` cannot be written, holds another's study.json, or drives that are damaged.
    """
    from ..evaluation.studies.study import check_kept, forget_kept

    check_folder("--out", out)
    check_own_json("--out", out / "study.json", frozenset({"schema", "conditions"}))
    if fresh:
        forget_kept(out)
    check_kept(out)


def run_and_save(
    conditions: list[Condition],
    policies: Mapping[str, str],
    out: Path,
    words: Sequence[str],
    title: str,
    ratios: bool,
    figure: Callable[[StudyResults], Figure | None],
    still: bool = False,
    more: Callable[[StudyResults], Sequence[TextTable]] = lambda results: (),
) -> int:
    """Drive a study, print its tables, write its files.

    Args:
        conditions: Parts of the study.
        policies: Name or file by label.
        out: Folder.
        words: The command line.
        title: Of the table of J.
        ratios: Whether J over that under the first condition stands in it.
        figure: Draws the study; None where there is nothing to draw.
        still: Whether J over that of standing still is shown.
        more: Further tables.

    Returns:
        Exit status: 1 if a drive failed.
    """
    from ..evaluation.reporting.figures import png
    from ..evaluation.reporting.text import print_table, save_markdown, table_console
    from ..evaluation.studies.results import matrix_table, print_study, score_tables, standstill_table
    from ..evaluation.studies.study import run_study

    count = sum(len(condition.maneuvers) for condition in conditions) * len(policies)
    with drives_progress(count) as advance:
        outcome = run_study(conditions, policies, out, advance)
    results = results_of(conditions, list(policies), outcome, words)
    results.save_json(out / "study.json")
    results.save_csv(out / "study.csv")
    skipped = [f"Skipped: {line}" for line in results.skipped_lines()]
    over_still = [standstill_table(results)] if still else []
    over_still += more(results)
    tables = [matrix_table(results, title, ratios), *over_still, *score_tables(results)]
    save_markdown(out / "study.md", *tables, *skipped)
    drawn = figure(results)
    if drawn is not None:
        write_bytes(out / "study.png", png(drawn))
    console = table_console()
    print_study(console, results, title, ratios)
    for table in over_still:
        print_table(console, table)
    console.print(
        f"{outcome.driven} of {count} drives driven now; everything is in {out}",
        highlight=False,
        markup=False,
    )
    return 1 if results.failures else 0


def results_of(
    conditions: Sequence[Condition], policies: Sequence[str], outcome: StudyOutcome, words: Sequence[str]
) -> StudyResults:
    """The results of an outcome, with what made them."""
    from ..evaluation.metrics import Criteria
    from ..evaluation.studies.results import StudyResults, common_maneuvers, summarize

    criteria = Criteria()
    return StudyResults(
        **StudyResults.head(words),
        conditions={condition.name: condition.description for condition in conditions},
        policies=tuple(policies),
        maneuvers=common_maneuvers(outcome.metrics),
        summaries=summarize(outcome.metrics, criteria),
        skipped=outcome.skipped,
        failures=tuple(outcome.failures),
        metrics=outcome.metrics,
        notes=outcome.statistics,
        criteria=criteria,
    )
