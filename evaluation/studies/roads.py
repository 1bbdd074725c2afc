"""Wrong maps and unannounced events: policies that see the road ahead, when what they see is not so.

The road of each drive is known as it is (announced), without what only the scenario knows, with errors of the
map, with gaps, and not at all. The drives themselves are the same, so a policy that does not see the road
must come to the same figures under every condition.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from ...baselines.policy import Policy
from ...envs.car import Car
from ...envs.cues import CueTrace
from ...envs.platform import Platform
from ...envs.road import RoadMap
from ...envs.settings import NonNegative, Positive, configuration
from ..metrics import Metrics
from ..policies import make_policy
from ..reporting.text import TextTable, number
from ..suite import CueSource
from .study import Condition

ANNOUNCED: Final = "announced"
"""Name of the first condition."""

ROAD_VERSION: Final = 1
"""Of what is known of the roads: drives of another one are driven again."""

Change = Callable[[RoadMap, CueTrace], RoadMap]
"""A road as it is known, of the true one and its drive."""


@configuration
class MapFaults:
    """Sizes of the errors, each tried alone.

    Args:
        low: Smaller factor on curvature.
        high: Larger factor on curvature.
        shift: Error of the place along the way, m, in either sense.
        gap: Length of a gap, s.
        every: From the begin of one gap to that of the next, s.
    """

    low: Positive = 0.8
    high: Positive = 1.2
    shift: NonNegative = 10.0
    gap: Positive = 5.0
    every: Positive = 15.0


def road_conditions(
    platform: Platform, car: Car, maneuvers: Mapping[str, CueSource], faults: MapFaults | None = None
) -> list[Condition]:
    """The announced road, then one condition for each error of what is known.

    Args:
        platform: The machine.
        car: Of the maneuvers.
        maneuvers: Sources of cues by name.
        faults: Sizes of the errors.
    """
    sizes = faults or MapFaults()
    shift = sizes.shift
    changes: dict[str, tuple[str, Change]] = {
        ANNOUNCED: ("the road as it is, with cones and stops", lambda road, drive: road),
        "unannounced": ("no cones and no stops are known", lambda road, drive: road.unannounced()),
        f"curvature x{sizes.low:g}": (
            "the map's bends are too gentle",
            lambda road, drive: road.wrong(scale=sizes.low),
        ),
        f"curvature x{sizes.high:g}": (
            "the map's bends are too sharp",
            lambda road, drive: road.wrong(scale=sizes.high),
        ),
        f"{shift:g} m late": (
            "everything on the map is too far ahead",
            lambda road, drive: road.wrong(shift=shift),
        ),
        f"{shift:g} m early": (
            "everything on the map is too near",
            lambda road, drive: road.wrong(shift=-shift),
        ),
        "gaps": (
            f"the map is missing for {sizes.gap:g} s in every {sizes.every:g} s",
            lambda road, drive: road.missing(drive.time % sizes.every >= sizes.every - sizes.gap),
        ),
        "no map": (
            "the map is never there",
            lambda road, drive: road.missing(np.ones(len(drive), dtype=bool)),
        ),
    }
    return [
        Condition(
            name,
            about,
            platform,
            car,
            {label: partial(_changed, source, change) for label, source in maneuvers.items()},
            partial(_made, platform),
            {"road": {"version": ROAD_VERSION, "condition": name, "gap": sizes.gap, "every": sizes.every}},
        )
        for name, (about, change) in changes.items()
    ]


def _made(platform: Platform, given: Any) -> Policy:
    return make_policy(given, platform, force=True)


def _changed(source: CueSource, change: Change) -> CueTrace:
    drive = source()
    return drive if drive.road is None else replace(drive, road=change(drive.road, drive))


_SHARES: Final = (0.5, 0.9, 1.0)
"""Quantiles of the worst second that are shown."""


def worst_seconds_table(metrics: Mapping[str, Mapping[str, Mapping[str, Metrics]]]) -> TextTable:
    """The distribution over the drives of the worst second of J, for each condition and policy.

    Args:
        metrics: By condition, policy and drive.
    """
    rows = [
        (condition, policy, *_distribution(drives))
        for condition, policies in metrics.items()
        for policy, drives in policies.items()
        if drives
    ]
    header = ("condition", "policy", "median", "90 %", "largest", "in")
    return TextTable("Worst second of J over the drives", header, tuple(rows))


def _distribution(drives: Mapping[str, Metrics]) -> tuple[str, ...]:
    worst = {name: float(one.worst_second or 0.0) for name, one in drives.items()}
    values = (number(float(np.quantile(list(worst.values()), share))) for share in _SHARES)
    return (*values, max(worst, key=lambda name: worst[name]))
