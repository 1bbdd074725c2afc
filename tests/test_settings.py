"""Configurations and files: strict on the way in, whole on the way out."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import FrozenInstanceError, field
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.settings import (
    NonNegative,
    Positive,
    Vector3,
    configuration,
    from_dict,
    load,
    save,
    to_dict,
)
from motion_cueing.envs.storage import replacing, write_bytes, write_text


@configuration
class Spring:
    """Inner configuration."""

    stiffness: Positive = 10.0
    damping: NonNegative = 0.0


@configuration
class Machine:
    """Outer configuration."""

    mass: Positive
    offset: Vector3 = (0.0, 0.0, 0.0)
    kind: Literal["hexapod", "table"] = "hexapod"
    spring: Spring = Spring()


@configuration
class Roller:
    """A configuration that shares a tuple or a union with another."""

    radius: Positive = 1.0


@configuration
class Assembly:
    """Configurations within other types."""

    springs: tuple[Spring, ...] = ()
    pair: tuple[Spring, Spring] = (Spring(), Spring())
    listed: list[Spring] = field(default_factory=list)
    spare: Spring | None = None
    either: Spring | Roller = Spring()
    machine: Machine | None = None


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.builds(Machine, st.floats(1e-300, 1e300), st.tuples(FINITE, FINITE, FINITE), spring=st.builds(Spring))
)
def test_plain_values_and_back(machine: Machine) -> None:
    assert from_dict(Machine, to_dict(machine)) == machine


def test_yaml_and_back(tmp_path: Path) -> None:
    machine = Machine(2.5, (0.1, -0.2, 1e-9), "table", Spring(3.0, 0.5))
    save(machine, tmp_path / "machine.yaml")
    assert load(Machine, tmp_path / "machine.yaml") == machine


def test_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        Machine(1.0).mass = 2.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass: 1\nofset: [0, 0, 0]", "unknown field 'ofset'. Did you mean offset"),
        ("mass: 1\nzzz: 1", "unknown field 'zzz'. Known: kind, mass, offset, spring"),
        ("{}", "field 'mass' is missing"),
        ("mass: 0", r"field 'mass': Input should be greater than 0 \(found 0\)"),
        (
            "mass: -1\nspring: {damping: -2}",
            "field 'mass'.*; field 'spring.damping'.*greater than or equal to 0",
        ),
        ("mass: heavy", "field 'mass': .*number.*found 'heavy'"),
        ("mass: .nan", "field 'mass'"),
        ("mass: .inf", "field 'mass': Input should be a finite number"),
        ("mass: 1\noffset: [0, 0]", "field 'offset"),
        ("mass: 1\noffset: [0, 0, .nan]", "field 'offset.2': Input should be a finite number"),
        ("mass: 1\nkind: crane", "field 'kind': Input should be 'hexapod' or 'table'"),
        ("- 1\n- 2", "expected fields of Machine, found list"),
        ("", "expected fields of Machine, found NoneType"),
        ("just words", "expected fields of Machine, found str"),
    ],
)
def test_bad_fields_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "machine.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as caught:
        load(Machine, path)
    assert str(path) in str(caught.value)


def test_files_that_are_not_yaml(tmp_path: Path) -> None:
    (tmp_path / "broken.yaml").write_text("mass: [1, 2")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="not YAML"):
        load(Machine, tmp_path / "broken.yaml")
    for name in ("binary.yaml", "missing.yaml", "."):
        with pytest.raises(DataError, match="cannot be read"):
            load(Machine, tmp_path / name)


def test_yaml_cannot_make_objects(tmp_path: Path) -> None:
    (tmp_path / "machine.yaml").write_text("mass: !!python/object/apply:os.getcwd []")
    with pytest.raises(DataError, match="not YAML"):
        load(Machine, tmp_path / "machine.yaml")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("mass: 1\nkind: [table\nspring: {}\n", 3),
        ("mass: 1\n\n\tkind: table\n", 3),
        ("mass: 1\nkind: \x01\n", 2),
    ],
)
def test_what_is_not_yaml_is_told_with_its_line(tmp_path: Path, text: str, line: int) -> None:
    (tmp_path / "machine.yaml").write_text(text)
    with pytest.raises(DataError, match=rf"machine\.yaml: not YAML \(line {line}: \w"):
        load(Machine, tmp_path / "machine.yaml")


def test_writing_makes_folders_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "file.txt"
    write_text(path, "one\n")
    write_text(path, "two\n")
    assert path.read_bytes() == b"two\n"
    write_bytes(path, b"\x00\x01")
    assert path.read_bytes() == b"\x00\x01"
    assert os.listdir(path.parent) == ["file.txt"]


def test_an_error_while_writing_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    write_text(path, "old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as file:  # noqa: PT012
        file.write("half")
        file.flush()
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["file.txt"]


@contextmanager
def small_disk(limit: int) -> Iterator[None]:
    """No file may grow beyond so many bytes: writing more fails as it does on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("existing", [True, False])
def test_a_disk_that_fills_up_midway(tmp_path: Path, existing: bool) -> None:
    path = tmp_path / "file.bin"
    if existing:
        write_bytes(path, b"old")
    with pytest.raises(OSError, match="File too large"), small_disk(10_000):
        write_bytes(path, bytes(100_000))
    assert os.listdir(tmp_path) == (["file.bin"] if existing else [])
    if existing:
        assert path.read_bytes() == b"old"


def test_a_folder_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "file.txt").mkdir()
    with pytest.raises(OSError, match=r"file\.txt"):
        write_text(tmp_path / "file.txt", "text")
    assert os.listdir(tmp_path) == ["file.txt"]


def test_an_unknown_field_of_an_inner_configuration_suggests_its_own_fields(tmp_path: Path) -> None:
    path = tmp_path / "machine.yaml"
    path.write_text("mass: 1\nspring: {stifness: 2}")
    with pytest.raises(ConfigurationError, match=r"unknown field 'spring\.stifness'\. Did you mean"):
        load(Machine, path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("springs: [{}, {dampin: 1}]", r"'springs\.1\.dampin'\. Did you mean damping\?"),
        ("pair: [{}, {dampin: 1}]", r"'pair\.1\.dampin'\. Did you mean damping\?"),
        ("listed: [{dampin: 1}]", r"'listed\.0\.dampin'\. Did you mean damping\?"),
        ("spare: {zzz: 1}", r"'spare\.zzz'\. Known: damping, stiffness\."),
        ("either: {zzz: 1}", r"'either\.Spring\.zzz'\. Known: damping, stiffness\.; .* Known: radius\."),
        ("machine: {spring: {zzz: 1}}", r"'machine\.spring\.zzz'\. Known: damping, stiffness\."),
        ("spars: {}", r"'spars'\. Did you mean spare"),
    ],
)
def test_an_unknown_field_within_another_type_suggests_the_inner_fields(
    tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "assembly.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=f"unknown field {message}"):
        load(Assembly, path)
