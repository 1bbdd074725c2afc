"""``motion-cueing view``: what it shows, and what it refuses."""

from __future__ import annotations

import threading
import urllib.error
import urllib.request
from dataclasses import replace

import pytest

from motion_cueing.cli.main import main
from motion_cueing.cli.view import ViewCommand, pack_drives
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.evaluation.reporting.view.server import PageServer, Routes

from ..evaluation.synthetic import drive


@pytest.fixture
def evaluation(tmp_path):
    """The trajectories of an evaluation: two policies on two drives of the machine `paper`."""
    for maneuver in ("north", "south"):
        for policy in ("a", "b"):
            one = replace(drive(policy=policy), maneuver=maneuver, platform="paper")
            one.save(tmp_path / "trajectories" / f"{maneuver}--{policy}.npz")
    return tmp_path


def test_a_folder_shows_every_drive_with_every_policy(evaluation):
    platform, drives = pack_drives(ViewCommand(runs=(str(evaluation),)))
    assert platform.name == "paper"
    assert {name: list(one.about["policies"]) for name, one in drives.items()} == {
        "north": ["a", "b"],
        "south": ["a", "b"],
    }


def test_a_maneuver_leaves_out_the_others(evaluation):
    _, drives = pack_drives(ViewCommand(runs=(str(evaluation),), maneuver="south"))
    assert list(drives) == ["south"]
    with pytest.raises(DataError, match="no trajectory of 'east'"):
        pack_drives(ViewCommand(runs=(str(evaluation),), maneuver="east"))


def test_policies_of_one_name_are_told_apart(evaluation):
    files = [str(evaluation / "trajectories" / "north--a.npz")] * 2
    _, drives = pack_drives(ViewCommand(runs=tuple(files)))
    assert list(drives["north"].about["policies"]) == ["a", "a-2"]


def test_a_policy_drives_the_maneuver_and_has_a_road():
    _, drives = pack_drives(ViewCommand(runs=("no-motion",), maneuver="braking"))
    assert list(drives["braking"].about["policies"]) == ["no-motion"]
    assert drives["braking"].about["road"] is not None


def test_trajectories_of_another_machine_are_refused(evaluation, tmp_path):
    with pytest.raises(ConfigurationError, match="motion base 'paper', not 'nads-1'"):
        pack_drives(ViewCommand(runs=(str(evaluation),), platform="nads-1"))


def test_a_folder_without_results_is_refused(tmp_path, capsys):
    assert main(["view", str(tmp_path)]) == 2
    assert "no trajectories and no best.safetensors" in capsys.readouterr().err


def test_out_is_one_html_file(evaluation, tmp_path, capsys):
    assert main(["view", str(evaluation), "--out", str(tmp_path / "view.png")]) == 2
    assert main(["view", str(evaluation), "--out", str(tmp_path / "view.html")]) == 0
    text = (tmp_path / "view.html").read_text(encoding="utf-8")
    assert "<title>north on the motion base paper</title>" in text


@pytest.fixture
def server():
    answers, streams = {"/double": lambda data: 2 * data}, {"/count": lambda: iter([1, 2])}
    routes = Routes(lambda: "<p>page</p>", answers, streams)
    server = PageServer(routes)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def ask(server, path, data=None, **headers):
    request = urllib.request.Request(server.url.rstrip("/") + path, data, headers)
    with urllib.request.urlopen(request, timeout=20) as answer:
        return answer.read().decode()


def test_the_server_answers_on_the_loopback_address(server):
    assert server.server_address[0] == "127.0.0.1"
    assert ask(server, "/") == "<p>page</p>"
    assert ask(server, "/double", b"21") == "42"
    assert ask(server, "/count") == "data: 1\n\ndata: 2\n\n"


@pytest.mark.parametrize("headers", [{"Host": "example.org:80"}, {"Origin": "http://example.org"}])
def test_other_hosts_and_other_pages_are_refused(server, headers):
    with pytest.raises(urllib.error.HTTPError, match="403"):
        ask(server, "/double", b"21", **headers)
