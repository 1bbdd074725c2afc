"""``serve`` and ``drive`` over the loopback, and what both refuse."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from motion_cueing.cli import drive as drive_command
from motion_cueing.cli import serve as serve_command
from motion_cueing.cli.drive import DriveCommand
from motion_cueing.cli.evaluate import EvaluateCommand, make_plan
from motion_cueing.cli.main import main
from motion_cueing.cli.serve import ServeCommand
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import Trajectory
from motion_cueing.evaluation.suite import run_suite
from motion_cueing.realtime.client import Client, LimitCheck, Trouble, cues_at
from motion_cueing.realtime.packets import Cues, SetPoint
from motion_cueing.realtime.report import SCHEMA, LoopReport
from motion_cueing.realtime.server import Endpoint, address_of, is_loopback
from motion_cueing.realtime.watchdog import State

from ..evaluation.loop.loops import FLOATS, PAPER, lane_change

GENTLE = {"rate": 100, "overdue": 20.0, "hold": 30.0, "stale": 20.0, "steady": 0.0}
"""So that a machine that is slow for a moment fails nothing."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Button:
    """Ctrl-C, pressed by the test."""

    def __init__(self) -> None:
        self.asked = False

    @contextmanager
    def caught(self):
        yield


@pytest.mark.parametrize(("form", "policy"), [("floats", "classical"), ("msgpack", "no-motion")])
def test_a_drive_over_the_loopback_leaves_log_and_report(form, policy, tmp_path, capsys, monkeypatch):
    log, told, driven = tmp_path / "log.npz", tmp_path / "told.json", tmp_path / "drive.json"
    cues, port, button, listens = tmp_path / "lane.csv", free_port(), Button(), threading.Event()
    lane_change(0.4).to_csv(cues)
    announce = serve_command._announce
    monkeypatch.setattr("motion_cueing.train.training.Interrupt", lambda: button)
    monkeypatch.setattr(serve_command, "_announce", lambda *given: (announce(*given), listens.set()))
    command = ServeCommand(policy=policy, port=port, format=form, log=log, report=told, **GENTLE)
    server = threading.Thread(target=serve_command.run, args=(command,))
    server.start()
    assert listens.wait(60.0)
    drive = DriveCommand(
        maneuver=str(cues), to=f"127.0.0.1:{port}", rate=100, format=form, after=0.1, report=driven
    )
    status = drive_command.run(drive)
    button.asked = True
    server.join()
    assert status == 0
    found = LoopReport.load_json(told)
    assert found.packets["used"] > 0
    assert found.states["running"] > 0
    assert found.timings["period"].count == found.periods
    assert found.command.startswith("motion-cueing serve")
    answers = LoopReport.load_json(driven).packets
    assert answers["received"] > 0
    assert answers["malformed"] == answers["outside_limits"] == 0
    assert f"UDP 127.0.0.1:{port}" in capsys.readouterr().out
    logged = Trajectory.load(log)
    assert len(logged) == sum(found.states.values())
    assert np.abs(logged.f_reference[:, 1]).max() > 0.0
    plan = make_plan(EvaluateCommand(replays=(log,), out=tmp_path / "out"), ["motion-cueing", "evaluate"])
    outcome = run_suite(plan.maneuvers, plan.policies, lambda maneuver, drives: None)
    assert list(outcome.maneuvers["log"]) == ["driven"]
    assert outcome.maneuvers["log"]["driven"].cue_error > 0.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_stops_it_gets_its_report(number, tmp_path):
    words = ["serve", "--policy", "no-motion", "--port", "0", "--report", "told.json", "--log", "log.npz"]
    program = [sys.executable, "-m", "motion_cueing.evaluation", *words]
    with subprocess.Popen(program, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as server:
        assert "UDP 127.0.0.1:" in server.stdout.readline()
        server.send_signal(number)
        assert "periods in" in server.stdout.read()
    assert server.returncode == 0
    assert LoopReport.load_json(tmp_path / "told.json").states["running"] == 0


def test_a_replay_needs_its_own_machine_and_cues(tmp_path, capsys):
    from ..evaluation.loop.loops import Bench

    bench = Bench()
    bench.calm(0.1)
    bench.trajectory().save(tmp_path / "log.npz")
    for extra, told in (
        [["--maneuvers", "braking"], "leave --maneuvers out"],
        [["--platform", "nads-1"], "'paper'"],
    ):
        words = ["evaluate", "--replays", str(tmp_path / "log.npz"), "--out", str(tmp_path / "out"), *extra]
        assert main(words) == 2
        assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--policy", "optimum"], "must know the drive before it begins"),
        (["--policy", "clasical"], "Did you mean classical"),
        (["--policy", "no-motion", "--rate", "150"], "multiple of 100"),
        (["--duration", "0"], "--duration must be positive"),
        (["--lead", "-1"], "--lead must not be negative"),
        (["--log", "log.csv"], "ends in .npz"),
        (["--policy", "no-motion", "--host", "203.0.113.7"], "cannot be listened at"),
        (["--policy", "no-motion", "--port", "99999"], "at most 65535"),
        (["--policy", "no-motion", "--peer", "127.0.0.1:x"], "a port is a number"),
        (["--policy", "no-motion", "--hold", "0.01"], "hold must not be less than overdue"),
        (["--policy", "no-motion", "--priority", "1000", "--port", "0"], "refuses"),
    ],
)
def test_serve_refuses_in_one_line(words, told, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["serve", *words]) == 2
    complaint = capsys.readouterr().err
    assert told in complaint
    assert complaint.count("\n") == 1 + complaint.startswith("making ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--to", "127.0.0.1:70000"], "at most 65535"),
        (["--to", "no such host"], "there is no host"),
        (["--drop", "1.5"], "--drop must be a share"),
        (["--times", "0"], "--times must be at least 1"),
        (["--after", "inf"], "at least 0 and finite"),
        (["--maneuver", "all"], "means several drives"),
    ],
)
def test_drive_refuses_in_one_line(words, told, capsys):
    assert main(["drive", *words]) == 2
    assert told in capsys.readouterr().err


