"""Packets by kind: used, malformed, not finite, implausible, repeated, late, stale, foreign; and lost."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.realtime.inbox import KINDS, CueBounds, Inbox, SequenceWindow
from motion_cueing.realtime.packets import Cues, FloatsFormat

FORM = FloatsFormat()
ONE, OTHER = ("127.0.0.1", 1), ("127.0.0.1", 2)
STALE, GAP = 0.05, 0.03


def packet(sequence, time=0.0, force=(0.0, 0.0, -9.81), rate=(0.0, 0.0, 0.0)):
    return FORM.pack_cues(Cues(sequence, time, force, rate))


@pytest.fixture
def inbox():
    return Inbox(FORM, STALE, GAP)


def test_each_kind_is_counted(inbox):
    now = 100.0
    assert inbox.age(now) == math.inf
    assert inbox.take(packet(0), ONE, now) == "used"
    assert inbox.take(packet(1)[:-1], ONE, now) == "malformed"
    assert inbox.take(packet(1, force=(math.nan, 0.0, 0.0)), ONE, now) == "not_finite"
    assert inbox.take(packet(1, time=math.inf), ONE, now) == "not_finite"
    assert inbox.take(packet(1, force=(0.0, 31.0, -9.81)), ONE, now) == "implausible"
    assert inbox.take(packet(1, rate=(0.0, 0.0, -5.1)), ONE, now) == "implausible"
    assert inbox.take(packet(10_001), ONE, now) == "implausible"
    assert inbox.take(packet(0), ONE, now) == "repeated"
    assert inbox.take(packet(3), OTHER, now) == "foreign"
    assert inbox.take(packet(3, time=0.01), ONE, now + 0.01) == "used"
    assert inbox.lost == 2
    assert inbox.take(packet(2), ONE, now) == "late"
    assert inbox.lost == 1
    assert inbox.take(packet(4, time=0.02), ONE, now + 0.02 + 1.01 * STALE) == "stale"
    assert inbox.newest.sequence == 3
    assert inbox.age(now + 0.02) == pytest.approx(0.01)
    assert inbox.counts == {
        "used": 2, "malformed": 1, "not_finite": 2, "implausible": 3, "repeated": 1, "late": 1, "stale": 1,
        "foreign": 1, "paused": 0,
    }  # fmt: skip
    assert set(inbox.counts) == set(KINDS)


def test_cues_beyond_chosen_bounds_are_not_used():
    inbox = Inbox(FORM, STALE, GAP, bounds=CueBounds(force=20.0, vertical=6.0, rate=2.0))
    assert inbox.take(packet(0, force=(20.0, 0.0, -15.8), rate=(0.0, 2.0, 0.0)), ONE, 0.0) == "used"
    assert inbox.take(packet(1, force=(0.0, -20.1, -9.81)), ONE, 0.0) == "implausible"
    assert inbox.take(packet(1, rate=(0.0, 0.0, 2.1)), ONE, 0.0) == "implausible"
    for vertical in (-15.9, -3.7, 0.0, 9.81):
        assert inbox.take(packet(1, force=(0.0, 0.0, vertical)), ONE, 0.0) == "implausible"
    assert inbox.newest.sequence == 0
    with pytest.raises(ConfigurationError, match="force"):
        CueBounds(force=0.0)


def test_a_pause_keeps_the_sender_and_the_cues(inbox):
    inbox.take(packet(0), ONE, 0.0)
    for k in range(1, 101):
        pause = Cues(k, 0.01 * k, (math.nan, 0.0, 1e9), (0.0, 0.0, 0.0), paused=True)
        assert inbox.take(FORM.pack_cues(pause), ONE, 0.01 * k) == "paused"
    assert inbox.paused
    assert inbox.newest.sequence == 0
    assert inbox.age(1.0) == 0.0
    assert inbox.take(packet(101), OTHER, 1.01) == "foreign"
    assert inbox.take(packet(101, time=1.01), ONE, 1.01) == "used"
    assert not inbox.paused
    assert inbox.lost == 0


def test_cues_are_steady_from_the_last_gap_on(inbox):
    for k, now in enumerate([0.0, 0.01, 0.02, 0.2, 0.21]):
        inbox.take(packet(k, time=now), ONE, now)
    assert inbox.steady == pytest.approx(0.01)


def test_clocks_may_drift_but_delays_do_not_pass(inbox):
    # The sender's clock loses 0.5 ms a second, and is 1000 s off; an hour makes 1.8 s of it.
    for k in range(3600):
        now = float(k)
        assert inbox.take(packet(k, time=1000.0 + now * (1.0 - 5e-4)), ONE, now) == "used"
    assert inbox.take(packet(3600, time=1000.0 + 3600.0 * (1.0 - 5e-4) - 0.06), ONE, 3600.0) == "stale"


def test_delays_that_last_are_told_for_as_long_as_they_last(inbox):
    assert inbox.take(packet(0, time=0.0), ONE, 0.0) == "used"
    for k in range(1, 300):
        assert inbox.take(packet(k, time=1e-3 * k), ONE, 1e-3 * k + 0.06) == "stale"


def test_after_silence_anyone_may_begin_with_any_number(inbox):
    inbox.take(packet(1000), ONE, 0.0)
    assert inbox.take(packet(0), OTHER, 1.0) == "foreign"
    inbox.reset()
    assert inbox.take(packet(0, time=-50.0), OTHER, 1.0) == "used"
    assert inbox.sender == OTHER
    assert inbox.take(packet(1001), ONE, 1.0) == "foreign"


@pytest.mark.parametrize(
    ("peer", "heard"), [(ONE, [ONE]), (("127.0.0.1", 0), [ONE, OTHER]), (("10.0.0.1", 1), [])]
)
def test_a_named_peer_is_heard_alone(peer, heard):
    for sender in (ONE, OTHER):
        inbox = Inbox(FORM, STALE, GAP, peer)
        assert (inbox.take(packet(0), sender, 0.0) == "used") == (sender in heard)


@given(st.permutations(range(12)), st.lists(st.integers(0, 11), max_size=12), st.integers(0, 2**64 - 13))
def test_the_window_tells_first_from_second_times(order, again, base):
    window, seen = SequenceWindow(jump=100), set()
    for number in [*order, *again]:
        kind = window.put(base + number)
        assert (kind == "repeated") == (number in seen)
        if number not in seen:
            assert (kind == "used") == all(number > other for other in seen)
        seen.add(number)
        assert window.lost == len(set(range(order[0], max(seen))) - seen)


def test_what_lies_far_behind_is_late_however_often():
    window = SequenceWindow(jump=1000)
    assert [window.put(n) for n in (0, 500, 0, 436, 437, 437)] == [
        "used", "used", "late", "late", "late", "repeated",
    ]  # fmt: skip
    assert window.put(1501) == "implausible"
    assert window.lost == 498
