"""Frequency responses as tables, CSV and JSON."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..envs.settings import configuration
from . import saved
from .frequency_response import FrequencyResponse
from .provenance import versions
from .spreadsheet import save_rows
from .text_table import NOTHING, TextTable, number

SCHEMA: Final = 1
"""Version of ``frequency-response.json``."""

CROSSED: Final = (("f_x", "w_y"), ("f_y", "w_x"), ("w_y", "f_x"), ("w_x", "f_y"))
"""Input and felt axis of the crossed responses that the test asks for: tilt coordination, and its reverse."""


def response_table(response: FrequencyResponse) -> TextTable:
    """Modulus and phase of each axis to itself and of the crossed responses, over frequency.

    In silence the modulus is 0 and there is no phase.
    """
    pairs = [(axis, axis) for axis in response.inputs]
    pairs += [pair for pair in CROSSED if pair[0] in response.inputs]
    rows: list[tuple[str, ...]] = []
    for moved, felt in pairs:
        values = response.response(moved, felt)
        name = moved if moved == felt else f"{moved} to {felt}"
        modulus = np.abs(values) * factor(moved, felt)
        rows.append(
            (f"{name}, modulus{unit(moved, felt)}", *(number(value) if value else "0" for value in modulus))
        )
        phases = (f"{round(np.degrees(np.angle(value)))}" if value else NOTHING for value in values)
        rows.append((f"{name}, phase deg", *phases))
    header = ("rad/s", *(f"{frequency:.3g}" for frequency in response.test.frequencies))
    title = f"{response.policy} on {response.platform}, {amplitudes(response.test.scale)}"
    return TextTable(title, header, tuple(rows))


def amplitudes(scale: float) -> str:
    """How large the inputs are, for titles."""
    return "the test's amplitudes" if scale == 1.0 else f"{scale:g} of the test's amplitudes"


def factor(moved: str, felt: str) -> float:
    """From SI units to those a person reads: degrees."""
    if moved[0] == felt[0]:
        return 1.0
    return float(np.degrees(1.0) if felt.startswith("w") else np.radians(1.0))


def unit(moved: str, felt: str) -> str:
    """Of the modulus, in brackets, where it has one."""
    if moved[0] == felt[0]:
        return ""
    return " (deg/s)/(m/s²)" if felt.startswith("w") else " (m/s²)/(deg/s)"


def _flat(response: FrequencyResponse) -> Iterator[Mapping[str, Any]]:
    for sinusoid in response.sinusoids:
        for felt, modulus in sinusoid.modulus.items():
            yield {
                "policy": response.policy,
                "input": sinusoid.input,
                "felt": felt,
                "frequency_rad_s": sinusoid.frequency,
                "amplitude": sinusoid.amplitude,
                "modulus": modulus,
                "phase_rad": sinusoid.phase[felt],
                "explained": sinusoid.explained if felt == sinusoid.input else None,
                "at_limit": sinusoid.at_limit,
            }


def save_csv(responses: Sequence[FrequencyResponse], path: Path) -> None:
    """Write one row a policy, input axis, felt axis and frequency, in SI units."""
    save_rows([row for response in responses for row in _flat(response)], path)


@configuration
class SavedResponses:
    """What ``frequency-response.json`` holds.

    Args:
        schema: :data:`SCHEMA`.
        command: The command line.
        versions: Of this package, Python and the libraries that matter.
        responses: One a policy.
    """

    schema: int
    command: str
    versions: dict[str, str]
    responses: tuple[FrequencyResponse, ...]


def save_json(responses: Sequence[FrequencyResponse], arguments: Sequence[str], path: Path) -> None:
    """Write everything, with the command line and the versions that made it."""
    saved.save_json(SavedResponses(SCHEMA, shlex.join(arguments), versions(), tuple(responses)), path)


def load_json(path: str | Path) -> list[FrequencyResponse]:
    """Read what :func:`save_json` wrote.

    Raises:
        DataError: the file is missing, broken, or of another version.
        ConfigurationError: a field is missing, unknown or wrong.
    """
    return list(saved.load_json(SavedResponses, path, "frequency responses", SCHEMA).responses)
