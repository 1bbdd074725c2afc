"""Configurations and files: strict on the way in, whole on the way out."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import inspect
import math
import os
import pickle
import pkgutil
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import FrozenInstanceError, field, replace
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

import motion_cueing.baselines
import motion_cueing.envs
import motion_cueing.evaluation
from motion_cueing.baselines.washout import load_washout, washout_presets
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import Turntable, get_platform
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
from motion_cueing.envs.task.options import TaskOptions


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


@configuration
class Crate:
    """A configuration whose fields must fit each other."""

    low: NonNegative = 0.0
    high: NonNegative = 1.0

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError(f"low must not exceed high, {self.high:g}")


@configuration
class Store:
    """Such a configuration within another."""

    crate: Crate = Crate()


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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Machine(-1.0), r"Machine: field 'mass': Input should be greater than 0 \(found -1\.0\)"),
        (lambda: Machine(mass=math.nan), r"Machine: field 'mass': Input should be a finite number"),
        (lambda: Machine(), "Machine: field 'mass' is missing"),
        (lambda: Machine(1.0, mass=2.0), "field 'mass' is given twice"),
        (
            lambda: Spring(1.0, 2.0, 3.0),
            "Spring: value number 3 is too many; the fields are stiffness, damping",
        ),
        (lambda: Spring(stifness=1.0), r"Spring: unknown field 'stifness'\. Did you mean stiffness\?"),
        (lambda: Machine(1.0, (0.0, math.inf, 0.0)), r"Machine: field 'offset\.1': .*finite"),
        (lambda: Machine(1.0, spring={"damping": -2.0}), r"Machine: field 'spring\.damping': .*equal to 0"),
        (
            lambda: Machine(1.0, spring={"dampin": 2.0}),
            r"Machine: unknown field 'spring\.dampin'\. Did",
        ),
        (lambda: replace(Machine(1.0), mass=0.0), "Machine: field 'mass': Input should be greater than 0"),
        (lambda: replace(Machine(1.0), weight=0.0), "Machine: unknown field 'weight'"),
        (lambda: Crate(2.0, 1.0), r"Crate: low must not exceed high, 1$"),
        (lambda: Store(crate={"low": 2.0}), r"Store: field 'crate': low must not exceed high, 1$"),
        (lambda: Store(crate=Crate(low=-1.0)), "Crate: field 'low': Input should be greater than or equal"),
    ],
)
def test_what_is_made_in_python_is_checked_in_the_same_words(
    make: Callable[[], object], message: str
) -> None:
    with pytest.raises(
        ConfigurationError, match=f"^{message}" if message[0].isupper() else message
    ) as caught:
        make()
    assert "ArgsKwargs" not in str(caught.value)
    assert caught.value.__cause__ is None


def test_configurations_are_values() -> None:
    one, same, other = Machine(1.0), Machine(1, spring=Spring()), Machine(2.0)
    assert one == same
    assert hash(one) == hash(same)
    assert one != other
    assert pickle.loads(pickle.dumps(other)) == other
    assert copy.deepcopy(other) == other
    assert replace(one, mass=2.0) == other
    assert list(inspect.signature(Machine).parameters) == ["mass", "offset", "kind", "spring"]


def configurations() -> list[type[Any]]:
    """Every configuration class of the package."""
    modules = [
        importlib.import_module(found.name)
        for package in (motion_cueing.envs, motion_cueing.baselines, motion_cueing.evaluation)
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        if not found.name.endswith("__main__")
    ]
    found = {
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type)
        and "__pydantic_validator__" in vars(value)
        and not inspect.isabstract(value)
    }
    return sorted(found, key=lambda cls: cls.__qualname__)


def test_every_configuration_of_the_package_refuses_an_unknown_field() -> None:
    classes = configurations()
    assert {"Platform", "Car", "TaskOptions", "WashoutParameters", "Braking"} <= {c.__name__ for c in classes}
    for cls in classes:
        with pytest.raises(ConfigurationError, match=f"^{cls.__name__}: .*unknown field 'no_such_field'"):
            cls(no_such_field=1)
        with pytest.raises(FrozenInstanceError):
            cls.__setattr__(object.__new__(cls), dataclasses.fields(cls)[0].name, 1)


def test_the_configurations_of_the_package_name_what_is_wrong() -> None:
    with pytest.raises(ConfigurationError, match=r"^Turntable: travel must contain 0, found \[1\.0, 2\.0\]$"):
        Turntable(travel=(1.0, 2.0), velocity=1.0, acceleration=1.0)
    with pytest.raises(ConfigurationError, match=r"^Braking: field 'deceleration': .*greater than 0"):
        replace(get_maneuver("braking"), deceleration=-1.0)
    with pytest.raises(
        ConfigurationError, match=r"^TaskOptions: unknown platform 'papr'\. Did you mean paper\?"
    ):
        TaskOptions(platform="papr")
    with pytest.raises(ConfigurationError, match=r"^WashoutParameters: .*'psi'"):
        replace(load_washout(washout_presets()[0]), psi=1.0)


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


def test_too_few_entries_name_the_field_and_the_number() -> None:
    hexapod = get_platform("paper").hexapod
    with pytest.raises(ConfigurationError) as raised:
        dataclasses.replace(hexapod, upper_joints=hexapod.upper_joints[:5])
    assert str(raised.value) == "Hexapod: field 'upper_joints': must have at least 6 entries, found 5"
    with pytest.raises(ConfigurationError, match="'lower_joints': must have at most 6 entries, found 12"):
        dataclasses.replace(hexapod, lower_joints=hexapod.lower_joints * 2)
