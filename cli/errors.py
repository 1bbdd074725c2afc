"""Errors of arguments in one sentence: the option, its value, and how to mend it."""

from __future__ import annotations

import difflib
import types
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

import pydantic
from cyclopts import (
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    Parameter,
    RepeatArgumentError,
    UnknownOptionError,
    UnusedCliTokensError,
)
from cyclopts.argument import Argument
from cyclopts.exceptions import ConsumeMultipleError

from ..envs.errors import ConfigurationError
from ..envs.settings import message_of
from .arguments import whole_number, with_flags

_GOES_ON: Final = "--resume is not needed now: a command goes on from what is in --out"
OLD_FLAGS: Final[Mapping[str, Mapping[str, str]]] = {
    "evaluate": {"--paper": "--paper is a command of its own now: motion-cueing paper"},
    "train": {
        "--search": "--search is a command of its own now: motion-cueing search --trials N",
        "--population": "--population is a command of its own now: motion-cueing population --members N",
    },
    "benchmark": {
        "--maneuvers": "the benchmark's drives are fixed; `motion-cueing evaluate --policies benchmark "
        "--maneuvers ...` drives its policies in others",
        "--car": "the benchmark's cars are fixed; `motion-cueing evaluate --policies benchmark --car ...` "
        "drives its policies in another",
    },
    "robustness": {"--fierceness": "--fierceness is called --time-scaling now"},
    "tune": {"--budget": "--budget is called --hours now"},
    "endure": {"--only": "--only is called --seeds now"},
    "demonstrate": {"--random": "--random is called --drives now"},
    "export": {"--onnx": "--onnx is called --out now"},
    "": {
        "--resume": _GOES_ON,
        "--threads": "--threads is called --workers now",
        "--jobs": "--jobs is called --workers now",
    },
}
"""What an option of earlier versions is called now, by command; those of "" are common."""


def complaint(command: str, error: CycloptsError) -> ConfigurationError:
    """The parser's error as a sentence."""
    return ConfigurationError(f"{_sentence(command, error)} See `motion-cueing {command} --help`")


def _sentence(command: str, error: CycloptsError) -> str:
    argument = error.argument
    if isinstance(error, UnknownOptionError):
        return _unknown(command, error.token.keyword or error.token.value, _flags(error.argument_collection))
    if isinstance(error, UnusedCliTokensError):
        return f"{' '.join(error.unused_tokens or ())!r} belongs to no option."
    if isinstance(error, RepeatArgumentError):
        return f"{error.token.keyword} is given more than once; give it once."
    if isinstance(error.__cause__, pydantic.ValidationError) and error.app is not None:
        return _of_configuration(error.__cause__, error.app.assemble_argument_collection())
    if argument is None:
        return str(error)
    if isinstance(error, ConsumeMultipleError):
        return f"{argument.name} needs at least one value after it."
    if isinstance(error, MissingArgumentError):
        return _missing(command, error, argument)
    if isinstance(error, CoercionError):
        return _wrong(argument, " ".join(token.value for token in argument.tokens))
    return str(error)


def _flags(arguments: Iterable[Argument]) -> list[str]:
    return sorted({name for argument in arguments for name in argument.names if name.startswith("--")})


def _unknown(command: str, flag: str, flags: list[str]) -> str:
    """An option that does not exist: its name of today, or near ones."""
    flag = flag.split("=", 1)[0]
    old = OLD_FLAGS.get(command, {}).get(flag) or OLD_FLAGS[""].get(flag)
    if old is not None:
        return f"{old}."
    plural = next((name for name in (f"{flag}s", f"{flag.removesuffix('y')}ies") if name in flags), None)
    if plural is not None:
        return f"{flag} is called {plural} now."
    singular = next((name for name in flags if flag in (f"{name}s", f"{name.removesuffix('y')}ies")), None)
    if singular is not None:
        return f"{command} takes one: {flag} is called {singular} here."
    near = difflib.get_close_matches(flag, flags, n=2, cutoff=0.6)
    return f"unknown option {flag}." + (f" Did you mean {' or '.join(near)}?" if near else "")


def _missing(command: str, error: MissingArgumentError, argument: Argument) -> str:
    """A value that is missing; an unknown option is reported first, for it may have been meant."""
    if error.keyword is not None:
        if _length(argument.hint) == 1:
            return f"{argument.name} needs a value after it."
        return _wrong(argument, " ".join(token.value for token in argument.tokens) or "none")
    flags = _flags(error.app.assemble_argument_collection()) if error.app is not None else []
    words = error.root_input_tokens or []
    strange = next((w for w in words if w.startswith("--") and w.split("=", 1)[0] not in flags), None)
    if strange is not None:
        return _unknown(command, strange, flags)
    if argument.name == "--algorithm" and words and not words[0].startswith("-"):
        return f"the algorithm is named by an option now: --algorithm {words[0]}."
    metavar = (getattr(argument.parameter, "metavar", None) or "").removesuffix(" ...")
    return f"{argument.name} must be given{': ' if metavar else ''}{metavar}."


def _wrong(argument: Argument, found: str) -> str:
    """A value of another kind than the option takes."""
    near = difflib.get_close_matches(found, _choices(argument.hint), n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    return f"{argument.name} takes {_kind(argument.hint, argument.parameter)}, found {found!r}.{hint}"


def _of_configuration(error: pydantic.ValidationError, arguments: Iterable[Argument]) -> str:
    """What a configuration says of its first wrong field, which is an option here."""
    arguments = list(arguments)
    wrong = error.errors()[0]
    flag = "--" + str(wrong["loc"][0]).replace("_", "-")
    argument = next((one for one in arguments if flag in one.names), None)
    found = str(wrong["input"])
    fields = [name[2:].replace("-", "_") for name in _flags(arguments)]
    message = with_flags(message_of(wrong).replace("Input should be", "must be"), fields)
    if wrong["type"] in ("too_short", "too_long"):
        return f"{flag} {message}."
    if argument is not None and wrong["type"].endswith(("_parsing", "literal_error")):
        return _wrong(argument, found)
    return f"{flag} {message}, found {found}."


def _plain(hint: Any) -> Any:
    """A type without its annotation and without None."""
    if get_origin(hint) is Annotated:
        return _plain(get_args(hint)[0])
    if get_origin(hint) in (Union, types.UnionType):
        kinds = [kind for kind in get_args(hint) if kind is not type(None)]
        return _plain(kinds[0]) if len(kinds) == 1 else hint
    return hint


def _length(hint: Any) -> int:
    """How many values a type takes; 1 where that is open."""
    plain = _plain(hint)
    inner = get_args(plain)
    return len(inner) if get_origin(plain) is tuple and Ellipsis not in inner else 1


def _choices(hint: Any) -> list[str]:
    plain = _plain(hint)
    return [str(choice) for choice in get_args(plain)] if get_origin(plain) is Literal else []


def _kind(hint: Any, parameter: Parameter) -> str:
    """What a type takes, in words."""
    plain, many = _plain(hint), _length(hint)
    inner = _plain(get_args(plain)[0]) if get_origin(plain) is tuple else plain
    words = {int: "whole number", float: "number", Path: "path", str: "name"}
    noun = "whole number" if parameter.converter is whole_number else words.get(inner, "value")
    if _choices(hint):
        return f"one of {', '.join(_choices(hint))}"
    if many > 1:
        return f"{many} {noun}s"
    return f"{noun}s" if get_origin(plain) is tuple else f"a {noun}"
