"""Conditions of the road: the drive stays, what is known of it does not."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.car import get_car
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.road import NO_STOP
from motion_cueing.evaluation.studies.roads import ANNOUNCED, MapFaults, road_conditions


def conditions(name, **faults):
    """The drive of each condition."""
    drive = get_maneuver(name).drive()
    found = road_conditions(
        get_platform("paper"), get_car("sedan"), {name: lambda: drive}, MapFaults(**faults)
    )
    return drive, {one.name: one.maneuvers[name]() for one in found}


def here(drive, distance=0.0):
    """Curvature of the road at a distance ahead, at each sample."""
    return drive.road.ahead(np.full((len(drive), 1), distance)).curvature[:, 0]


def test_the_drive_is_the_same_and_the_road_is_not():
    drive, found = conditions("slalom", shift=8.0)
    assert {one.digest() for one in found.values()} == {drive.digest()}
    np.testing.assert_array_equal(here(found[ANNOUNCED]), here(drive))
    assert not here(found["unannounced"]).any()
    np.testing.assert_allclose(here(found["curvature x0.8"]), 0.8 * here(drive))
    np.testing.assert_allclose(here(found["8 m late"], 8.0), here(drive), atol=1e-9)
    np.testing.assert_allclose(here(found["8 m early"]), here(drive, 8.0), atol=1e-9)
    assert not found["no map"].road.known.any()


def test_gaps_and_stops():
    drive, found = conditions("stop-and-go", gap=5.0)
    gone = ~found["gaps"].road.known
    # The last 5 of every 15 s.
    np.testing.assert_array_equal(gone, drive.time % 15.0 >= 10.0)
    assert drive.road.stop_distance.min() == 0.0
    assert (found["unannounced"].road.stop_distance == NO_STOP).all()
