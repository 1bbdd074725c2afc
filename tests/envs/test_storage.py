"""Disks that are full, read-only or shared: each is answered before the work, or by the file's name."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from motion_cueing.envs import storage
from motion_cueing.envs.errors import DataError
from motion_cueing.envs.storage import check_file, check_folder, release_folders, replacing, write_text


@pytest.fixture(autouse=True)
def released():
    yield
    release_folders()


def owner_of(folder: Path) -> subprocess.Popen[str]:
    """Another process that has claimed a folder, and waits."""
    code = (
        "import sys; from pathlib import Path; from motion_cueing.envs.storage import check_folder; "
        f"check_folder('--out', Path({str(folder)!r})); print('claimed', flush=True); sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "claimed\n"
    return process


def test_a_folder_belongs_to_one_process_until_that_dies(tmp_path):
    other = owner_of(tmp_path / "out")
    try:
        with pytest.raises(DataError, match=f"is in use by process {other.pid} "):
            check_folder("--out", tmp_path / "out")
        check_folder("--out", tmp_path / "other")
    finally:
        other.kill()
        other.wait()
    check_folder("--out", tmp_path / "out")
    # The same process may claim it again.
    check_folder("--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_full_disk_names_the_file(tmp_path):
    def fill() -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OSError, match="No space left") as caught, replacing(tmp_path / "large.json"):
        fill()
    assert caught.value.filename == str(tmp_path / "large.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_names_as_long_as_the_disk_takes_are_written(tmp_path):
    target = tmp_path / ("n" * 255)
    write_text(target, "all of it")
    assert target.read_text() == "all of it"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("check", [check_file, check_folder])
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("n" * 256, "a name of 256 bytes, at most 255"),
        ("ä" * 128, "a name of 256 bytes"),
        (os.fsdecode(b"caf\xe9"), r"caf\\udce9': the name is not UTF-8"),
        ("a\0b", "a zero byte"),
    ],
)
def test_names_no_file_can_have_are_refused_before_the_work(tmp_path, check, name, sentence):
    with pytest.raises(DataError, match=sentence):
        check("--out", tmp_path / name)


def test_temporary_files_of_killed_processes_are_removed(tmp_path):
    target = tmp_path / "result.json"
    old, fresh, foreign = (
        tmp_path / name for name in (".result.json.abcdefgh", ".result.json.ijklmnop", ".x.abcdefgh")
    )
    for path in (old, fresh, foreign):
        path.write_text("part")
    for path in (old, foreign):
        os.utime(path, (time.time() - 3600.0,) * 2)
    write_text(target, "whole")
    assert sorted(tmp_path.iterdir()) == sorted([fresh, foreign, target])


def test_temporary_files_that_a_process_still_writes_stay(tmp_path):
    target = tmp_path / "result.json"
    with replacing(target) as file:
        file.write("slow")
        (held,) = tmp_path.iterdir()
        os.utime(held, (time.time() - 3600.0,) * 2)
        write_text(target, "quick")
        assert held.exists()
    assert target.read_text() == "slow"


def test_a_cache_that_cannot_be_written_is_a_temporary_one_and_is_said(tmp_path, monkeypatch, capfd):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path / "file" / "cache"))
    folder = storage.cache_folder()
    assert folder.is_relative_to(storage.private_folder())
    assert storage.cache_folder() == folder
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "MOTION_CUEING_CACHE" in said


def test_only_what_the_user_alone_can_write_is_private(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir(mode=0o700)
    assert storage.is_private(folder)
    folder.chmod(0o770)
    assert not storage.is_private(folder)
    folder.chmod(0o700)
    link = tmp_path / "link"
    link.symlink_to(folder)
    assert not storage.is_private(link)
    assert not storage.is_private(tmp_path / "nothing")
    assert storage.is_private(storage.private_folder())


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder that nobody can write")
def test_the_package_is_imported_with_a_home_that_cannot_be_written(tmp_path):
    environment = {**os.environ, "HOME": "/proc/self", "XDG_CACHE_HOME": "/proc/self/cache"}
    for name in ("WARP_CACHE_PATH", "MOTION_CUEING_CACHE"):
        environment.pop(name, None)
    code = "from motion_cueing.envs.arrays import wp; print(wp.config.kernel_cache_dir)"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith(str(storage.private_folder()))
    assert "cannot be written" in done.stderr
