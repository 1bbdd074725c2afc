"""A training that goes on, as a page: its log as plots, and its best agent on one drive."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....envs.cues import CueTrace
from ....envs.platform import Platform
from ...rollout import rollout
from ...trajectory import Trajectory
from ..html import assets, script_json, template
from ..packing import MISSING
from ..signals import COLORS, DASHES
from .motion import pack_view
from .page import LIBRARIES, STYLES, deflated
from .scene import scene_of

AGENT: Final = "best agent so far"
REFERENCE: Final = "classical"
_MILLION: Final = 1e6
_STEPS: Final = "steps"
_TERMS: Final = "terms/"
_NOISES: Final = ("train/sigma", "train/noise", "train/std", "train/exploration", "train/entropy")

Rows = Sequence[Mapping[str, float]]
"""Of the log of a training."""


@dataclass(frozen=True)
class Plot:
    """A plot over the steps of a training.

    Args:
        title: Above it.
        log: Whether its axis is logarithmic.
        columns: Label by column of the log; those that are missing are left out.
    """

    title: str
    log: bool
    columns: Mapping[str, str]


def plots_of(rows: Rows) -> list[Plot]:
    """The plots that a log has something for."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    terms = [name for name in names if name.startswith(_TERMS)]
    if not terms:
        terms = [f"validation/{name}" for name in _VALIDATED if f"validation/{name}" in names]
    plots = [
        Plot(
            "J on the validation drives",
            True,
            {
                "validation/J": "agent",
                "validation/noisy_J": "agent, exploring",
                "classical/J": "classical washout",
                "no-motion/J": "no motion",
            },
        ),
        Plot("Terms of the reward", False, {name: _words(name) for name in terms}),
        Plot("Noise", False, {name: _words(name) for name in names if name.startswith(_NOISES)}),
        Plot(
            "Travel in use",
            False,
            {"validation/carriage_travel": "carriage", "validation/leg_travel": "legs"},
        ),
        Plot("Reward while it plays", False, {"rollout/reward": "reward"}),
    ]
    return [plot for plot in plots if set(plot.columns) & set(names)]


_VALIDATED: Final = (
    "cue_error",
    "perceived_error",
    "false_cues",
    "tilt_rate",
    "stroke",
    "limits",
    "action_rate",
    "failure",
)


def _words(name: str) -> str:
    return name.partition("/")[2].replace("_", " ")


def lines_of(plot: Plot, rows: Rows) -> list[dict[str, Any]]:
    """The lines of a plot, as JSON; a line of one value is drawn over all steps."""
    lines: list[dict[str, Any]] = []
    last = max(row[_STEPS] for row in rows) / _MILLION
    for column, label in plot.columns.items():
        known = [
            (row[_STEPS] / _MILLION, row[column]) for row in rows if math.isfinite(row.get(column, math.nan))
        ]
        if plot.log:
            known = [(step, value) for step, value in known if value > 0.0]
        if not known:
            continue
        if len(known) == 1:
            known = [known[0], (max(last, known[0][0] + 1e-3), known[0][1])]
        k = len(lines)
        lines.append(
            {
                "label": label,
                "color": COLORS[k % len(COLORS)],
                "dash": DASHES[k // len(COLORS) % len(DASHES)],
                "time": [step for step, _ in known],
                "values": [value for _, value in known],
            }
        )
    return lines


class TrainingPage:
    """The page of a training's folder.

    Args:
        folder: The folder.
        read: Reads its log.
        agent: The agent's file.
        drive: Drives with a policy: the agent's file, or the name of the reference.
        cues: Of the film.
        platform: The machine of the film.
    """

    def __init__(
        self,
        folder: Path,
        read: Callable[[], Rows],
        agent: Path,
        drive: Callable[[str], Trajectory],
        cues: CueTrace,
        platform: Platform,
    ) -> None:
        self._folder, self._read, self._agent, self._drive = folder, read, agent, drive
        self._cues, self._platform = cues, platform
        self._one_at_a_time = threading.Lock()
        self._film: tuple[int, dict[str, Any]] = (0, {})
        self._reference: Trajectory | None = None

    def log(self, _: Any) -> dict[str, Any]:
        """The plots, and the version of the agent's file, which changes with the agent."""
        rows = self._read()
        plots = [
            {"title": plot.title, "log": plot.log, "lines": lines} for plot in plots_of(rows)
            if (lines := lines_of(plot, rows))
        ]  # fmt: skip
        steps = max((row[_STEPS] for row in rows), default=0.0)
        return {"plots": plots, "steps": steps, "agent": self._version()}

    def film(self, _: Any) -> dict[str, Any]:
        """The drive of the best agent so far beside the reference, packed; driven once for each agent."""
        with self._one_at_a_time:
            version = self._version()
            if version and version != self._film[0]:
                if self._reference is None:
                    self._reference = self._named(REFERENCE, REFERENCE)
                drives = {REFERENCE: self._reference, AGENT: self._named(str(self._agent), AGENT)}
                self._film = version, pack_view(drives, self._cues).content
            return {"agent": self._film[0], "drive": self._film[1] or None}

    def _named(self, policy: str, label: str) -> Trajectory:
        return replace(self._drive(policy), policy=label, maneuver=self._cues.name)

    def _version(self) -> int:
        return self._agent.stat().st_mtime_ns // 1_000_000 if self._agent.exists() else 0

    def render(self) -> str:
        """The page; it asks for the log every other second."""
        about = {
            "missing": MISSING,
            "names": [REFERENCE, AGENT],
            "styles": {
                REFERENCE: {"color": COLORS[0], "dash": [7, 3]},
                AGENT: {"color": COLORS[1], "dash": []},
            },
        }
        return template("view/training.html").render(
            title=f"Training {self._folder.resolve().name}",
            drive=self._cues.name,
            machine=self._platform.name,
            styles=assets(*STYLES),
            scripts=assets(*LIBRARIES, "view/training.js"),
            about=script_json(about),
            scene=deflated(scene_of(self._platform)),
        )


def drive_with(
    make: Callable[[str, Platform], Any], cues: CueTrace, platform: Platform
) -> Callable[[str], Trajectory]:
    """Drives the cues of a film with a policy by name or file."""
    return lambda name: rollout(make(name, platform), cues, platform=platform)
