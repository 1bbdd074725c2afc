"""``motion-cueing frequency-response``: the objective motion cueing test, for any policy."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from rich.console import Console
from tyro.conf import FlagCreatePairsOff, arg

from ..envs.errors import ConfigurationError, DataError, look_up
from ..envs.storage import write_bytes
from .frequency_probe import OMCT_FREQUENCIES, FrequencyTest
from .metrics import CUE_AXES
from .selection import find_platform, find_policies
from .suite_progress import suite_progress
from .text_table import print_table
from .words import words_of

if TYPE_CHECKING:
    from .frequency_response import FrequencyResponse

_PLAIN_WIDTH: Final = 180
"""Columns of the tables where the output is no terminal."""

_SMALL: Final = 1e-6
"""Scale below which amplitudes drown in rounding."""


@dataclass(frozen=True)
class FrequencyResponseCommand:
    """Measure modulus and phase of what the driver feels, axis by axis, in sinusoids of the car's motion.

    The objective motion cueing test in the spirit of ICAO 9625, for any policy. Writes
    frequency-response.json, .csv, bode.png and matrix.png.
    """

    policy: Annotated[tuple[str, ...], arg(metavar="NAME|FILE ...")]
    """Policies, by name or file."""
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


def run(command: FrequencyResponseCommand) -> int:
    """Measure, print and write.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from .frequency_figure import bode_figure, matrix_figure
    from .frequency_tables import response_table, save_csv, save_json

    responses = measure_all(command)
    arguments = words_of("frequency-response", command)
    save_json(responses, arguments, command.out / "frequency-response.json")
    save_csv(responses, command.out / "frequency-response.csv")
    write_bytes(command.out / "bode.png", bode_figure(responses))
    write_bytes(command.out / "matrix.png", matrix_figure(responses))
    console = Console(width=None if sys.stdout.isatty() else _PLAIN_WIDTH)
    for response in responses:
        print_table(console, response_table(response))
    console.print(
        f"Every axis to every axis is in {command.out}: bode.png, matrix.png, frequency-response.csv",
        highlight=False,
        markup=False,
    )
    return 0


def measure_all(command: FrequencyResponseCommand) -> list[FrequencyResponse]:
    """The response of each policy, once all arguments are checked.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from .frequency_response import frequency_response
    from .policies import make_policy

    test, axes = _test(command), _axes(command)
    if command.out.exists() and not command.out.is_dir():
        raise DataError(f"--out {command.out} is a file; name a folder")
    platform = find_platform(command.platform)
    names = find_policies(command.policy, platform)
    policies = {label: make_policy(name, platform) for label, name in names.items()}
    found = []
    with suite_progress(len(policies) * len(test.frequencies)) as advance:
        for label, policy in policies.items():
            response = frequency_response(policy, platform, test, axes, _telling(advance, label))
            found.append(replace(response, policy=label))
    return found


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
