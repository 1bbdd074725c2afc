"""Tuning by hand: a washout's parameters as sliders, and the drive replayed at each change."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from ....baselines.tuning.effects import EFFECTS, axis_of, kind_of, unit_of
from ....baselines.tuning.objective import WashoutSpace
from ....baselines.washout.policy import WashoutPolicy
from ....envs.cues import CueTrace
from ....envs.errors import ConfigurationError
from ....envs.platform import Platform
from ...metrics import measure
from ...rollout import rollout
from ...trajectory import Trajectory
from ..html import assets, script_json, template
from ..packing import MISSING
from .motion import pack_view
from .page import LIBRARIES, STYLES, deflated
from .scene import scene_of

NOW: Final = "as set"
START: Final = "at the start"


class HandTuning:
    """A washout that is tuned by hand.

    Args:
        start: The set to begin with.
        drives: To replay; at least one.
        platform: The machine.
    """

    def __init__(self, start: Any, drives: Sequence[CueTrace], platform: Platform) -> None:
        self.space, self.platform = WashoutSpace(start, platform), platform
        self._drives = {drive.name: drive for drive in drives}
        self._starts: dict[str, tuple[Trajectory, dict[str, float | None]]] = {}
        self._one_at_a_time = threading.Lock()

    def parameters(self, places: Mapping[str, Any]) -> Any:
        """The set at places in [0, 1] by path; the start's where a path is missing.

        Raises:
            ConfigurationError: a path is unknown, or a place is no finite number.
        """
        paths = [coordinate.path for coordinate in self.space.coordinates]
        for path, place in places.items():
            if path not in paths or isinstance(place, bool) or not isinstance(place, int | float):
                raise ConfigurationError(f"{path}: no parameter of {self.space.start.name} with a number")
        start = self.space.encode(self.space.start)
        at = [float(places.get(path, place)) for path, place in zip(paths, start, strict=True)]
        return self.space.result(np.array(at), "by-hand", f"{self.space.start.name}, tuned by hand")

    def replay(self, request: Any) -> dict[str, Any]:
        """Drive with a set, as a page requests it: ``{"drive": name, "places": {path: place}}``.

        Returns:
            The drive packed, its figures, and the seconds that it took.
        """
        if not isinstance(request, dict) or request.get("drive") not in self._drives:
            raise ConfigurationError(f"drive must be one of {', '.join(self._drives)}")
        began = time.perf_counter()
        with self._one_at_a_time:
            cues = self._drives[request["drive"]]
            driven = self._driven(self.parameters(request.get("places", {})), cues)
            if cues.name not in self._starts:
                first = self._driven(self.space.start, cues)
                self._starts[cues.name] = first, figures(first)
            start, before = self._starts[cues.name]
            packed = pack_view({START: start, NOW: driven}, cues)
        return {
            "drive": packed.content,
            "figures": {START: before, NOW: figures(driven)},
            "seconds": time.perf_counter() - began,
        }

    def _driven(self, parameters: Any, cues: CueTrace) -> Trajectory:
        policy = WashoutPolicy(parameters, self.platform.cab)
        return replace(rollout(policy, cues, platform=self.platform), maneuver=cues.name)

    def render(self, out: str) -> str:
        """The page.

        Args:
            out: File that its button writes.
        """
        start = self.space.encode(self.space.start)
        about = {
            "missing": MISSING,
            "drives": list(self._drives),
            "sliders": [
                {
                    "path": coordinate.path,
                    "kind": kind_of(coordinate.path),
                    "axis": axis_of(coordinate.path),
                    "unit": unit_of(kind_of(coordinate.path)),
                    "effect": EFFECTS.get(kind_of(coordinate.path), ""),
                    "low": coordinate.low,
                    "high": coordinate.high,
                    "log": coordinate.log,
                    "place": float(place),
                }
                for coordinate, place in zip(self.space.coordinates, start, strict=True)
            ],
            "styles": {
                START: {"color": "#0072b2", "dash": [7, 3]},
                NOW: {"color": "#d55e00", "dash": []},
            },
            "names": [START, NOW],
            "out": out,
        }
        return template("view/tune.html").render(
            title=f"{self.space.start.name} on the motion base {self.platform.name}, tuned by hand",
            styles=assets(*STYLES),
            scripts=assets(*LIBRARIES, "view/tune.js"),
            about=script_json(about),
            scene=deflated(scene_of(self.platform)),
        )


def figures(drive: Trajectory) -> dict[str, float | None]:
    """J, perceived J, time at a limit, and the share of the travel in use; None where it has no end."""
    metrics = measure(drive)
    ends = np.maximum(np.abs(drive.limits.position_min), np.abs(drive.limits.position_max))
    used = np.abs(drive.positions).max(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(np.isfinite(ends) & (ends > 0.0), used / ends, np.nan)

    def largest(values: Any) -> float | None:
        return float(np.nanmax(values)) if np.isfinite(values).any() else None

    return {
        "J": metrics.cue_error,
        "perceived J": metrics.perceived_cue_error,
        "time at a limit": float((drive.limits_active != 0).any(axis=1).mean()),
        "carriage travel": largest(share[:2]),
        "leg travel": largest(share[2:8]),
        "turntable travel": largest(share[8:]),
    }
