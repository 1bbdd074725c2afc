"""Tables for people: no number is cut, whatever the width."""

from __future__ import annotations

import io
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from motion_cueing.evaluation.reporting.text import (
    NOTHING,
    TextTable,
    degrees,
    fraction,
    how_many,
    markdown,
    microseconds,
    number,
    percent,
    print_table,
    save_markdown,
    seconds,
    table_console,
)

HEADER = ("policy", "J", "tilt rate above 3 deg/s %", *(f"step mean µs {i}" for i in range(12)), "max µs")
ROWS = tuple(
    (name, *(f"{1000 * i + 7 * k + 1234567}" for k in range(len(HEADER) - 1)))
    for i, name in enumerate(("no-motion", "optimal-washout-tuned", "optimum"))
)


def shown(table, width):
    console = Console(width=width, file=io.StringIO())
    print_table(console, table)
    return console.file.getvalue()


def words(text):
    return re.findall(r"[\w.-]+", text)


@pytest.mark.parametrize("width", [40, 60, 80, 100, 180, 5000])
def test_every_number_is_shown_whole_beside_its_name(width):
    text = shown(TextTable("A title", HEADER, ROWS), width)
    assert "…" not in text
    assert max(len(line) for line in text.splitlines()) <= width
    for row in ROWS:
        lines = [words(line) for line in text.splitlines() if row[0] in words(line)]
        assert [cell for line in lines for cell in line[1:]] == list(row[1:])


def test_what_has_room_is_one_table_with_headers_in_one_line():
    text = shown(TextTable("A title", HEADER, ROWS), 5000)
    assert text.count("no-motion") == text.count("A title") == 1
    assert "tilt rate above 3 deg/s %" in text
    assert shown(TextTable("A title", HEADER, ROWS), 80).count("continued") >= 2


@settings(max_examples=40)
@given(st.integers(30, 400), st.lists(st.integers(1, 10), min_size=1, max_size=15))
def test_no_digit_is_lost_at_any_width(width, sizes):
    row = ("mine", *("8" * size for size in sizes))
    header = ("policy", *("of a long name" for _ in sizes))
    text = shown(TextTable("", header, (row,)), width)
    assert text.count("8") == sum(sizes)


def test_a_pipe_has_room_for_every_table(capsys):
    header = ("policy", *(f"a header of some length {i}" for i in range(40)))
    print_table(table_console(), TextTable("", header, (("mine", *("1" for _ in header[1:])),)))
    assert len(capsys.readouterr().out.splitlines()) == 5


def test_markdown_has_lines_below_the_table_and_titles_above_several(tmp_path):
    table = TextTable("A title", ("policy", "J"), (("a|b", "1"),), (0,))
    save_markdown(tmp_path / "one.md", table, "Skipped: mine: no solver")
    lines = (tmp_path / "one.md").read_text().splitlines()
    assert lines == ["| policy | J |", "|---|---|", "| **a\\|b** | **1** |", "", "Skipped: mine: no solver"]
    save_markdown(tmp_path / "two.md", table, table)
    once = f"**A title**\n\n{markdown(table)}\n"
    assert (tmp_path / "two.md").read_text() == f"{once}\n{once}"


def test_numbers_and_their_nouns():
    assert (how_many(1, "drive"), how_many(2, "drive"), how_many(0, "drive")) == (
        "1 drive",
        "2 drives",
        "0 drives",
    )
    assert number(float("nan")) == number(None) == NOTHING
    assert (number(1e-6), number(0.0), number(12.345)) == ("1.00e-06", "0.00", "12.3")


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.0, "0.00"), (1.2345, "1.23"), (12.345, "12.3"), (123.4, "123"), (0.012345, "0.012")],
)
def test_numbers_have_three_digits(value, text):
    assert number(value) == text


@pytest.mark.parametrize("text", [number, percent, degrees, fraction, seconds, microseconds])
def test_what_is_undefined_is_a_dash(text):
    assert text(None) == text(float("nan")) == NOTHING
