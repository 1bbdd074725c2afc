"""``motion-cueing curves``: what trainings came to over their steps, with the spread over seeds."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError, DataError, look_up
from ..envs.storage import check_file, replacing
from .arguments import (
    ManeuverName,
    PlatformName,
    Whole,
    find_car,
    find_maneuver,
    find_platform,
    make_policy,
    option,
    several,
)

Curve = NDArray[np.float64]
"""(2, k) steps and values."""

_SUFFIXES: Final = (".png", ".svg")
_INSIDE: Final = 4
"""Groups whose legend has room among the curves."""

_MILLION: Final = 1e6
_J: Final = "validation/J"
_NOISY: Final = "exploring"
_LEAST: Final = 1e-9
"""J below it has no place on a logarithmic axis."""
_LINE: Final = 0.065
"""Height of a label, as a share of the axes'."""


@dataclass(frozen=True, kw_only=True)
class CurvesCommand:
    """Draw a scalar of the log of one or more trainings.

    Folders whose names differ in a number at the end alone, as run-0 and run-1, are seeds of one training: a
    line for their mean, and a band from the lowest to the highest.
    """

    runs: Annotated[tuple[Path, ...], several("DIR ...")] = field(kw_only=False)
    """Folders that `motion-cueing train` made."""
    out: Annotated[Path | None, option("FILE.png|FILE.svg")] = None
    """Picture to write; needed without --live."""
    scalar: str = _J
    """Column of log.csv."""
    live: bool = False
    """Show one training as it goes on instead: a page on this machine with its log, and the film of
    its best agent so far in --maneuver."""
    maneuver: ManeuverName = "double-lane-change"
    platform: PlatformName = "paper"
    port: Whole = 0
    """Port on this machine for the page; 0 for any that is free."""


def run(command: CurvesCommand) -> int:
    """Draw, and print where each training ended; or serve the page."""
    from ..evaluation.reporting.figures import styled

    if command.live:
        return _show_live(command)
    if command.out is None:
        raise ConfigurationError("name the picture to write, as in --out curves.png, or give --live")
    if command.out.suffix not in _SUFFIXES:
        raise ConfigurationError(f"--out {command.out}: name a file that ends in {' or '.join(_SUFFIXES)}")
    check_file("--out", command.out)
    curves = {path: read_curve(path, command.scalar) for path in command.runs}
    groups = grouped(curves)
    with styled():
        figure = draw(groups, command.scalar)
        with replacing(command.out, "wb") as file:
            figure.savefig(file, format=command.out.suffix[1:])
    for name, seeds in groups.items():
        best = np.array([curve[1].min() for curve in seeds])
        print(f"{name}: lowest {command.scalar} {best.mean():.3g} ({best.min():.3g} to {best.max():.3g})")
    print(f"{command.out}: {len(curves)} trainings")
    return 0


def _show_live(command: CurvesCommand) -> int:
    """Serve the page of one training until Ctrl-C."""
    from ..evaluation.reporting.view.server import PageServer, Routes
    from ..evaluation.reporting.view.training import TrainingPage, drive_with
    from ..train.logs import read_log
    from .view import AGENT, serve

    if len(command.runs) != 1 or command.out is not None:
        raise ConfigurationError("--live shows one folder and writes nothing; leave the rest out")
    (folder,) = command.runs
    if not folder.is_dir():
        raise DataError(f"{folder}: there is no such folder; name that of a training")
    platform, car = find_platform(command.platform), find_car("sedan")
    label, source = find_maneuver(command.maneuver, car)
    cues = replace(source(), name=label)
    page = TrainingPage(
        folder,
        lambda: read_log(folder),
        folder / AGENT,
        drive_with(make_policy, cues, platform),
        cues,
        platform,
    )
    text = page.render()
    routes = Routes(lambda: text, {"/log": page.log, "/film": page.film})
    return serve(PageServer(routes, command.port), browser=False)


LEARNING: Final = "learning.png"
"""Picture of what was learned, in the folder of a training."""

_BESIDE: Final = {
    "classical/J": "classical washout",
    "no-motion/J": "standing still",
    "start/J": "at the start",
}
"""What a training is compared with, by column."""


def draw_learning(folder: Path) -> Path:
    """Draw J over the actions of a training beside its references, into its folder.

    Returns:
        The picture's file.

    Raises:
        DataError: the folder has no log of a training with a validation.
    """
    from ..evaluation.reporting.figures import styled

    with styled():
        figure = learning_figure(folder)
        with replacing(folder / LEARNING, "wb") as file:
            figure.savefig(file, format="png")
    return folder / LEARNING


