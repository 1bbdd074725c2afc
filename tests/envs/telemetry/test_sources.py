"""Protocols: every field with its unit, axis and sign, and what is none of theirs."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import DataError, UnknownNameError
from motion_cueing.envs.telemetry import (
    SOURCES,
    CueEstimator,
    MotionCheck,
    get_source,
    recognize,
    source_names,
)
from motion_cueing.envs.telemetry.xplane import DATAREFS

from . import games
from .games import PACK, G, Motion, later

NAMES = list(PACK)
DT = 1.0 / 64.0


def cues_of(name, motion, **options):
    """Cues of the second of two datagrams."""
    source, estimator = get_source(name), CueEstimator()
    found = None
    for m in (motion, later(motion, DT)):
        found = estimator(source.parse(PACK[name](m, **options)))
    return found


def expected(motion):
    """The cues at the second of the two; acceleration and rate do not change in between."""
    return np.concatenate([later(motion, DT).force(), motion.rate])


# One cause at a time: the sign of each cue in words.
CAUSES = {
    "stands": (Motion(), (0, 0, -G, 0, 0, 0)),
    "speeds up": (Motion(acceleration=(3.0, 0.0, 0.0)), (3, 0, -G, 0, 0, 0)),
    "pulled to the right": (Motion(acceleration=(0.0, 2.0, 0.0)), (0, 2, -G, 0, 0, 0)),
    "falls": (Motion(acceleration=(0.0, 0.0, 4.0)), (0, 0, 4 - G, 0, 0, 0)),
    "right side down": (Motion(roll=0.2), (0, -G * np.sin(0.2), -G * np.cos(0.2), 0, 0, 0)),
    "nose up": (Motion(pitch=0.2), (G * np.sin(0.2), 0, -G * np.cos(0.2), 0, 0, 0)),
    "rolls to the right": (Motion(rate=(0.4, 0.0, 0.0)), (0, 0, -G, 0.4, 0, 0)),
    "raises its nose": (Motion(rate=(0.0, 0.4, 0.0)), (0, 0, -G, 0, 0.4, 0)),
    "turns to the right": (Motion(rate=(0.0, 0.0, 0.4)), (0, 0, -G, 0, 0, 0.4)),
    "drives east": (Motion(heading=np.pi / 2, velocity=(0.0, 20.0, 0.0)), (0, 0, -G, 0, 0, 0)),
}


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("name", NAMES)
def test_each_cue_has_its_sign_and_unit(name, cause):
    motion, cues = CAUSES[cause]
    # The rates move the attitude by 6 mrad from one datagram to the next, and gravity with it.
    np.testing.assert_allclose(cues_of(name, motion), cues, atol=0.07 if any(motion.rate) else 4e-3)


angle = st.floats(-0.5, 0.5)
triple = st.tuples(*3 * [st.floats(-8.0, 8.0)])
motions = st.builds(
    Motion,
    time=st.floats(1.0, 100.0).map(lambda t: round(1000 * t) / 1000),
    roll=angle,
    pitch=angle,
    heading=st.floats(-3.0, 3.0),
    acceleration=triple,
    rate=st.tuples(*3 * [st.floats(-1.0, 1.0)]),
    velocity=st.tuples(*3 * [st.floats(-40.0, 40.0)]),
    position=st.tuples(*3 * [st.floats(-500.0, 500.0)]),
)


@pytest.mark.parametrize("name", NAMES)
@given(motion=motions)
def test_any_motion_comes_back(name, motion):
    found = cues_of(name, motion)
    # Directions in whole numbers and single floats leave noise in what is the difference of two datagrams.
    np.testing.assert_allclose(found, expected(motion), atol=0.05 if name in ("f1", "dirt") else 3e-3)
    second = later(motion, DT)
    sample = get_source(name).parse(PACK[name](second))
    if name not in ("mcgc", "forza"):
        np.testing.assert_allclose(sample.position, second.position, atol=2e-3)
    if name != "mcgc":
        np.testing.assert_allclose(sample.velocity, second.velocity, atol=2e-3)
        np.testing.assert_allclose(sample.attitude, second.axes(), atol=1e-4)
    assert np.isnan(sample.time) if name == "beamng" else sample.time == pytest.approx(second.time, abs=6e-4)


@pytest.mark.parametrize("name", ["f1", "dirt"])
@pytest.mark.parametrize("right_handed", [True, False])
def test_the_handedness_of_a_world_is_found(name, right_handed):
    motion = Motion(0.5, 0.1, 0.2, 1.1, (1.0, 2.0, 0.5), (0.1, 0.2, 0.3), (10.0, 20.0, 1.0))
    found = cues_of(name, motion, right_handed=right_handed)
    np.testing.assert_allclose(found, expected(motion), atol=0.1)
    sample = get_source(name).parse(PACK[name](motion, right_handed=right_handed))
    # East of north is to the right: the course has the sense of a compass.
    np.testing.assert_allclose(sample.velocity, motion.velocity, atol=1e-5)


@pytest.mark.parametrize("size", [232, 311, 331, 324])
def test_every_size_of_forza_has_the_cues_and_larger_ones_the_position(size):
    motion = Motion(position=(10.0, 20.0, -3.0), acceleration=(1.0, 2.0, 3.0))
    sample = get_source("forza").parse(games.forza(motion, size))
    np.testing.assert_allclose(sample.acceleration, motion.acceleration, atol=1e-6)
    if size > 232:
        np.testing.assert_allclose(sample.position, motion.position, atol=1e-5)
    else:
        assert np.isnan(sample.position).all()


def test_outsim_with_an_identifier():
    motion = Motion(acceleration=(1.0, 2.0, 3.0))
    sample = get_source("outsim").parse(games.outsim(motion, identifier=True))
    np.testing.assert_allclose(sample.acceleration, motion.acceleration, atol=1e-6)


@pytest.mark.parametrize(("name", "pack"), [
    ("forza", games.forza), ("xplane", games.xplane), ("mcgc", games.mcgc), ("f1", games.f1_session),
])  # fmt: skip
def test_flags_of_a_pause(name, pack):
    assert get_source(name).parse(pack(Motion(paused=True))).paused is True
    assert get_source(name).parse(pack(Motion())).paused is False


def test_f1_without_a_car_is_paused_and_other_packets_hold_no_motion():
    source = get_source("f1")
    empty = games.f1_header(Motion(), 0, player=3) + bytes(22 * 60)
    assert source.parse(empty).paused is True
    assert source.parse(games.f1_header(Motion(), 6) + bytes(1323)) is None
    assert source.parse(games.f1_header(Motion(), 0, player=255) + bytes(22 * 60)) is None
    assert source.parse(games.f1_session(Motion(paused=True), 2024)).paused is True


@pytest.mark.parametrize("name", NAMES)
def test_datagrams_cut_off_or_too_long_are_refused(name):
    source, whole = get_source(name), PACK[name](Motion())
    sizes = {layout.size for layout in source.layouts}
    for length in [*range(len(whole)), len(whole) + 1]:
        data = whole[:length] if length < len(whole) else whole + b"\0"
        if length not in sizes - {len(whole)} or name == "f1":
            with pytest.raises(DataError):
                source.parse(data)


@pytest.mark.parametrize("name", NAMES)
@given(noise=st.binary(max_size=400))
def test_noise_is_refused_or_read_but_never_crashes(name, noise):
    source = get_source(name)
    for data in (noise, PACK[name](Motion())[:4] + noise):
        try:
            sample = source.parse(data)
        except DataError:
            continue
        assert sample is None or isinstance(sample.moves, bool)


@pytest.mark.parametrize("name", NAMES)
def test_datagrams_of_another_protocol_are_refused(name):
    for other, pack in PACK.items():
        if other != name:
            with pytest.raises(DataError):
                get_source(name).parse(pack(Motion()))


def test_other_versions_and_damage_are_refused_by_name():
    with pytest.raises(DataError, match="BNG2"):
        get_source("beamng").parse(b"BNG2" + games.beamng(Motion())[4:])
    with pytest.raises(DataError, match="format 2022"):
        get_source("f1").parse(games.f1(Motion(), version=2022))
    damaged = bytearray(games.mcgc(Motion()))
    damaged[30] ^= 1
    with pytest.raises(DataError, match="checksum"):
        get_source("mcgc").parse(bytes(damaged))
    with pytest.raises(DataError, match="datarefs"):
        get_source("xplane").parse(games.xplane(Motion())[:-8])


def test_numbers_that_are_infinite_or_missing_are_seen():
    data = bytearray(games.forza(Motion()))
    struct.pack_into("<f", data, 20, np.inf)
    assert get_source("forza").parse(bytes(data)).broken
    data = bytearray(games.dirt(Motion()))
    struct.pack_into("<f", data, 32, np.nan)
    assert get_source("dirt").parse(bytes(data)).broken
    assert not any(get_source(name).parse(PACK[name](Motion())).broken for name in NAMES)


def test_xplane_is_asked_for_each_dataref():
    requests = get_source("xplane").requests()
    assert [struct.unpack("<4sxii400s", request)[0] for request in requests] == [b"RREF"] * len(DATAREFS)
    names = [struct.unpack("<4sxii400s", request)[3].rstrip(b"\0").decode() for request in requests]
    assert names == list(DATAREFS)
    assert [struct.unpack("<4sxii400s", request)[2] for request in requests] == list(range(len(DATAREFS)))


def test_protocols_are_recognized():
    for name in NAMES:
        assert recognize([PACK[name](Motion(time=k / 50)) for k in range(5)]).name == name
    assert recognize([b"noise"] * 5) is None
    assert recognize([]) is None


def test_names_and_one_more_protocol():
    assert set(source_names()) >= set(NAMES)
    with pytest.raises(UnknownNameError, match="forza"):
        get_source("forsa")
    for name in NAMES:
        source = get_source(name)
        assert source.name == name
        assert source.summary
        assert SOURCES.description(name)
        for layout in source.layouts:
            assert all(meaning for _, _, field, meaning in layout.rows() if not field.startswith("number of"))


def test_the_layouts_rows_name_the_bytes():
    rows = {name: place for place, _, name, _ in get_source("forza").layouts[0].rows()}
    assert (rows["acceleration"], rows["angles"]) == ("20-31", "56-67")
    rows = {name: place for place, _, name, _ in get_source("dirt").layouts[0].rows()}
    assert (rows["right"], rows["forward"], rows["lateral"], rows["longitudinal"]) == (
        "44-55", "56-67", "136-139", "140-143",
    )  # fmt: skip


def driven(seconds=30.0, **wrong):
    """A slalom with brakes as motions; ``wrong`` replaces parts of them."""
    motions = [Motion(time=0.0, velocity=(20.0, 0.0, 0.0))]
    for k in range(int(seconds / DT)):
        t = k * DT
        m = motions[-1]
        speed = float(np.hypot(*m.velocity[:2]))
        turn = 0.3 * np.sin(0.8 * t)
        at = 2.0 * np.cos(0.5 * t)
        motions.append(later(Motion(
            **{**m.__dict__, "acceleration": (at, speed * turn, 0.0), "rate": (0.0, 0.0, turn)}
        ), DT))  # fmt: skip
    return motions


@pytest.mark.parametrize("name", [name for name in NAMES if name != "mcgc"])
def test_the_check_sees_a_true_drive_and_each_wrong_sign(name):
    source = get_source(name)
    for sign in (1.0, -1.0):
        check, estimator = MotionCheck(), CueEstimator()
        for k, motion in enumerate(driven()):
            sample = source.parse(PACK[name](motion))
            if np.isnan(sample.time):
                sample = type(sample)(**{**sample.__dict__, "time": k * DT})
            cues = estimator(sample)
            if cues is not None:
                check.add(sample, cues * [1.0, sign, 1.0, 1.0, 1.0, sign])
        slopes = check.slopes()
        assert slopes["f_x on dv/dt"] == pytest.approx(1.0, abs=0.1)
        assert slopes["f_y on v r"] == pytest.approx(sign, abs=0.1)
        assert slopes["r on the rate of the course"] == pytest.approx(sign, abs=0.1)
        assert len(list(check.doubts())) == (0 if sign > 0 else 2)