def test_drive_fails_where_nobody_answers(tmp_path, capsys):
    lane_change(0.1).to_csv(tmp_path / "lane.csv")
    words = ["drive", "--maneuver", str(tmp_path / "lane.csv"), "--to", f"127.0.0.1:{free_port()}"]
    assert main([*words, "--rate", "100", "--after", "0"]) == 1
    assert capsys.readouterr().err.endswith("nothing came back; is `motion-cueing serve` running there?\n")


def test_beyond_this_machine_is_announced(capsys):
    port = str(free_port())
    for extra, told in ([[], "whoever sends first"], [["--peer", "127.0.0.1"], "only 127.0.0.1 moves it"]):
        words = ["serve", "--policy", "no-motion", "--host", "0.0.0.0", "--port", port, "--duration", "0.001"]
        assert main([*words, *extra]) == 0
        assert told in capsys.readouterr().out
    assert is_loopback(("127.0.0.1", 1))
    assert not is_loopback(("0.0.0.0", 1))


def test_addresses():
    assert address_of("127.0.0.1", 5) == ("127.0.0.1", 5)
    assert address_of("127.0.0.1:6", 5) == ("127.0.0.1", 6)
    with pytest.raises(ConfigurationError):
        address_of("127.0.0.1:", 5)
    # The system's own answer is 0.0.0.0: an unset variable in a script would let the network in.
    for text in ("", ":6"):
        with pytest.raises(ConfigurationError, match="name a host"):
            address_of(text, 5)
    with pytest.raises(UnknownNameError):
        get_platform("papier")


def sent(trouble, count=2000):
    out = [
        [packet.sequence for packet in trouble.sent(Cues(k, 0.0, (0, 0, 0), (0, 0, 0)), k / 1000)]
        for k in range(count)
    ]
    return [number for numbers in out for number in numbers]


