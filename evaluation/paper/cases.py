"""The paper's six cases on its machine: its Figures 5 to 9, and its statements, measured."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
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
from ...envs.settings import configuration
from ...envs.storage import write_bytes, write_text
from ..reporting.figures import CAR, new_figure, png, styled
from ..reporting.text import number
from ..results import Saved
from ..rollout import rollout
from ..trajectory import Floats, Trajectory
from .statements import CASES, Check, Drives, all_checks, predicted_ripple

_HEADER: Final = ("case", "quantity", "the paper says", "measured", "passes within", "")
_TURNS: Final = ("EST1", "EST2", "EST3")
_ARROW_EVERY: Final = 2.0
"""Seconds between the arrows that show where the cab points."""


@configuration
class PaperResults(Saved):
    """The measured statements: ``paper.json``.

    Args:
        schema: Version of the file.
        versions: Of this package, Python and the libraries that matter.
        checks: The statements.
    """

    what = "the paper's cases"
    version = 1

    schema: int
    versions: dict[str, str]
    checks: tuple[Check, ...]

    @classmethod
    def upgrade(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Whether a statement passes follows from its numbers."""
        checks = [{k: v for k, v in check.items() if k != "passed"} for check in values.get("checks", ())]
        return {**values, "checks": checks}


def run(out: Path) -> int:
    """Drive the cases, write everything to a folder and print the table; 0 if every check passes, else 1."""
    drives = drive_cases()
    results = PaperResults(PaperResults.version, versions(), tuple(all_checks(drives)))
    save(drives, results, out)
    print_checks(results.checks)
    return 0 if all(check.passed for check in results.checks) else 1


def drive_cases() -> dict[str, Trajectory]:
    """The six cases on the paper's machine with the paper's car."""
    platform, car = get_platform("paper"), get_car("sedan")
    cues = {name: get_maneuver(name).drive(car) for name in {maneuver for maneuver, _ in CASES.values()}}
    return {
        case: rollout(make_policy(preset, platform), cues[maneuver], platform, car)
        for case, (maneuver, preset) in CASES.items()
    }


def save(drives: Drives, results: PaperResults, out: Path) -> None:
    """Write paper.json, paper.html, the figures and the trajectories."""
    images = {caption: png(figure) for caption, figure in paper_figures(drives).items()}
    for caption, image in images.items():
        name = caption.split(":")[0].lower().replace(" ", "-")
        write_bytes(out / f"{name}.png", image)
    for case, drive in drives.items():
        drive.save(out / "trajectories" / f"{case.lower()}.npz")
    results.save_json(out / "paper.json")
    source = files(__package__).joinpath("paper.html").read_text(encoding="utf-8")
    page = Environment(autoescape=True, undefined=StrictUndefined).from_string(source)
    embedded = {caption: base64.b64encode(image).decode("ascii") for caption, image in images.items()}
    rows = _rows(results.checks)
    text = page.render(header=_HEADER, rows=rows, images=embedded, versions=results.versions)
    write_text(out / "paper.html", text)


def print_checks(checks: Sequence[Check]) -> None:
    """The table on the terminal."""
    table = Table(title="The paper's statements, measured", title_justify="left")
    for name in _HEADER:
        table.add_column(name, justify="right" if name == "measured" else "left")
    for row in _rows(checks):
        table.add_row(*row, style="bold red" if row[-1] == "FAIL" else None)
    statements = [check for check in checks if not check.set_up]
    passed = sum(check.passed for check in statements)
    console = Console(width=None if Console().is_terminal else 140)
    console.print(table)
    console.print(
        f"{passed} of {len(statements)} statements pass; "
        f"{len(checks) - len(statements)} more numbers are set-up",
        highlight=False,
    )


def _rows(checks: Sequence[Check]) -> list[tuple[str, ...]]:
    return [
        (
            check.case,
            check.quantity,
            check.reported,
            f"{number(check.measured)} {check.unit}".strip(),
            f"{check.low:g} to {check.high:g}",
            "FAIL" if not check.passed else "set-up" if check.set_up else "pass",
        )
        for check in checks
    ]


def paper_figures(drives: Drives) -> Mapping[str, Figure]:
    """Each figure by its caption."""
    with styled():
        return {
            "Figure 5: driver's lateral specific force, entry and steady turn": _force(drives, 1, *_TURNS),
            "Figure 6: simulator trajectories for EST1, EST2 and EST3": _trajectories(drives),
            "Figure 7: yaw rate, entry and steady turn": _yaw_rate(drives),
            "Figure 8: driver's longitudinal specific force, braking": _force(drives, 0, "BRK"),
            "Figure 9: driver's lateral specific force, single lane change": _force(drives, 1, "LC1", "LC2"),
        }


def _curves(axes: Axes, time: Floats, car: Floats, simulators: dict[str, Floats], unit: str) -> None:
    axes.plot(time, car, color=CAR, linewidth=3.0, alpha=0.45, label="car")
    for name, values in simulators.items():
        axes.plot(time, values, label=name)
    axes.set_xlabel("time, s")
    axes.set_ylabel(unit)
    axes.legend()


def _force(drives: Drives, axis: int, *cases: str) -> Figure:
    """The specific force of a car and of its cases on one axis, in m/s^2 and g."""
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    first = drives[cases[0]]
    simulated = {case: drives[case].f_simulator[:, axis] for case in cases}
    _curves(axes, first.time, first.f_reference[:, axis], simulated, f"$f_{'xy'[axis]}$, m/s²")

    def to_g(force: Any) -> Any:
        return force / GRAVITY

    def from_g(force: Any) -> Any:
        return force * GRAVITY

    axes.secondary_yaxis("right", functions=(to_g, from_g)).set_ylabel("g")
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