def learning_figure(folder: Path) -> Any:
    """J over the actions, with and without the noise of exploration, and lines for the references."""
    from matplotlib.ticker import FuncFormatter

    from ..evaluation.reporting.figures import CAR, line_styles, new_figure
    from ..train.logs import read_log

    curve = read_curve(folder, _J)
    known = {name for row in read_log(folder) for name in row}
    figure = new_figure(6.4, 3.4)
    axes = figure.subplots()
    axes.set_yscale("log")
    ends: dict[str, tuple[Curve, dict[str, Any]]] = {"agent": (curve, {"color": CAR, "linewidth": 1.8})}
    beside = [column for column in _BESIDE if column in known]
    styles = line_styles([_BESIDE[column] for column in beside] + [_NOISY])
    if "validation/noisy_J" in known:
        ends[_NOISY] = (read_curve(folder, "validation/noisy_J"), {**styles[_NOISY], "linewidth": 0.9})
    for column in beside:
        level = read_curve(folder, column)[1, 0]
        level_line = np.array([curve[0, [0, -1]], [level, level]])
        ends[_BESIDE[column]] = (level_line, {**styles[_BESIDE[column]], "linewidth": 0.9})
    for (steps, values), style in ends.values():
        axes.plot(steps / _MILLION, values, **style)
    axes.margins(x=0.0)
    _label_ends(axes, {name: (line[1, -1], style["color"]) for name, (line, style) in ends.items()})
    axes.set_xlabel("actions, million")
    axes.set_ylabel("J on the validation drives")
    for axis_formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        axis_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_title(folder.resolve().name, pad=10.0)
    return figure


def _label_ends(axes: Any, ends: Mapping[str, tuple[float, Any]]) -> None:
    """Names beside the right ends of lines, moved apart where they would overlap."""
    low, high = np.log(axes.get_ylim())
    ordered = sorted(ends, key=lambda name: ends[name][0])
    places = [(math.log(max(ends[name][0], _LEAST)) - low) / (high - low) for name in ordered]
    for i in range(1, len(places)):
        places[i] = max(places[i], places[i - 1] + _LINE)
    # What was pushed beyond the top goes back down with all below it.
    places[-1] = min(places[-1], 1.0)
    for i in range(len(places) - 2, -1, -1):
        places[i] = min(places[i], places[i + 1] - _LINE)
    for name, place in zip(ordered, places, strict=True):
        value, color = ends[name]
        text = f"{name} {value:.3g}"
        axes.annotate(text, (1.01, place), xycoords="axes fraction", va="center", color=color)


def read_curve(folder: Path, scalar: str) -> Curve:
    """Steps and values of a scalar in the log of a training."""
    from ..train.logs import STEPS, read_log

    rows = read_log(folder)
    if not rows:
        raise DataError(f"{folder}: no log of a training there")
    names = {name: name for row in rows for name in row}
    look_up("scalar", scalar, names)
    return np.array([(row[STEPS], row[scalar]) for row in rows if scalar in row]).T


def grouped(curves: Mapping[Path, Curve]) -> dict[str, list[Curve]]:
    """Curves by the name of their training, the number of the seed taken off."""
    groups: dict[str, list[Curve]] = {}
    for path, curve in curves.items():
        groups.setdefault(re.sub(r"-\d+$", "", path.resolve().name), []).append(curve)
    return groups


def draw(groups: Mapping[str, list[Curve]], scalar: str) -> Any:
    """A figure with a line and a band for each group."""
    from ..evaluation.reporting.figures import line_styles, new_figure

    figure = new_figure(6.4, 3.4)
    axes = figure.subplots()
    styles = line_styles(list(groups))
    for name, seeds in groups.items():
        style = styles[name]
        steps = seeds[0][0]
        values = np.array([np.interp(steps, *curve) for curve in seeds])
        label = f"{name} ({len(seeds)} seeds)" if len(seeds) > 1 else name
        axes.plot(steps / _MILLION, values.mean(axis=0), label=label, **style)
        low, high = values.min(axis=0), values.max(axis=0)
        axes.fill_between(steps / _MILLION, low, high, color=style["color"], alpha=0.2, linewidth=0)
    axes.set_yscale("log")
    axes.set_xlabel("actions, million")
    axes.set_ylabel(scalar)
    if len(groups) > _INSIDE:
        figure.legend(loc="outside right upper")
    else:
        axes.legend()
    return figure
