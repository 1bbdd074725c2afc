"""Frequency responses as tables, CSV, JSON and Bode plots."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from ...envs.provenance import versions
from ...envs.settings import configuration
from ..metrics import CUE_AXES, Criteria
from ..reporting.figures import CAR, line_styles, new_figure, png, styled
from ..reporting.text import NOTHING, TextTable, number
from ..results import Saved, save_rows
from .response import FrequencyResponse

SCHEMA: Final = 1
"""Version of ``frequency-response.json``."""

CROSSED: Final = (("f_x", "w_y"), ("f_y", "w_x"), ("w_y", "f_x"), ("w_x", "f_y"))
"""Input axis and simulator axis of the crossed responses of the test: tilt coordination, and its reverse."""


def response_table(response: FrequencyResponse) -> TextTable:
    """Modulus and phase of each axis to itself and of the crossed responses, over frequency.

    In silence the modulus is 0 and there is no phase.
    """
    pairs = [(axis, axis) for axis in response.inputs]
    pairs += [pair for pair in CROSSED if pair[0] in response.inputs]
    rows: list[tuple[str, ...]] = []
    for moved, simulated in pairs:
        values = response.response(moved, simulated)
        name = moved if moved == simulated else f"{moved} to {simulated}"
        modulus = np.abs(values) * factor(moved, simulated)
        rows.append(
            (
                f"{name}, modulus{unit(moved, simulated)}",
                *(number(value) if value else "0" for value in modulus),
            )
        )
        phases = (f"{round(np.degrees(np.angle(value)))}" if value else NOTHING for value in values)
        rows.append((f"{name}, phase deg", *phases))
    header = ("rad/s", *(f"{frequency:.3g}" for frequency in response.test.frequencies))
    title = f"{response.policy} on {response.platform}, {amplitudes(response.test.scale)}"
    return TextTable(title, header, tuple(rows))


def amplitudes(scale: float) -> str:
    """How large the inputs are, for titles."""
    return "the test's amplitudes" if scale == 1.0 else f"{scale:g} of the test's amplitudes"


def factor(moved: str, simulated: str) -> float:
    """From SI units to those a person reads: degrees."""
    if moved[0] == simulated[0]:
        return 1.0
    return float(np.degrees(1.0) if simulated.startswith("w") else np.radians(1.0))


def unit(moved: str, simulated: str) -> str:
    """Of the modulus, in brackets, where it has one."""
    if moved[0] == simulated[0]:
        return ""
    return " (deg/s)/(m/s²)" if simulated.startswith("w") else " (m/s²)/(deg/s)"


def _flat(response: FrequencyResponse) -> Iterator[Mapping[str, Any]]:
    for sinusoid in response.sinusoids:
        for simulated, modulus in sinusoid.modulus.items():
            yield {
                "policy": response.policy,
                "input": sinusoid.input,
                "simulator_cue": simulated,
                "frequency_rad_s": sinusoid.frequency,
                "amplitude": sinusoid.amplitude,
                "modulus": modulus,
                "phase_rad": sinusoid.phase[simulated],
                "explained": sinusoid.explained if simulated == sinusoid.input else None,
                "at_limit": sinusoid.at_limit,
            }


def save_csv(responses: Sequence[FrequencyResponse], path: Path) -> None:
    """Write one row a policy, input axis, simulator axis and frequency, in SI units."""
    save_rows([row for response in responses for row in _flat(response)], path)


@configuration
class SavedResponses(Saved):
    """What ``frequency-response.json`` holds.

    Args:
        schema: :data:`SCHEMA`.
        command: The command line.
        versions: Of this package, Python and the libraries that matter.
        responses: One a policy.
    """

    what = "frequency responses"
    version = SCHEMA

    schema: int
    command: str
    versions: dict[str, str]
    responses: tuple[FrequencyResponse, ...]


def save_json(responses: Sequence[FrequencyResponse], words: Sequence[str], path: Path) -> None:
    """Write everything, with the command line and the versions that made it."""
    SavedResponses(SCHEMA, shlex.join(words), versions(), tuple(responses)).save_json(path)


def load_json(path: str | Path) -> list[FrequencyResponse]:
    """Read what :func:`save_json` wrote."""
    return list(SavedResponses.load_json(path).responses)


_TITLES: Final = {
    "f_x": "Specific force x (surge)",
    "f_y": "Specific force y (sway)",
    "f_z": "Specific force z (heave)",
    "w_x": "Roll rate",
    "w_y": "Pitch rate",
    "w_z": "Yaw rate",
}
_ABOUT_MATRIX: Final = (
    "modulus in indifference zones (0.6 m/s², 3 deg/s) per zone; off the diagonal all is false"
)
_LEAST: Final = 1e-3
"""Smallest modulus shown."""

Styles = Mapping[str, Mapping[str, Any]]


def bode_figure(responses: Sequence[FrequencyResponse]) -> bytes:
    """A PNG of modulus and phase of each axis to itself, one line a policy."""
    with styled():
        figure = new_figure(12.0, 9.5)
        grid = figure.subplots(4, 3, sharex=True)
        styles = _styles(responses)
        for i, axis in enumerate(CUE_AXES):
            row, column = 2 * (i // 3), i % 3
            _modulus(grid[row, column], responses, styles, axis, axis, 1.0)
            _phase(grid[row + 1, column], responses, styles, axis)
            if axis not in _inputs(responses):
                for axes in (grid[row, column], grid[row + 1, column]):
                    place = {"transform": axes.transAxes, "ha": "center", "va": "center"}
                    axes.text(0.5, 0.5, "not measured", color="#8a8a8a", **place)
                    axes.set_facecolor("#f5f5f5")
            grid[row, column].set_title(_TITLES[axis])
            grid[row, column].set_ylim(0.01, 4.0)
        for axes in grid[-1]:
            axes.set_xlabel("frequency (rad/s)")
        for k in range(4):
            grid[k, 0].set_ylabel("phase (deg)" if k % 2 else "modulus")
        simulated = {r.policy for r in responses for axis in r.inputs if np.any(r.response(axis, axis))}
        _finish(figure, responses, "Frequency response, each axis to itself", simulated)
        return png(figure)


def matrix_figure(responses: Sequence[FrequencyResponse], criteria: Criteria | None = None) -> bytes:
    """A PNG of the modulus of each axis (rows) to each input (columns), in indifference zones.

    Inputs that were not measured have no column.
    """
    scales = dict(zip(CUE_AXES, (criteria or Criteria()).indifference_zone, strict=True))
    inputs = _inputs(responses)
    with styled():
        figure = new_figure(max(9.0, 2.8 + 1.7 * len(inputs)), 11.0)
        grid = figure.subplots(len(CUE_AXES), len(inputs), sharex=True, sharey=True, squeeze=False)
        styles = _styles(responses)
        for j, moved in enumerate(inputs):
            for i, simulated in enumerate(CUE_AXES):
                _modulus(grid[i, j], responses, styles, moved, simulated, scales[moved] / scales[simulated])
                if simulated == moved:
                    grid[i, j].set_facecolor("#f3f6f9")
                grid[i, 0].set_ylabel(f"simulator {simulated}")
            grid[0, j].set_title(f"car's {moved}")
            grid[-1, j].set_xlabel("rad/s")
        drawn = {r.policy for r in responses for j in r.inputs for i in CUE_AXES if np.any(r.response(j, i))}
        _finish(figure, responses, "Every axis to every input", drawn, _ABOUT_MATRIX)
        return png(figure)


def _inputs(responses: Sequence[FrequencyResponse]) -> list[str]:
    """Axes that were moved."""
    return [axis for axis in CUE_AXES if any(axis in response.inputs for response in responses)]


def _styles(responses: Sequence[FrequencyResponse]) -> Styles:
    return line_styles([response.policy for response in responses])


def _finish(
    figure: Any,
    responses: Sequence[FrequencyResponse],
    title: str,
    simulated: Collection[str],
    more: str = "",
) -> None:
    """Title and legend, which says of policies without any line (not in ``simulated``) why they have none."""
    about = f"motion base {responses[0].platform}, {amplitudes(responses[0].test.scale)}"
    figure.suptitle(f"{title} ({about})\n{more}".strip(), fontsize=11, x=0.01, ha="left")
    styles = _styles(responses)
    nothing = {"linestyle": ""}
    handles = [Line2D([], [], **(styles[policy] if policy in simulated else nothing)) for policy in styles]
    labels = [policy if policy in simulated else f"{policy}: nothing comes through" for policy in styles]
    columns = max(1, min(len(labels), int(figure.get_figwidth() / 2)))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=9)


def _modulus(
    axes: Axes,
    responses: Sequence[FrequencyResponse],
    styles: Styles,
    moved: str,
    simulated: str,
    scale: float,
) -> None:
    if moved == simulated:
        axes.axhline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    for response in responses:
        modulus = scale * np.abs(response.response(moved, simulated))
        # Lines that leave the panel are seen to; where nothing comes through there is no line.
        values = np.where(modulus > 0.0, np.maximum(modulus, 0.5 * _LEAST), np.nan)
        line = {"marker": "o", "markersize": 2.5, **styles[response.policy]}
        axes.plot(response.frequencies(moved), values, **line)
    _frequencies(axes)
    axes.set_yscale("log")
    _decades(axes.yaxis, (0.001, 0.01, 0.1, 1.0, 10.0))
    axes.set_ylim(_LEAST, 10.0)


def _frequencies(axes: Axes) -> None:
    axes.set_xscale("log")
    _decades(axes.xaxis, (0.1, 1.0, 10.0))


def _decades(axis: Axis, ticks: tuple[float, ...]) -> None:
    # Matplotlib's own logarithmic ticks take most of the time of a figure with 36 panels.
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _phase(axes: Axes, responses: Sequence[FrequencyResponse], styles: Styles, axis: str) -> None:
    axes.axhline(0.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    for response in responses:
        values = response.response(axis, axis)
        # Where nothing comes through the phase is that of rounding.
        simulated = np.abs(values) > _LEAST
        phase = np.degrees(np.unwrap(np.angle(values[simulated])))
        line = {"marker": "o", "markersize": 2.5, **styles[response.policy]}
        axes.plot(response.frequencies(axis)[simulated], phase, **line)
    _frequencies(axes)
    axes.set_ylim(-280.0, 200.0)
    axes.set_yticks(range(-270, 181, 90))
