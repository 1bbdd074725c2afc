"""What tyro says about arguments in plain words: what is wrong with them, and its help."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

_ONE: Final = {"FLOAT": "a number", "INT": "a whole number"}
_MANY: Final = {"FLOAT": "numbers", "INT": "whole numbers"}


def plain_complaint(panel: str) -> str:
    """The sentences of a panel of tyro's, without its frame, the help of the option and internal types.

    Args:
        panel: What tyro wrote; the frame's first line is its title.
    """
    plain = re.sub(r"\x1b\[[0-9;]*m", "", panel)
    rows = [row.strip("│╭╮╰╯─| ") for row in plain.splitlines()[1:]]
    # Terminals without box characters get rules of ASCII; a `-` within words belongs to an option.
    text = " ".join(row for row in rows if row.strip("+-")).split("For full helptext")[0]
    told, _, suggested = text.partition("Perhaps you meant:")
    near = dict.fromkeys(re.findall(r"(?<!\S)--[a-z][a-z-]*", suggested))
    hint = f" Did you mean {' or '.join(near)}?" if near else ""
    return f"{_reworded(told.strip()).rstrip('.')}.{hint}"


def plain_help(text: str) -> str:
    """Tyro's help without what stands for an option that is not given; its own text says what then happens.

    Everything keeps its place, so that frames stay whole.

    Args:
        text: What tyro wrote for ``--help``.
    """

    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\s│|]", " ", found[0])

    def bare(found: re.Match[str]) -> str:
        return found[1].strip("{}").ljust(len(found[0]))

    # The width of the terminal may break a line within the brackets.
    text = re.sub(r"\(default:[\s│|]*(?:None)?\)", blank, text)
    return re.sub(r"\{None\}\|(\{[^}]*\}|[A-Z]+)", bare, text)


def _reworded(told: str) -> str:
    for pattern, sentence in _SENTENCES.items():
        found = re.match(pattern, told)
        if found:
            return sentence(found)
    return told


def _wrong_type(found: re.Match[str]) -> str:
    """Of an option with several types or values, such as ``{None}|{INT INT}``."""
    kinds = found["kinds"].replace("{None}|", "").strip("{}").split()
    return f"{found['option']} takes {_expected(kinds)}, found {found['value'].replace(',', '')}"


def _expected(kinds: list[str]) -> str:
    if len(kinds) == 1:
        return _ONE.get(kinds[0], kinds[0])
    alike = len(set(kinds)) == 1 and kinds[0] in _MANY
    return f"{len(kinds)} {_MANY[kinds[0]]}" if alike else " ".join(kinds)


def _missing(found: re.Match[str]) -> str:
    """Each missing option is told by its name, its values, its help and `(required)`."""
    names = [part.split()[0] for part in found["options"].split("(required)") if part.strip()]
    rest = found["rest"].strip()
    return f"{', '.join(names)} must be given" + (f". {rest}" if rest else "")


_SENTENCES: Final[dict[str, Callable[[re.Match[str]], str]]] = {
    r"Error parsing (--\S+): could not convert string to float: ('.*?')": lambda found: (
        f"{found[1]} takes a number, found {found[2]}"
    ),
    r"Error parsing (--\S+): invalid literal for int\(\) with base 10: ('.*?')": lambda found: (
        f"{found[1]} takes a whole number, found {found[2]}"
    ),
    r"Error parsing (?P<option>--\S+): no type matching (?P<kinds>.*?) could be instantiated from "
    r"\[(?P<value>.*?)\]": _wrong_type,
    # What a configuration says of its fields; its class is of no interest here.
    r"Error parsing [^-]\S*: \w+: (.*)": lambda found: found[1],
    r"Missing value for argument '(.*?)'\. Expected (\d+) values": lambda found: (
        f"{found[1]} needs {'a value' if found[2] == '1' else found[2] + ' values'} after it"
    ),
    r"Missing from [^:]*: (?P<options>.*\(required\))(?P<rest>.*)": _missing,
}
