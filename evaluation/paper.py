"""The paper's six cases, its Figures 5 to 9, and its statements with a pass or a fail each."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Final

from jinja2 import Environment, StrictUndefined
from rich.console import Console
from rich.table import Table

from ..baselines import make_policy
from ..envs.car import get_car, get_maneuver
from ..envs.platform import get_platform
from ..envs.settings import to_dict
from ..envs.storage import write_bytes, write_text
from .paper_checks import Check, Drives, all_checks
from .paper_figures import paper_figures
from .provenance import versions
from .rollout import rollout
from .text_table import number
from .trajectory import Trajectory

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
