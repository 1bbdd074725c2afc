"""Broken files of every kind are read, or refused in one sentence.

`python -m benchmarks.fuzz_readers` does the same for as long as one likes.
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from .fuzzing import READERS, attack


@pytest.mark.parametrize("name", READERS)
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_broken_files_are_refused_in_a_sentence(tmp_path_factory, name, seed):
    attack(name, seed, tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("name", READERS)
def test_unbroken_files_are_read(tmp_path, name):
    reader = READERS[name]
    path = tmp_path / f"whole{reader.suffix}"
    path.write_bytes(reader.whole())
    reader.read(path)
