"""The live view: what the loop feeds is what a page gets, and nothing there holds the loop up."""

from __future__ import annotations

import json
import socket
import urllib.request

import numpy as np
import pytest

from motion_cueing.envs.errors import MotionCueingError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime import State, make_machine
from motion_cueing.realtime.packets import MOTION_SIZE, NO_SEQUENCE, SetPoint
from motion_cueing.realtime.view import FRAMES, Frames, ViewFeed, watched

from ..browser import chromium, opened

CUES = np.array([1.0, -2.0, -9.0, 0.1, -0.2, 0.3])


@pytest.fixture(scope="module")
def machine():
    """A machine that has moved for a second in the cues above."""
    platform = get_platform("paper")
    machine = make_machine(make_policy("classical", platform), platform, "zacharias")
    for _ in range(100):
        machine.catch_up(CUES)
        machine.act()
    return machine


def setpoint(number: int = 0, state: State = State.RUNNING) -> SetPoint:
    return SetPoint(state, number, NO_SEQUENCE, 0.0, 0.0, 0.01 * number, 0.001 * np.arange(MOTION_SIZE))


def test_a_frame_is_the_set_point_with_the_cues_of_car_and_simulator(machine):
    frames = Frames()
    frames.take(ViewFeed(machine, 1000).datagram(setpoint(7)))
    frame = next(frames.stream())
    assert (frame["state"], frame["time"]) == (State.RUNNING, 0.07)
    np.testing.assert_allclose(frame["position"], 0.001 * np.arange(9))
    np.testing.assert_allclose(frame["reference"], CUES)
    simulated = machine.now.state[0]["simulator_cue"]
    np.testing.assert_allclose(frame["simulated"], [*simulated["force"], *simulated["rate"]])
    assert np.abs(frame["simulated"]).max() > 1.0


@pytest.mark.parametrize("rate", [100, 500, 1000])
def test_thirty_frames_a_second_are_sent(machine, rate):
    assert rate / ViewFeed(machine, rate).every == pytest.approx(FRAMES, rel=0.15)


@pytest.mark.parametrize("data", [b"", b"noise", bytes(2000), 23 * b"\xff" * 8])
def test_noise_is_left_out(machine, data):
    frames = Frames()
    frames.take(ViewFeed(machine, 1000).datagram(setpoint(3)))
    frames.take(data)
    assert next(frames.stream())["time"] == pytest.approx(0.03)


def test_a_slow_reader_gets_the_newest(machine):
    frames, feed = Frames(), ViewFeed(machine, 1000)
    stream = frames.stream()
    for number in range(50):
        frames.take(feed.datagram(setpoint(number)))
    assert next(stream)["time"] == pytest.approx(0.49)


def first_event(url):
    with urllib.request.urlopen(url + "frames", timeout=30) as answer:
        return json.loads(answer.readline().decode().removeprefix("data: "))


@pytest.mark.slow
def test_a_process_shows_it_in_a_browser_and_ends_with_the_block(machine):
    feed = ViewFeed(machine, 1000)
    with watched(get_platform("paper"), "<b>mine</b>") as (address, url), chromium() as browser:
        assert url.startswith("http://127.0.0.1:")
        assert address[0] == "127.0.0.1"
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sender.sendto(feed.datagram(setpoint(1)), address)
        assert first_event(url)["time"] == pytest.approx(0.01)
        page, troubles = opened(browser, url)
        page.wait_for_function("window.ready")
        place = page.evaluate("motionCueingLive.machine.stage.carriage.position.toArray()")
        np.testing.assert_allclose(place, [0.0, 0.001, 0.0], atol=1e-9)
        sender.sendto(feed.datagram(setpoint(2, State.BRAKING)), address)
        page.get_by_text("Braking and returning to neutral.").wait_for()
        assert page.locator(".stage .name").inner_text() == "<b>mine</b>"
        assert troubles == []
        axe = pytest.importorskip("axe_playwright_python.sync_playwright")
        found = axe.Axe().run(page)
        assert found.violations_count == 0, found.generate_report()
        page.close()
        sender.close()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(url, timeout=5)


@pytest.mark.slow
def test_a_port_in_use_is_refused():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with (
            pytest.raises(MotionCueingError, match="port"),
            watched(get_platform("paper"), "mine", taken.getsockname()[1]),
        ):
            pass
