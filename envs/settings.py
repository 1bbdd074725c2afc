"""Configurations: frozen, checked dataclasses that round-trip through YAML.

A configuration class is a pydantic dataclass made with :func:`configuration`: unknown fields, wrong
types, NaN and infinity are refused when it is made. Ranges are declared with the types below.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar, get_args, get_type_hints

import yaml
from pydantic import AliasChoices, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass
from typing_extensions import dataclass_transform

from .errors import ConfigurationError, DataError, UnknownNameError, reason, suggest
from .limits import LARGEST_TEXT, parse_yaml, read_bytes
from .storage import write_text

_STRICT: Final = ConfigDict(extra="forbid", allow_inf_nan=False, validate_default=True)

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]

T = TypeVar("T")


def renamed(name: str, *before: str, **more: Any) -> Any:
    """Metadata of a field that had other names in files of earlier versions; those are still read.

    Args:
        name: Its name.
        before: Its earlier names.
        more: Its ``default`` or ``default_factory``, where it has one.
    """
    return Field(validation_alias=AliasChoices(name, *before), **more)


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def configuration(cls: type[T]) -> type[T]:
    """Make a class a configuration; the decorator.

    Raises:
        ConfigurationError: when an object of it is made, or replaced, with a field that is unknown,
            missing, of the wrong type or out of range.
    """
    made: Any = dataclass(frozen=True, config=_STRICT)(cls)
    check = made.__init__

    @functools.wraps(check)
    def checked(self: Any, /, *values: Any, **fields: Any) -> None:
        try:
            check(self, *values, **fields)
        except ValidationError as error:
            raise ConfigurationError(f"{made.__name__}: {describe(error, made)}") from None

    made.__init__ = checked
    return made  # type: ignore[no-any-return]


def check_names(kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Refuse a field with a name that is not known, where a configuration is made."""
    known = list(known)
    for name in names:
        if name not in known:
            raise ValueError(str(UnknownNameError(kind, name, known)))


def check_range(name: str, limits: Vector2) -> None:
    """Refuse a field whose limits are not low and high, where a configuration is made."""
    if limits[0] > limits[1]:
        raise ValueError(f"{name} must be a range from low to high, found {list(limits)}")


def from_dict(cls: type[T], values: object, source: str = "configuration") -> T:
    """Make ``cls`` of nested plain values.

    Raises:
        ConfigurationError: naming ``source``, each wrong field and, for an unknown one, the nearest known.
    """
    if not isinstance(values, dict):
        if isinstance(values, cls):
            return values
        raise ConfigurationError(
            f"{source}: expected fields of {cls.__name__}, found {type(values).__name__}"
        )
    try:
        return TypeAdapter(cls).validate_python(values)
    except ValidationError as error:
        raise ConfigurationError(f"{source}: {describe(error, cls)}") from None


def describe(error: ValidationError, cls: type[Any]) -> str:
    """One sentence a wrong field, with its path, what was found and what is allowed."""
    return "; ".join(_describe_one(dict(item), cls) for item in error.errors())


def message_of(item: Mapping[str, Any]) -> str:
    """What Pydantic says of one wrong field, in the words of a user."""
    if item["type"] in ("too_short", "too_long"):
        counts = item["ctx"]
        least = item["type"] == "too_short"
        bound = f"at least {counts['min_length']}" if least else f"at most {counts['max_length']}"
        return f"must have {bound} entries, found {counts['actual_length']}"
    return str(item["msg"]).removeprefix("Value error, ")


def _known_fields(cls: type[Any], path: tuple[int | str, ...]) -> list[str]:
    """Fields of the innermost configurations on the way to ``path``."""
    found = [cls]
    for part in path[:-1]:
        hints = [get_type_hints(owner).get(str(part)) for owner in found]
        # Pydantic puts the class of a member of a union into the path.
        members = [member for member in found if member.__name__ == part]
        found = [inner for hint in hints for inner in _configurations(hint)] or members or found
    return list(dict.fromkeys(field.name for owner in found for field in dataclasses.fields(owner)))


