"""Bode plots of frequency responses: each axis to itself, and every axis to every other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from .criteria import Criteria
from .figure_style import CAR, line_styles, new_figure, png, styled
from .frequency_response import FrequencyResponse
from .metrics import CUE_AXES

_TITLES: Final = {
    "f_x": "Specific force x (surge)",
    "f_y": "Specific force y (sway)",
    "f_z": "Specific force z (heave)",
    "w_x": "Roll rate",
    "w_y": "Pitch rate",
    "w_z": "Yaw rate",
}
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
            grid[row, column].set_title(_TITLES[axis])
            grid[row, column].set_ylim(0.01, 4.0)
        for axes in grid[-1]:
            axes.set_xlabel("frequency (rad/s)")
        for k in range(4):
            grid[k, 0].set_ylabel("phase (deg)" if k % 2 else "modulus")
        _finish(figure, grid[0, 0], responses, "Frequency response, each axis to itself")
        return png(figure)


def matrix_figure(responses: Sequence[FrequencyResponse], criteria: Criteria | None = None) -> bytes:
    """A PNG of the modulus of each axis (rows) to each input (columns), in indifference zones."""
    scales = dict(zip(CUE_AXES, (criteria or Criteria()).scales, strict=True))
    with styled():
        figure = new_figure(13.0, 11.0)
        grid = figure.subplots(6, 6, sharex=True, sharey=True)
        styles = _styles(responses)
        for i, felt in enumerate(CUE_AXES):
            for j, moved in enumerate(CUE_AXES):
                _modulus(grid[i, j], responses, styles, moved, felt, scales[moved] / scales[felt])
                if felt == moved:
                    grid[i, j].set_facecolor("#f3f6f9")
            grid[i, 0].set_ylabel(f"felt {felt}")
            grid[0, i].set_title(f"car's {CUE_AXES[i]}")
            grid[-1, i].set_xlabel("rad/s")
        note = "modulus in indifference zones (0.6 m/s², 3 deg/s) per zone; off the diagonal all is false"
        _finish(figure, grid[0, 0], responses, f"Every axis to every input: {note}")
        return png(figure)


def _styles(responses: Sequence[FrequencyResponse]) -> Styles:
    return line_styles([response.policy for response in responses])


def _finish(figure: Any, first: Axes, responses: Sequence[FrequencyResponse], title: str) -> None:
    about = f"motion base {responses[0].platform}, {responses[0].test.scale:g} × the test's amplitudes"
    figure.suptitle(f"{title} ({about})", fontsize=11, x=0.01, ha="left")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=9)


def _modulus(
    axes: Axes,
    responses: Sequence[FrequencyResponse],
    styles: Styles,
    moved: str,
    felt: str,
    scale: float,
) -> None:
    if moved == felt:
        axes.axhline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    for response in responses:
        values = np.maximum(scale * np.abs(response.response(moved, felt)), 0.5 * _LEAST)
        axes.plot(
            response.frequencies(moved),
            values,
            marker="o",
            markersize=2.5,
            label=response.policy,
            **styles[response.policy],
        )
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
        # Where nothing is felt the phase is that of rounding.
        felt = np.abs(values) > _LEAST
        phase = np.degrees(np.unwrap(np.angle(values[felt])))
        line = {"marker": "o", "markersize": 2.5, **styles[response.policy]}
        axes.plot(response.frequencies(axis)[felt], phase, **line)
    _frequencies(axes)
    axes.set_ylim(-280.0, 200.0)
    axes.set_yticks(range(-270, 181, 90))
