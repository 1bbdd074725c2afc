"""``serve`` and ``drive`` over the loopback, and what both refuse."""

from __future__ import annotations

import json
import signal
import socket
import threading

import numpy as np
import pytest

from motion_cueing.cli import serve as serve_command
from motion_cueing.cli.evaluate import EvaluateCommand, make_plan
from motion_cueing.cli.main import main
from motion_cueing.cli.serve import DriveCommand, ServeCommand
from motion_cueing.evaluation import Trajectory, measure, rollout
from motion_cueing.evaluation.suite import cues_of, load_drives, run_suite
from motion_cueing.realtime import SetPoint, State
from motion_cueing.realtime.client import Client
from motion_cueing.realtime.packets import NO_SEQUENCE
from motion_cueing.realtime.report import SCHEMA, LoopReport
from motion_cueing.realtime.server import Server

from ..realtime.bench import FLOATS, PAPER, Bench, lane_change

pytestmark = pytest.mark.slow

GENTLE = {"rate": 100, "overdue": 20.0, "hold": 30.0, "stale": 20.0, "steady": 0.0}
"""So that a machine that is slow for a moment fails nothing."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize(
    ("form", "policy", "ending"),
    [("floats", "classical", signal.SIGINT), ("msgpack", "no-motion", signal.SIGTERM)],
)
def test_a_drive_over_the_loopback_leaves_log_and_report(form, policy, ending, tmp_path, capsys, monkeypatch):
    log, served, driven = tmp_path / "log.npz", tmp_path / "serve.json", tmp_path / "drive.json"
    cues, port = tmp_path / "lane.csv", free_port()
    lane_change(0.4).to_csv(cues)

    driving = DriveCommand(
        maneuver=str(cues), to=f"127.0.0.1:{port}", rate=100, format=form, after=0.1, report=driven
    )
    statuses, run = [], Server.run

    def drive():
        try:
            statuses.append(serve_command.run_drive(driving))
        finally:
            signal.raise_signal(ending)

    def driven_run(self, ends):
        client = threading.Thread(target=drive)
        client.start()
        run(self, ends)
        client.join()

    monkeypatch.setattr(Server, "run", driven_run)
    command = ServeCommand(policy=policy, port=port, format=form, log=log, report=served, **GENTLE)
    assert serve_command.run(command) == 0
    assert statuses == [0]
    report = LoopReport.load_json(served)
    assert report.packets["used"] > 0
    assert report.states["running"] > 0
    assert report.timings["period"].count == report.periods
    assert report.command.startswith("motion-cueing serve")
    answers = LoopReport.load_json(driven).packets
    assert answers["received"] > 0
    assert answers["malformed"] == answers["outside_limits"] == 0
    shown = capsys.readouterr()
    assert f"UDP 127.0.0.1:{port}" in shown.out
    assert "outside the machine's limits: 0" in shown.out
    assert shown.err.count("returns to neutral") == 1
    # The log is not written over, and nothing listens before that is said.
    assert main(["serve", "--policy", policy, "--port", str(port), "--log", str(log)]) == 2
    assert "is there already" in capsys.readouterr().err
    logged = Trajectory.load(log)
    assert len(logged) == sum(report.states.values())
    assert np.abs(logged.f_reference[:, 1]).max() > 0.0
    plan = make_plan(EvaluateCommand(replays=(log,), out=tmp_path / "out"), ["motion-cueing evaluate"])
    outcome = run_suite(plan.maneuvers, plan.policies, lambda maneuver, drives: None)
    assert list(outcome.maneuvers) == ["log"]
    assert list(outcome.maneuvers["log"]) == ["driven"]
    assert "did not move the machine" in plan.skipped["log.npz"]
    assert outcome.maneuvers["log"]["driven"].cue_error > 0.0


def test_only_what_the_policy_moved_is_scored(tmp_path):
    bench = Bench()
    for seconds in (2.0, 1.0):
        bench.wait(0.5)
        bench.drive(lane_change(seconds))
        bench.settle(cues=False)
    bench.trajectory().save(tmp_path / "twice.npz")
    drives, left_out = load_drives([tmp_path / "twice.npz"], PAPER)
    assert list(drives) == ["twice", "twice-2"]
    followed = sum(setpoint.state.follows for setpoint in bench.setpoints)
    assert sum(map(len, drives.values())) == followed
    rest = 0.01 * (len(bench.setpoints) - followed)
    assert left_out["twice.npz"].startswith(f"{rest:.1f} s ")
    # The same policy on the same cues from the same start is the same drive.
    again = rollout(bench.policy, cues_of(drives["twice"], "again"))
    np.testing.assert_array_equal(again.f_simulator, drives["twice"].f_simulator)
    assert measure(again).cue_error == measure(drives["twice"]).cue_error
    for seconds, drive in zip((2.0, 1.0), drives.values(), strict=True):
        trace = lane_change(seconds)
        assert drive.time[0] == 0.0
        np.testing.assert_array_equal(drive.f_reference[: len(trace)], trace.specific_force)
        # The last cues go on for three steps and are held for a moment; then it brakes, which is not in it.
        held = drive.f_reference[len(trace) :]
        np.testing.assert_array_equal(held[2:] - held[2], 0.0)
        slope = np.abs(np.diff(trace.specific_force[-8:], axis=0)).max()
        assert np.abs(held - trace.specific_force[-1]).max() <= 3.0 * slope


def test_a_log_in_which_nothing_moved_is_refused(tmp_path, capsys):
    bench = Bench()
    bench.wait(0.5)
    bench.trajectory().save(tmp_path / "still.npz")
    assert main(["evaluate", "--replays", str(tmp_path / "still.npz"), "--out", str(tmp_path / "out")]) == 2
    assert "never moved the machine" in capsys.readouterr().err


def test_a_replay_needs_its_own_machine_and_cues(tmp_path, capsys):
    bench = Bench()
    bench.stand(0.1)
    bench.trajectory().save(tmp_path / "log.npz")
    for extra, complaint in (
        [["--maneuvers", "braking"], "leave --maneuvers out"],
        [["--platform", "nads-1"], "'paper'"],
    ):
        words = ["evaluate", "--replays", str(tmp_path / "log.npz"), "--out", str(tmp_path / "out"), *extra]
        assert main(words) == 2
        assert complaint in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "complaint"),
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
def test_serve_refuses_in_one_line(words, complaint, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["serve", *words]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert "\n" not in error.split("motion-cueing serve: ")[1].rstrip("\n")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--to", "127.0.0.1:70000"], "at most 65535"),
        (["--to", "no such host"], "there is no host"),
        (["--drop", "1.5"], "--drop must be a share"),
        (["--times", "0"], "--times must be at least 1"),
        (["--after", "inf"], "at least 0 and finite"),
        (["--maneuver", "all"], "means several drives"),
    ],
)
def test_drive_refuses_in_one_line(words, complaint, capsys):
    assert main(["drive", *words]) == 2
    assert complaint in capsys.readouterr().err


def test_drive_fails_where_nobody_answers(tmp_path, capsys):
    lane_change(0.1).to_csv(tmp_path / "lane.csv")
    words = ["drive", "--maneuver", str(tmp_path / "lane.csv"), "--to", f"127.0.0.1:{free_port()}"]
    assert main([*words, "--rate", "100", "--after", "0"]) == 1
    assert "nothing came back" in capsys.readouterr().err


def test_drive_says_that_the_machine_still_braked(tmp_path, capsys, monkeypatch):
    lane_change(0.1).to_csv(tmp_path / "lane.csv")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as controller:
        controller.bind(("127.0.0.1", 0))
        run = Client.run

        def answered(self, cues, stops):
            # What this client listens at is known to it alone until it sends.
            motion = SetPoint(State.BRAKING, 0, NO_SEQUENCE, 0.0, 0.0, 0.0, np.zeros(39))
            controller.sendto(FLOATS.pack_setpoint(motion), ("127.0.0.1", self._endpoint.address[1]))
            run(self, cues, stops)

        monkeypatch.setattr(Client, "run", answered)
        words = ["drive", "--maneuver", str(tmp_path / "lane.csv"), "--rate", "100", "--after", "0", "--to"]
        assert main([*words, f"127.0.0.1:{controller.getsockname()[1]}"]) == 0
    assert "100.0% of the set-points came from a machine that braked" in capsys.readouterr().err


def test_beyond_this_machine_is_announced(capsys):
    port = str(free_port())
    for extra, notice in ([[], "whoever sends first"], [["--peer", "127.0.0.1"], "only 127.0.0.1 moves it"]):
        words = ["serve", "--policy", "no-motion", "--host", "0.0.0.0", "--port", port, "--duration", "0.001"]
        assert main([*words, *extra]) == 0
        assert notice in capsys.readouterr().out


def test_a_report_is_json_of_its_version(tmp_path):
    words = ["serve", "--policy", "no-motion", "--port", "0", "--duration", "0.001", "--report"]
    assert main([*words, str(tmp_path / "r.json")]) == 0
    values = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert values["schema"] == SCHEMA
    assert values["command"].startswith("motion-cueing serve --policy no-motion")


def test_an_empty_log_is_not_written(tmp_path, capsys):
    log = tmp_path / "log.npz"
    words = ["serve", "--policy", "no-motion", "--port", "0", "--duration", "1e-9", "--log", str(log)]
    assert main(words) == 0
    assert f"{log} is not written" in capsys.readouterr().err
    assert not log.exists()
