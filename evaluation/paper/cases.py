"""Figures 5 to 9 of the paper: the same axes and curves."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
from jinja2 import Environment, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from ...baselines import make_policy
from ...envs.car import get_car
from ...envs.cues import GRAVITY
from ...envs.maneuvers import get_maneuver
from ...envs.platform import get_platform
from ...envs.provenance import versions
from ...envs.settings import to_dict
from ...envs.storage import write_bytes, write_text
from ..reporting.figures import CAR, new_figure, png, styled
from ..reporting.text import number
from ..rollout import rollout
from ..trajectory import Floats, Trajectory
from .statements import Check, Drives, all_checks, predicted_ripple

_TURNS = ("EST1", "EST2", "EST3")
_ARROW_EVERY = 2.0
"""Seconds between the arrows that show where the cab points."""


def paper_figures(drives: Drives) -> dict[str, bytes]:
    """PNG of each figure by its caption."""
    with styled():
        return {
            "Figure 5: driver's lateral specific force, entry and steady turn": png(_lateral_force(drives)),
            "Figure 6: simulator trajectories for EST1, EST2 and EST3": png(_trajectories(drives)),
            "Figure 7: yaw rate, entry and steady turn": png(_yaw_rate(drives)),
            "Figure 8: driver's longitudinal specific force, braking": png(_braking(drives)),
            "Figure 9: driver's lateral specific force, single lane change": png(_lane_change(drives)),
        }


def _curves(axes: Axes, time: Floats, car: Floats, simulators: dict[str, Floats], unit: str) -> None:
    axes.plot(time, car, color=CAR, linewidth=3.0, alpha=0.45, label="car")
    for name, values in simulators.items():
        axes.plot(time, values, label=name)
    axes.set_xlabel("time, s")
    axes.set_ylabel(unit)
    axes.legend()


def _in_g(axes: Axes) -> None:
    def to_g(force: Any) -> Any:
        return force / GRAVITY

    def from_g(force: Any) -> Any:
        return force * GRAVITY

    axes.secondary_yaxis("right", functions=(to_g, from_g)).set_ylabel("g")


def _lateral_force(drives: Drives) -> Figure:
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    first = drives["EST1"]
    _curves(
        axes,
        first.time,
        first.f_reference[:, 1],
        {n: drives[n].f_simulator[:, 1] for n in _TURNS},
        "$f_y$, m/s²",
    )
    _in_g(axes)
    return figure


def _trajectories(drives: Drives) -> Figure:
    figure = new_figure(9.0, 4.6)
    for axes, name in zip(figure.subplots(1, 3, sharex=True, sharey=True), _TURNS, strict=True):
        t = drives[name]
        axes.plot(t.carriage[:, 1], t.carriage[:, 0])
        every = np.arange(0, len(t.time), round(_ARROW_EVERY / t.dt))
        heading = t.turntable[every] + t.hexapod[every, 5]
        axes.quiver(
            t.carriage[every, 1], t.carriage[every, 0], np.sin(heading), np.cos(heading),
            color=CAR, scale=9.0, width=0.008, zorder=3,
        )  # fmt: skip
        axes.set_title(name)
        axes.set_aspect("equal")
        axes.set_xlabel("carriage y, m")
    figure.axes[0].set_ylabel("carriage x, m")
    figure.suptitle("Arrows: where the cab points, every 2 s", x=0.01, ha="left", fontsize=8.5)
    return figure


def _yaw_rate(drives: Drives) -> Figure:
    figure = new_figure(8.0, 5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.5, 1.0))
    first, second = drives["EST1"], drives["EST2"]
    rates = {name: np.rad2deg(drives[name].w_simulator[:, 2]) for name in _TURNS}
    _curves(upper, first.time, np.rad2deg(first.w_reference[:, 2]), rates, "yaw rate, deg/s")
    upper.set_xlabel("")
    lower.plot(
        second.time,
        np.rad2deg(second.w_simulator[:, 2] - second.w_reference[:, 2]),
        color="C1",
        label="EST2 less car",
    )
    lower.plot(second.time, np.rad2deg(predicted_ripple(second)), color=CAR, linestyle=":", label="Eq. (54)")
    lower.set_ylim(-0.6, 0.6)
    lower.set_xlabel("time, s")
    lower.set_ylabel("false yaw rate, deg/s")
    lower.legend()
    return figure


def _braking(drives: Drives) -> Figure:
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    t = drives["BRK"]
    _curves(axes, t.time, t.f_reference[:, 0], {"BRK": t.f_simulator[:, 0]}, "$f_x$, m/s²")
    _in_g(axes)
    return figure


def _lane_change(drives: Drives) -> Figure:
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    t = drives["LC1"]
    simulators = {name: drives[name].f_simulator[:, 1] for name in ("LC1", "LC2")}
    _curves(axes, t.time, t.f_reference[:, 1], simulators, "$f_y$, m/s²")
    _in_g(axes)
    return figure


# The paper's six cases, its Figures 5 to 9, and its statements with a pass or a fail each.


SCHEMA: Final = 1
"""Version of paper.json."""

CASES: Final = {
    "EST1": ("steady-turn", "est1"),
    "EST2": ("steady-turn", "est2"),
    "EST3": ("steady-turn", "est3"),
    "BRK": ("braking", "brk"),
    "LC1": ("lane-change", "lc1"),
    "LC2": ("lane-change", "lc2"),
}
"""Maneuver and washout preset of each case."""


def drive_cases() -> dict[str, Trajectory]:
    """The six cases on the paper's machine with the paper's car."""
    platform, car = get_platform("paper"), get_car("sedan")
    cues = {name: get_maneuver(name).drive(car) for name in {maneuver for maneuver, _ in CASES.values()}}
    return {
        case: rollout(make_policy(preset, platform), cues[maneuver], platform, car)
        for case, (maneuver, preset) in CASES.items()
    }


def run(out: Path) -> int:
    """Drive the cases, write everything to a folder and print the table; 0 if every check passes, else 1."""
    drives = drive_cases()
    checks = all_checks(drives)
    save(drives, checks, out)
    print_checks(checks)
    return 0 if all(check.passed for check in checks) else 1


def save(drives: Drives, checks: Sequence[Check], out: Path) -> None:
    """Write paper.json, paper.html, the figures and the trajectories."""
    figures = paper_figures(drives)
    for caption, image in figures.items():
        write_bytes(out / f"{_slug(caption.split(':')[0])}.png", image)
    for case, drive in drives.items():
        drive.save(out / "trajectories" / f"{case.lower()}.npz")
    record = {
        "schema": SCHEMA,
        "versions": versions(),
        "checks": [{**to_dict(check), "passed": check.passed} for check in checks],
    }
    write_text(out / "paper.json", json.dumps(record, indent=2) + "\n")
    source = files(__package__).joinpath("paper.html").read_text(encoding="utf-8")
    page = Environment(autoescape=True, undefined=StrictUndefined).from_string(source)
    images = {caption: base64.b64encode(image).decode("ascii") for caption, image in figures.items()}
    write_text(out / "paper.html", page.render(rows=_rows(checks), images=images, versions=versions()))


def print_checks(checks: Sequence[Check]) -> None:
    """The table on the terminal."""
    table = Table(title="The paper's statements, measured", title_justify="left")
    for name in ("case", "quantity", "the paper says", "measured", "passes within", ""):
        table.add_column(name, justify="right" if name == "measured" else "left")
    for row in _rows(checks):
        table.add_row(*row, style=None if row[-1] == "pass" else "bold red")
    passed = sum(check.passed for check in checks)
    console = Console(width=None if Console().is_terminal else 140)
    console.print(table)
    console.print(f"{passed} of {len(checks)} pass", highlight=False)


def _rows(checks: Sequence[Check]) -> list[tuple[str, ...]]:
    return [
        (
            check.case,
            check.quantity,
            check.reported,
            f"{number(check.measured)} {check.unit}".strip(),
            f"{check.low:g} to {check.high:g}",
            "pass" if check.passed else "FAIL",
        )
        for check in checks
    ]


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
