"""``motion-cueing frequency-response``: the objective motion cueing test, for any policy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from ..envs.errors import ConfigurationError, look_up
from ..envs.progress import drives_progress
from ..envs.storage import check_folder, check_own_json, write_bytes
from . import arguments
from .arguments import OutFolder, PlatformName, PolicyNames, find_platform, make_policies, several

if TYPE_CHECKING:
    from ..envs.platform import Platform
    from ..evaluation.frequency_response.response import FrequencyResponse, FrequencyTest

_SMALL: Final = 1e-6
"""Scale below which amplitudes drown in rounding."""
_AXES: Final = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")


@dataclass(frozen=True, kw_only=True)
class FrequencyResponseCommand:
    """Measure modulus and phase of the simulator's cues, axis by axis, in sinusoids of the car's motion.

    The objective motion cueing test in the spirit of ICAO 9625, for any policy. Writes
    frequency-response.json, .csv, bode.png and matrix.png.
    """

    policies: PolicyNames
    platform: PlatformName = "paper"
    out: OutFolder = Path("frequency-response")
    amplitude: float = 1.0
    """Scale of the amplitudes: 1 for the test's, 0.01 for what is linear."""
    frequencies: Annotated[tuple[float, ...], several("RAD/S ...")] = ()
    """Of the sinusoids, rad/s; default: the twelve of ICAO 9625, 0.1 to 15.849."""
    settling: float = 60.0
    """Time before a sinusoid is measured, s; longer for a policy that is slower to settle."""
    axes: Annotated[tuple[str, ...], several("f_x|f_y|f_z|w_x|w_y|w_z ...")] = _AXES
    """Axes of the car that move, each alone."""
    gravity: bool = False
    """Let roll and pitch bring the specific force of a tilted car with them; else rotations are pure."""


@dataclass(eq=False)
class Measured:
    """What a command gave.

    Args:
        responses: One a policy.
        skipped: Policies of the benchmark that cannot be tested here, and why.
        failed: Policies whose test came to no end, and why.
    """

    responses: list[FrequencyResponse] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)


def run(command: FrequencyResponseCommand) -> int:
    """Measure, print and write; the exit status is 1 if a policy's test failed."""
    from ..evaluation.frequency_response.reporting import response_table
    from ..evaluation.reporting.text import print_note, print_table, table_console

    measured = measure_all(command)
    console = table_console()
    if measured.responses:
        _save(measured.responses, command)
    for response in measured.responses:
        print_table(console, response_table(response))
    for policy, reason in measured.skipped.items():
        print_note(console, "skipped", f"{policy}: {reason}")
    for policy, reason in measured.failed.items():
        print_note(console, "failed", f"{policy}: {reason}")
    if measured.responses:
        where = f"Every axis to every axis is in {command.out}: bode.png, matrix.png, frequency-response.csv"
        console.print(where, highlight=False, markup=False)
    return 1 if measured.failed else 0


def _save(responses: list[FrequencyResponse], command: FrequencyResponseCommand) -> None:
    from ..evaluation.frequency_response.reporting import bode_figure, matrix_figure, save_csv, save_json
    from ..evaluation.reporting.text import words_of

    save_json(responses, words_of("frequency-response", command), command.out / "frequency-response.json")
    save_csv(responses, command.out / "frequency-response.csv")
    write_bytes(command.out / "bode.png", bode_figure(responses))
    write_bytes(command.out / "matrix.png", matrix_figure(responses))


def measure_all(command: FrequencyResponseCommand) -> Measured:
    """The response of each policy, once all arguments are checked."""
    from ..evaluation.frequency_response.response import frequency_response
    from ..evaluation.suite import explain

    test, axes = _test(command), _axes(command)
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "frequency-response.json", frozenset({"schema", "responses"}))
    platform = find_platform(command.platform)
    policies, skipped = make_policies(command.policies, platform, _testable)
    measured = Measured(skipped=skipped)
    with drives_progress(len(policies) * len(test.frequencies)) as advance:
        for label, policy in policies.items():
            # A policy is a user's code: whatever it raises must not cost what was measured before.
            try:
                response = frequency_response(policy, platform, test, axes, _telling(advance, label))
            except Exception as error:
                measured.failed[label] = explain(error)
            else:
                measured.responses.append(replace(response, policy=label))
    return measured


def _testable(name: str, platform: Platform) -> Any:
    policy = arguments.make_policy(name, platform)
    if name == "classical-per-maneuver":
        raise ConfigurationError(
            f"{name} has a set for each standard maneuver and none for sinusoids, so it has no frequency "
            "response; use classical-tuned, or the .yaml file of one set"
        )
    return policy


def _test(command: FrequencyResponseCommand) -> FrequencyTest:
    from ..evaluation.frequency_response.response import OMCT_FREQUENCIES, FrequencyTest

    if not command.amplitude >= _SMALL:
        raise ConfigurationError(f"--amplitude must be at least {_SMALL:g}, found {command.amplitude}")
    frequencies = tuple(sorted(set(command.frequencies or OMCT_FREQUENCIES)))
    return FrequencyTest(
        frequencies=frequencies,
        scale=command.amplitude,
        gravity=command.gravity,
        settling=command.settling,
    )


def _axes(command: FrequencyResponseCommand) -> tuple[str, ...]:
    known = dict.fromkeys(_AXES, True)
    for axis in command.axes:
        look_up("axis", axis, known)
    return tuple(axis for axis in _AXES if axis in command.axes)


def _telling(advance: Callable[[str, str], None], label: str) -> Callable[[float], None]:
    def tell(frequency: float) -> None:
        advance(label, f"{frequency:g} rad/s")

    return tell
