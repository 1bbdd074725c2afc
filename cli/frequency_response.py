"""``motion-cueing frequency-response``: the objective motion cueing test, for any policy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from rich.markup import escape
from tyro.conf import FlagCreatePairsOff, arg

from ..envs.errors import ConfigurationError, MotionCueingError, look_up
from ..envs.storage import check_folder, check_own_json, write_bytes
from ..evaluation.benchmark import BENCHMARK
from ..evaluation.frequency_response.reporting import response_table, save_csv, save_json
from ..evaluation.frequency_response.response import OMCT_FREQUENCIES, FrequencyTest
from ..evaluation.metrics import CUE_AXES
from ..evaluation.reporting.text import print_table, table_console, words_of
from ..evaluation.selection import find_platform, find_policies
from ..evaluation.suite import explain, suite_progress

if TYPE_CHECKING:
    from ..baselines.policy import Policy
    from ..envs.platform import Platform
    from ..evaluation.frequency_response.response import FrequencyResponse

_SMALL: Final = 1e-6
"""Scale below which amplitudes drown in rounding."""


@dataclass(frozen=True)
class FrequencyResponseCommand:
    """Measure modulus and phase of what the driver feels, axis by axis, in sinusoids of the car's motion.

    The objective motion cueing test in the spirit of ICAO 9625, for any policy. Writes
    frequency-response.json, .csv, bode.png and matrix.png.
    """

    policy: Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")]
    """Policies, by name or file; `benchmark` for all controllers that can be tested."""
    platform: Annotated[str, arg(metavar="NAME|FILE")] = "paper"
    """Motion base, by name or YAML file."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("frequency-response")
    """Folder for everything that is written; made if missing."""
    amplitude: float = 1.0
    """Scale of the amplitudes: 1 for the test's, 0.01 for what is linear."""
    frequencies: tuple[float, ...] = OMCT_FREQUENCIES
    """Of the sinusoids, rad/s."""
    settling: float = FrequencyTest().settling
    """Time before a sinusoid is measured, s; longer for a policy that is slower to settle."""
    axes: Annotated[tuple[str, ...], arg(metavar="f_x|f_y|f_z|w_x|w_y|w_z ...")] = CUE_AXES
    """Axes of the car that move, each alone."""
    gravity: Annotated[bool, FlagCreatePairsOff] = False
    """Let roll and pitch bring the specific force of a tilted car with them; else rotations are pure."""


@dataclass(eq=False)
class Measured:
    """What a command gave.

    Args:
        responses: One a policy.
        left_out: Policies of the benchmark that cannot be tested here, and why.
        failed: Policies whose test came to no end, and why.
    """

    responses: list[FrequencyResponse] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)


def run(command: FrequencyResponseCommand) -> int:
    """Measure, print and write; the exit status is 1 if a policy's test failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    measured = measure_all(command)
    console = table_console()
    if measured.responses:
        _save(measured.responses, command)
    for response in measured.responses:
        print_table(console, response_table(response))
    for policy, reason in measured.left_out.items():
        console.print(f"[bold]left out[/bold] {escape(policy)}: {escape(reason)}", highlight=False)
    for policy, reason in measured.failed.items():
        console.print(f"[bold red]failed[/bold red] {escape(policy)}: {escape(reason)}", highlight=False)
    if measured.responses:
        told = f"Every axis to every axis is in {command.out}: bode.png, matrix.png, frequency-response.csv"
        console.print(told, highlight=False, markup=False)
    return 1 if measured.failed else 0


def _save(responses: list[FrequencyResponse], command: FrequencyResponseCommand) -> None:
    from ..evaluation.frequency_response.reporting import bode_figure, matrix_figure

    save_json(responses, words_of("frequency-response", command), command.out / "frequency-response.json")
    save_csv(responses, command.out / "frequency-response.csv")
    write_bytes(command.out / "bode.png", bode_figure(responses))
    write_bytes(command.out / "matrix.png", matrix_figure(responses))


def measure_all(command: FrequencyResponseCommand) -> Measured:
    """The response of each policy, once all arguments are checked.

    Raises:
        MotionCueingError: an argument is wrong, or a policy that is asked for by its name cannot be tested.
    """
    from ..evaluation.frequency_response.response import frequency_response

    test, axes = _test(command), _axes(command)
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "frequency-response.json", frozenset({"schema", "responses"}))
    platform = find_platform(command.platform)
    policies, left_out = _line_up(command, platform)
    found = Measured(left_out=left_out)
    with suite_progress(len(policies) * len(test.frequencies)) as advance:
        for label, policy in policies.items():
            # A policy is a user's code: whatever it raises must not cost what was measured before.
            try:
                response = frequency_response(policy, platform, test, axes, _telling(advance, label))
            except Exception as error:
                found.failed[label] = explain(error)
            else:
                found.responses.append(replace(response, policy=label))
    return found


def _line_up(
    command: FrequencyResponseCommand, platform: Platform
) -> tuple[dict[str, Policy], dict[str, str]]:
    """Policies by label, and the reasons of those of the benchmark that are skipped.

    Raises:
        MotionCueingError: a policy that is asked for by its name cannot be made or tested.
    """
    policies: dict[str, Policy] = {}
    left_out: dict[str, str] = {}
    for label, name in find_policies(command.policy, platform).items():
        try:
            policies[label] = _testable(name, platform)
        except MotionCueingError as error:
            if BENCHMARK not in command.policy or name in command.policy:
                raise
            left_out[label] = str(error)
    return policies, left_out


def _testable(name: str, platform: Platform) -> Policy:
    from ..evaluation.policies import make_policy

    policy = make_policy(name, platform)
    if name == "classical-per-maneuver":
        raise ConfigurationError(
            f"{name} has a set for each standard maneuver and none for sinusoids, so it has no frequency "
            "response; use classical-tuned, or the .yaml file of one set"
        )
    return policy


def _test(command: FrequencyResponseCommand) -> FrequencyTest:
    if not command.amplitude >= _SMALL:
        raise ConfigurationError(f"--amplitude must be at least {_SMALL:g}, found {command.amplitude}")
    if not command.policy:
        raise ConfigurationError("--policy needs at least one name or file after it")
    frequencies = tuple(sorted(set(command.frequencies)))
    return FrequencyTest(
        frequencies=frequencies,
        scale=command.amplitude,
        gravity=command.gravity,
        settling=command.settling,
    )


def _axes(command: FrequencyResponseCommand) -> tuple[str, ...]:
    known = dict.fromkeys(CUE_AXES, True)
    for axis in command.axes:
        look_up("axis", axis, known)
    return tuple(axis for axis in CUE_AXES if axis in command.axes)


def _telling(advance: Callable[[str, str], None], label: str) -> Callable[[float], None]:
    def tell(frequency: float) -> None:
        advance(label, f"{frequency:g} rad/s")

    return tell
