"""Splits: their hashes, their fingerprints, and seeds that nothing else draws."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import UnknownNameError
from motion_cueing.envs.maneuvers import drive_seeds, recording_names
from motion_cueing.envs.maneuvers.sampling import HELD_OUT_SEEDS, RandomDrives, load_drives
from motion_cueing.evaluation.benchmark.splits import (
    HELD_OUT_DRIVES,
    SPLITS,
    STANDARD,
    fingerprint,
    get_split,
    held_out_split,
    recorded_split,
    same_drive,
    standard_split,
)

from ...baselines.drives import trace, weave
from ...repository import ROOT


def test_there_are_three_splits():
    assert list(SPLITS) == ["standard", "recorded", "held-out"]
    with pytest.raises(UnknownNameError, match="held-out"):
        get_split("heldout")


def test_no_seed_of_the_split_can_be_drawn():
    """``drive_seeds`` is the one source of seeds of training and tuning: 32 bits, whatever its own seed."""
    for seed in (0, 7, 2**31, 2**32, 2**40):
        drawn = drive_seeds(4096, seed)
        assert max(drawn) < HELD_OUT_SEEDS
        assert min(drawn) >= 0
    definition = SPLITS["held-out"]().definition
    assert definition["first_seed"] >= 2**32
    assert definition["count"] == HELD_OUT_DRIVES == 200


def test_the_recorded_split_is_every_recording():
    split = recorded_split()
    assert sorted(split.cues) == recording_names()
    assert split.version == len(recording_names())


def test_the_standard_split_holds_the_standard_maneuvers_alone(monkeypatch):
    from motion_cueing.envs.maneuvers import registry

    monkeypatch.setattr(registry._MANEUVERS, "_entries", dict(registry._MANEUVERS._entries))
    registry.register("mine-alone", lambda: None, "of another package")
    assert set(standard_split().definition["maneuvers"]) == set(STANDARD)


HASHES = """
from motion_cueing.evaluation.benchmark.splits import SPLITS
print(*(make().hash for make in SPLITS.values()))
"""


def test_a_hash_is_the_same_in_every_run():
    printed = subprocess.run(
        [sys.executable, "-c", HASHES], capture_output=True, text=True, check=True
    ).stdout
    assert printed.split() == [make().hash for make in SPLITS.values()]


def test_a_hash_changes_with_the_drives():
    few = held_out_split(2, 3.0)
    assert few.hash == held_out_split(2, 3.0).hash
    others = [held_out_split(3, 3.0), held_out_split(2, 3.5), replace(few, version=2), replace(few, name="x")]
    assert len({few.hash, *(one.hash for one in others)}) == 5
    standard = standard_split()
    maneuvers = {**standard.definition["maneuvers"]}
    maneuvers["hill"] = {**maneuvers["hill"], "settle": 2.5}
    changed = replace(standard, definition={**standard.definition, "maneuvers": maneuvers})
    assert changed.hash != standard.hash


def test_the_drives_of_a_split_are_the_same_every_time():
    first, again = held_out_split(2, 3.0), held_out_split(2, 3.0)
    assert [one.digest() for one in first.cues.values()] == [one.digest() for one in again.cues.values()]
    assert len({one.digest() for one in first.cues.values()}) == 2
    assert all(one.duration == pytest.approx(3.0) for one in first.cues.values())
    seeds = [int(name.rpartition("-")[2]) for name in first.cues]
    assert min(seeds) >= HELD_OUT_SEEDS


def test_a_fingerprint_is_the_rms_of_each_axis_and_bears_rounding_alone():
    drive = trace(2.0, weave)
    found = fingerprint(drive)
    assert found[0] == len(drive)
    assert found[1] == pytest.approx(drive.specific_force[:, 0].std())
    assert found[3] == pytest.approx(0.0)
    noise = 1e-6 * np.random.default_rng(0).standard_normal(drive.specific_force.shape)
    rounded = replace(drive, specific_force=drive.specific_force + noise)
    assert same_drive(found, fingerprint(rounded))
    assert not same_drive(found, fingerprint(replace(drive, specific_force=1.01 * drive.specific_force)))
    assert not same_drive(found, fingerprint(trace(1.9, weave)))


def test_the_cars_of_the_split_are_in_no_distribution_that_is_trained_or_tuned_on():
    held_out = set(load_drives("held-out").cars)
    assert len(held_out) >= 3
    assert not held_out & set(RandomDrives().cars)
    assert not held_out & set(load_drives("broad").cars)
    recipes = [*ROOT.glob("train/**/*.yaml"), *ROOT.glob("baselines/**/*.yaml")]
    assert recipes
    named = {path.name: held_out & set(re.findall(r"[\w-]+", path.read_text())) for path in recipes}
    assert not any(named.values()), named
