"""Files that would take all memory or time are refused in a sentence; what is right is read as before."""

from __future__ import annotations

import gzip
import io
import json
import zipfile

import numpy as np
import pytest
import yaml

from motion_cueing.envs.cues import read_table
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.limits import parse_json, read_arrays, read_bytes
from motion_cueing.envs.platform.machines import ActuatorDynamics
from motion_cueing.envs.settings import read_yaml

LAUGHS = "a: &a [1, 1]\n" + "\n".join(
    f"{name}: &{name} [{', '.join(['*' + before] * 9)}]"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (LAUGHS, "more than 20000 values"),
        ("[" * 20000, "deeper than 50 levels"),
        ("{" * 20000, "deeper than 50 levels"),
        ("- " * 20000, "deeper than 50 levels"),
        ("a: " + "9" * 5000, "a whole number of 5000 characters"),
        ("a: 1\nb:\n  c: 1\n  c: 2", "line 4: the key 'c' stands there twice"),
        ("&a [*a]", "'a' holds itself"),
        ("a: !!int word", "a value cannot be read"),
        ("a: " + "x" * 2**20, "larger than 1 MiB"),
    ],
)
def test_yaml_that_bursts_is_refused(tmp_path, text, sentence):
    path = tmp_path / "burst.yaml"
    path.write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_yaml(path)


def test_yaml_reads_dates_as_words_and_aliases_as_what_they_stand_for(tmp_path):
    path = tmp_path / "plain.yaml"
    path.write_text("name: 2024-01-01\na: &a {x: 1}\nb: *a\nc:\n  <<: *a\n  x: 2\n")
    assert read_yaml(path) == {"name": "2024-01-01", "a": {"x": 1}, "b": {"x": 1}, "c": {"x": 2}}


def test_yaml_of_our_own_is_read_as_the_library_reads_it(tmp_path):
    values = {"a": [1, 2.5, None, True, "word"], "b": {"c": [[0.0] * 3] * 4}, "e": -1e-7, "f": "2024-01-01"}
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(values))
    assert read_yaml(path) == values


@pytest.mark.parametrize("text", ["[" * 60 + "]" * 60, "[" * 100000, '{"a":' * 60 + "1" + "}" * 60])
def test_deep_json_is_refused(text):
    with pytest.raises(ValueError, match="deeper than 50 levels"):
        parse_json(text)


def test_files_without_an_end_are_read_to_the_limit():
    with pytest.raises(DataError, match="larger than"):
        read_bytes("/dev/zero", 1000)


def test_a_table_of_too_many_columns_is_refused(tmp_path):
    path = tmp_path / "wide.csv"
    path.write_text(",".join(f"c{i}" for i in range(30000)) + "\n" + ",".join(["1"] * 30000) + "\n")
    with pytest.raises(DataError, match="line 1 has 30000 cells, at most 1000"):
        read_table(path)


def test_a_packed_table_that_bursts_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("motion_cueing.envs.limits.LARGEST_TABLE", 2**20)
    path = tmp_path / "bomb.csv.gz"
    path.write_bytes(gzip.compress(bytes(2**24)))
    with pytest.raises(DataError, match="larger than 1 MiB unpacked"):
        read_table(path)


@pytest.mark.parametrize("cut", [0, 12, -4])
def test_packed_tables_are_read_whole_or_refused(tmp_path, cut):
    text = "a,b\n" + "1,2\n" * 3000
    packed = gzip.compress(text[:4000].encode()) + gzip.compress(text[4000:].encode())
    path = tmp_path / "table.csv.gz"
    path.write_bytes(packed[: cut or None])
    if cut:
        with pytest.raises(DataError, match="cannot be read"):
            read_table(path)
    else:
        np.testing.assert_array_equal(read_table(path)["b"], np.full(3000, 2.0))


def npz(path, name="a.npy", content=None, method=zipfile.ZIP_DEFLATED):
    """A file of one array, made by hand."""
    buffer = io.BytesIO()
    np.save(buffer, np.arange(3.0))
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr(name, buffer.getvalue() if content is None else content)
    return path


def header(text):
    """An array's file with a header as it stands, and 24 bytes of numbers."""
    line = text.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(line).to_bytes(2, "little") + line + bytes(24)


def test_arrays_are_those_that_numpy_reads(tmp_path):
    arrays = {
        "a": np.arange(6.0).reshape(2, 3),
        "f": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "text": np.array("words"),
        "empty": np.zeros((0, 3)),
        "flags": np.array([1, 2], dtype=np.uint8),
    }
    np.savez_compressed(tmp_path / "a.npz", **arrays)
    found = read_arrays(tmp_path / "a.npz")
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({2**50},), }}", "has shape"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-3,), }", "has shape"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3,), }", "holds Python objects"),
        ("{'descr': 'nonsense', 'fortran_order': False, 'shape': (3,), }", "broken"),
        ("[" * 100, "broken"),
    ],
)
def test_arrays_that_are_not_what_they_say_are_refused(tmp_path, text, sentence):
    with pytest.raises(DataError, match=sentence):
        read_arrays(npz(tmp_path / "a.npz", content=header(text)))


def test_encrypted_arrays_and_other_ways_of_packing_are_refused(tmp_path):
    path = npz(tmp_path / "a.npz")
    content = bytearray(path.read_bytes())
    place = content.index(b"PK\x01\x02")
    content[place + 8] |= 1
    path.write_bytes(content)
    with pytest.raises(DataError, match="is encrypted"):
        read_arrays(path)
    with pytest.raises(DataError, match="packed in a way that NumPy does not write"):
        read_arrays(npz(tmp_path / "b.npz", method=zipfile.ZIP_BZIP2))


def test_a_dead_time_that_takes_all_memory_is_refused():
    with pytest.raises(ConfigurationError, match="dead_time"):
        ActuatorDynamics(dead_time=1e9)


def test_json_is_read_as_the_library_reads_it():
    values = {"a": [1, 2.5, None, True, "word", {"b": []}]}
    assert parse_json(json.dumps(values)) == values