def _configurations(hint: Any) -> list[type[Any]]:
    """The configuration classes in a type: itself, or those of its tuple, list or union."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return [hint]
    return [found for inner in get_args(hint) for found in _configurations(inner)]


def _describe_one(item: dict[str, Any], cls: type[Any]) -> str:
    where, names = item["loc"], [field.name for field in dataclasses.fields(cls)]
    if item["type"] == "unexpected_positional_argument":
        return f"value number {where[0] + 1} is too many; the fields are {', '.join(names)}"
    if where and isinstance(where[0], int):
        # A value given by its place instead of by its name.
        where = (names[where[0]], *where[1:])
    path = ".".join(map(str, where))
    if item["type"] == "unexpected_keyword_argument":
        return f"unknown field {path!r}. {suggest(str(where[-1]), _known_fields(cls, where))}"
    if item["type"] == "missing":
        return f"field {path!r} is missing"
    if item["type"] == "multiple_argument_values":
        return f"field {path!r} is given twice, by its place and by its name"
    message = message_of(item)
    text = f"field {path!r}: {message}" if path else message
    # The check of a whole configuration says itself what it found.
    whole = item["type"] == "value_error" and (not path or isinstance(item["input"], dict))
    whole |= item["type"] in ("too_short", "too_long")
    return text if whole else f"{text} (found {item['input']!r})"


def to_dict(config: Any) -> dict[str, Any]:
    """Plain nested values of a configuration, as YAML and JSON hold them."""
    values = TypeAdapter(type(config)).dump_python(config, mode="json")
    assert isinstance(values, dict)
    return values


def load(cls: type[T], path: str | Path) -> T:
    """Read a configuration from a YAML file.

    Raises:
        DataError: the file cannot be read or is not YAML.
        ConfigurationError: a field is unknown, missing or out of range.
    """
    return from_dict(cls, read_yaml(path), str(path))


def read_yaml(path: str | Path) -> object:
    """The values in a YAML file.

    Raises:
        DataError: the file cannot be read or is not YAML.
    """
    try:
        text = read_bytes(path, LARGEST_TEXT).decode("utf-8")
        return parse_yaml(text)
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    except yaml.YAMLError as error:
        raise DataError(f"{path}: not YAML ({_yaml_problem(error, text)})") from None


def _yaml_problem(error: yaml.YAMLError, text: str) -> str:
    """The line, counted from 1, and what is wrong in it."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        return f"line {error.problem_mark.line + 1}: {error.problem}"
    if isinstance(error, yaml.reader.ReaderError):
        return f"line {text.count(chr(10), 0, error.position) + 1}: {error.reason}"
    return str(error).splitlines()[0]


def save(config: Any, path: str | Path) -> None:
    """Write a configuration as YAML, whole or not at all."""
    write_text(path, yaml.safe_dump(to_dict(config), sort_keys=False))


def merge(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """``below`` with what ``above`` sets; mappings within are merged alike."""
    merged = dict(below)
    for key, value in above.items():
        inner = merged.get(key)
        both = isinstance(inner, Mapping) and isinstance(value, Mapping)
        merged[key] = merge(inner, value) if both else value  # type: ignore[arg-type]
    return merged


def preset_names(folder: Path) -> list[str]:
    """Names of the parameter sets in a folder."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def named(cls: type[Any], values: object, path: str | Path) -> object:
    """Values of a user's parameter file, in which ``name`` and ``description`` may stand or not.

    Args:
        cls: The configuration it is of.
        values: That stand in the file.
        path: Of the file; its stem is the name unless one is given.
    """
    if not isinstance(values, dict):
        return values
    known = {field.name for field in dataclasses.fields(cls)}
    if "algorithm" not in known and values.get("algorithm") == "classical":
        # A file without an algorithm is a classical washout's, and may say so.
        values = {name: value for name, value in values.items() if name != "algorithm"}
    if "name" in known:
        return {"name": Path(path).stem, "description": f"set of {path}", **values}
    return {name: value for name, value in values.items() if name not in ("name", "description")}
