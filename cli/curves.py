"""``motion-cueing curves``: what trainings came to over their steps, with the spread over seeds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError, DataError, look_up
from ..envs.storage import check_file, replacing
from .arguments import option, several

Curve = NDArray[np.float64]
"""(2, k) steps and values."""

_SUFFIXES: Final = (".png", ".svg")
_INSIDE: Final = 4
"""Groups whose legend has room among the curves."""

_MILLION: Final = 1e6


@dataclass(frozen=True, kw_only=True)
class CurvesCommand:
    """Draw a scalar of the log of one or more trainings.

    Folders whose names differ in a number at the end alone, as run-0 and run-1, are seeds of one training: a
    line for their mean, and a band from the lowest to the highest.
    """

    runs: Annotated[tuple[Path, ...], several("DIR ...")] = field(kw_only=False)
    """Folders that `motion-cueing train` made."""
    out: Annotated[Path, option("FILE.png|FILE.svg")]
    """Picture to write."""
    scalar: str = "validation/J"
    """Column of log.csv."""


def run(command: CurvesCommand) -> int:
    """Draw, and print where each training ended."""
    from ..evaluation.reporting.figures import styled

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