def test_trouble_is_what_was_asked_for():
    assert sent(Trouble(0, 0, 0, 0, 0)) == list(range(2000))
    dropped = sent(Trouble(0.1, 0, 0, 0, 0))
    assert 1700 < len(dropped) < 1900
    assert dropped == sorted(set(dropped))
    repeated = sent(Trouble(0, 0.1, 0, 0, 0))
    assert len(repeated) - len(set(repeated)) == pytest.approx(200, abs=50)
    late = sent(Trouble(0, 0, 0.1, 0, 0))
    assert late != sorted(late)
    assert set(range(1900)) <= set(late)
    assert sent(Trouble(0.1, 0.1, 0.1, 0.1, 5)) == sent(Trouble(0.1, 0.1, 0.1, 0.1, 5))
    broken = Trouble(0, 0, 0, 1.0, 0)
    (packet,) = broken.sent(Cues(0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 0.0)
    assert np.isnan(packet.force[0])


def test_cues_are_sent_over_and_over_at_the_rate():
    trace = lane_change(0.5)
    found = list(cues_at(trace, 200, 2))
    assert len(found) == 2 * len(trace.resampled(0.005))
    assert [cues.sequence for cues in found] == list(range(len(found)))
    np.testing.assert_allclose(found[0].force, trace.specific_force[0])
    assert found[len(found) // 2].force == found[0].force
    np.testing.assert_allclose(found[1].force, 0.5 * (trace.specific_force[0] + trace.specific_force[1]))


def still(sequence, **parts) -> SetPoint:
    motion = np.zeros(39)
    for where, value in parts.values():
        motion[where] = value
    return SetPoint(State.RUNNING, sequence, 0, 0.0, 0.0, 0.0, motion)


@pytest.mark.parametrize(
    ("where", "value", "told"),
    [
        (0, 1e3, "position limit of carriage_x"),
        (27, 1e3, "position limit of leg_1"),
        (17, 1e3, "velocity limit of turntable"),
        (38, -1e3, "velocity limit of leg_6"),
        (10, 0.1, "acceleration limit of carriage_y"),
        (5, np.nan, "not finite"),
    ],
)
def test_what_exceeds_a_limit_is_told(where, value, told):
    check = LimitCheck(PAPER, 1000)
    assert check(still(0)) == ""
    assert told in check(still(1, one=(where, value)))


def test_the_client_counts_what_is_wrong():
    here, there = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    client = Client(here, there.address, FLOATS, PAPER, 1000, Trouble(0, 0, 0, 0, 0))
    for setpoint in (still(0), still(1), still(4), still(2), still(5, one=(0, 1e3))):
        there.send(FLOATS.pack_setpoint(setpoint), here.address)
    there.send(b"noise", here.address)
    here.send(FLOATS.pack_setpoint(still(6)), here.address)
    client.listen(0.0)
    assert client.counts == {
        "received": 5, "malformed": 1, "foreign": 1, "missing": 2, "disordered": 1, "outside_limits": 1,
    }  # fmt: skip
    assert client.faults == ["set-point 5 exceeds the position limit of carriage_x"]
    # Times of a controller that is not ours may be anything.
    for wrong in ({"echo_time": np.nan}, {"sent": np.inf}, {"received": -1e300}):
        there.send(FLOATS.pack_setpoint(still(7)._replace(**wrong)), here.address)
    client.listen(0.0)
    assert (client.counts["malformed"], client.counts["received"]) == (4, 5)
    here.close()
    there.close()


def test_a_report_is_json_of_its_version(tmp_path):
    words = ["serve", "--policy", "no-motion", "--port", "0", "--duration", "0.001", "--report"]
    assert main([*words, str(tmp_path / "r.json")]) == 0
    values = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert values["schema"] == SCHEMA
    assert values["command"].startswith("motion-cueing serve --policy no-motion")


def test_a_log_of_nothing_is_not_written_and_that_is_told(tmp_path, capsys):
    log = tmp_path / "log.npz"
    words = ["serve", "--policy", "no-motion", "--port", "0", "--duration", "1e-9", "--log", str(log)]
    assert main(words) == 0
    assert f"{log} is not written" in capsys.readouterr().err
    assert not log.exists()
