"""The command ``motion-cueing bridge`` over the loopback."""

from __future__ import annotations

import json
import threading
import time

import pytest

from motion_cueing.cli.bridge import BridgeCommand, run, source_lines
from motion_cueing.cli.main import main
from motion_cueing.envs.telemetry import read_stream, source_names
from motion_cueing.realtime import FloatsFormat
from motion_cueing.realtime.bridge import BridgeReport
from motion_cueing.realtime.server import Endpoint

from ..envs.telemetry import games
from ..envs.telemetry.games import Motion
from .test_serve_and_drive import free_port

pytestmark = pytest.mark.slow


def test_a_game_over_the_loopback_leaves_recording_and_report(tmp_path, capsys):
    port, controller = free_port(), Endpoint(("127.0.0.1", 0))
    record, report = tmp_path / "drive.mcgd", tmp_path / "bridge.json"
    game, over, received = Endpoint(("127.0.0.1", 0)), threading.Event(), []

    def play():
        begin = time.perf_counter()
        while not over.is_set():
            now = time.perf_counter() - begin
            motion = Motion(time=now, velocity=(10.0 + 0.5 * now, 0.0, 0.0), acceleration=(0.5, 0.0, 0.0))
            game.send(games.forza(motion), ("127.0.0.1", port))
            game.send(b"noise", ("127.0.0.1", port))
            over.wait(1 / 60)

    player = threading.Thread(target=play)
    player.start()
    try:
        to = f"127.0.0.1:{controller.address[1]}"
        status = run(BridgeCommand(source="forza", listen=str(port), to=to, rate=100, settle=0.0,
                                   frozen=30.0, duration=1.0, record=record, report=report))  # fmt: skip
    finally:
        over.set()
        player.join()
    controller.listen(0, lambda data, sender, now: received.append(FloatsFormat().unpack_cues(data)))
    controller.close()
    game.close()
    assert status == 0
    assert received
    shown = capsys.readouterr().out
    assert f"forza: UDP 127.0.0.1:{port}" in shown
    assert "driving" in shown
    assert "forza: a datagram of 5 bytes; known sizes are 232, 311, 331, 324" in shown
    found = BridgeReport.load_json(report)
    assert found.command.startswith("motion-cueing bridge --from forza")
    assert found.packets["used"] > 5
    assert found.packets["foreign"] > 5
    assert found.sent > 20
    name, datagrams, fault = read_stream(record)
    assert (name, fault) == ("forza", "")
    assert len(datagrams) == sum(found.packets.values())
    assert abs(datagrams[0].time - time.time()) < 600.0
    assert json.loads(report.read_text())["schema"] == 1


def test_the_list_names_every_protocol(capsys):
    assert main(["bridge", "--list"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in source_names())
    assert shown.splitlines() == source_lines()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "--from is missing"),
        (["--from", "forsa"], "Did you mean forza"),
        (["--from", "forza", "--smoothing", "4"], "smoothing"),
        (["--from", "forza", "--reverse", "f_q"], "--reverse"),
        (["--from", "forza", "--rate", "0"], "--rate"),
        (["--from", "forza", "--duration", "0"], "--duration"),
        (["--from", "forza", "--listen", "70000"], "at most 65535"),
        (["--from", "forza", "--to", ":5"], "name a host"),
    ],
)
def test_what_is_wrong_is_said(words, said, capsys):
    assert main(["bridge", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_recording_is_never_overwritten(tmp_path, capsys):
    file = tmp_path / "drive.mcgd"
    file.write_bytes(b"mine")
    assert main(["bridge", "--from", "forza", "--listen", "0", "--record", str(file)]) == 2
    assert "there already" in capsys.readouterr().err
    assert file.read_bytes() == b"mine"
