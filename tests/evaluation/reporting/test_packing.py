"""Packed drives are the drives, to less than a pixel. The tests have a reader of their own."""

from __future__ import annotations

import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.reporting import packing
from motion_cueing.evaluation.reporting.packing import MISSING, PackedDrive, pack, thinned
from motion_cueing.evaluation.reporting.signals import PANELS

from ..synthetic import drive, trajectory


def arrays(packed: PackedDrive) -> list[np.ndarray]:
    """The arrays of a packed drive, by the description of the format."""
    raw, found = np.frombuffer(zlib.decompress(packed.data), np.uint8).astype(np.int64), []
    for about in packed.about["arrays"]:
        n, planes = about["n"], about["planes"]
        part, raw = raw[: n * planes].reshape(planes, n), raw[n * planes :]
        folded = sum(part[p] * 256**p for p in range(planes))
        differences = np.where(folded % 2, -(folded + 1) // 2, folded // 2)
        whole = np.cumsum(np.cumsum(differences))
        values = np.where(about.get("missing", False) & (whole == MISSING), np.nan, whole * about["step"])
        found.append(2.0**values if about.get("log") else values)
    assert len(raw) == 0
    return found


def test_what_is_unpacked_is_what_was_packed():
    drives = {"a": drive(0.8), "b": drive(0.3)}
    packed = pack(drives)
    found = arrays(packed)
    for name, one in drives.items():
        policy = packed.about["policies"][name]
        np.testing.assert_allclose(found[policy["time"]], one.time, atol=1e-5)
        assert policy["error"] == pytest.approx(measure(one).cue_error)
        for panel in PANELS:
            signal = np.atleast_2d(panel.signal(one, Criteria()).T)
            for number, expected in zip(policy["panels"][panel.name], signal, strict=True):
                if panel.logarithmic:
                    np.testing.assert_allclose(found[number], expected, rtol=0.01)
                else:
                    atol = 1e-9 if panel.levels else 0.51e-3 * panel.least
                    np.testing.assert_allclose(found[number], expected, atol=atol)


def test_policies_with_the_same_time_share_it():
    packed = pack({"a": drive(0.8), "b": drive(0.3)})
    times = {policy["time"] for policy in packed.about["policies"].values()}
    assert times == {packed.about["car"]["time"]}


def test_a_step_time_that_was_not_measured_is_left_out():
    assert "step_time" not in pack({"still": trajectory()}).about["policies"]["still"]["panels"]


def test_values_beyond_all_bounds_are_rounded_more_coarsely():
    carriage = np.zeros((201, 2))
    carriage[100:, 0] = 1e9
    packed = pack({"still": trajectory(carriage=carriage)})
    (number,) = packed.about["policies"]["still"]["panels"]["carriage_x"]
    np.testing.assert_allclose(arrays(packed)[number], carriage[:, 0], atol=1e3)


@given(st.integers(9, 60), st.integers(0, 2**32 - 1))
def test_a_thinned_signal_keeps_every_extreme(count, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(packing, "MOST_SAMPLES", 8)
        values = np.random.default_rng(seed).normal(size=count)
        kept = thinned(values)
        assert len(kept) <= 8
        assert {values.min(), values.max()} <= set(kept) <= set(values)
        # In the order of the drive.
        rows = [int(np.flatnonzero(values == one)[0]) for one in kept]
        assert rows == sorted(rows)


def test_a_short_signal_stays_as_it_is():
    values = np.arange(100.0)
    assert thinned(values) is values
