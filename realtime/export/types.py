"""Types of kernels as types of C, and their values as initializers."""

from __future__ import annotations

import inspect
import io
import re
import textwrap
import tokenize
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import warp as wp

from ...envs.arrays import real


@dataclass(frozen=True)
class Type:
    """A type of a kernel's value.

    Args:
        kind: "int", "real", "float", "bool", "uint64", "void", "vector", "matrix", "struct" or "array".
        element: Of a vector, matrix or array.
        shape: Of a vector or matrix; of an array, its number of dimensions.
        struct: Warp's struct.
        constant: Whether an array is only read.
    """

    kind: str
    element: Type | None = None
    shape: tuple[int, ...] = ()
    struct: Any = None
    constant: bool = False

    @property
    def name(self) -> str:
        """Its name in C."""
        if self.kind in _SCALAR_NAMES:
            return _SCALAR_NAMES[self.kind]
        if self.kind == "struct":
            return struct_name(self.struct)
        assert self.element is not None
        if self.kind == "array":
            prefix = "const_" if self.constant else ""
            return f"{prefix}{self.element.kind if not self.element.struct else self.element.name}_rows"
        ending = {"real": "", "float": "f", "int": "i"}[self.element.kind]
        return ("vec" if self.kind == "vector" else "mat") + "".join(map(str, self.shape)) + ending

    @property
    def is_scalar(self) -> bool:
        """Whether it is a number."""
        return self.kind in _SCALAR_NAMES

    def declaration(self, name: str) -> str:
        """The declaration of a variable."""
        if self.kind == "array" and self.shape == (1,):
            assert self.element is not None
            return f"{'const ' if self.constant else ''}{self.element.name} *{name}"
        return f"{self.name} {name}"


@dataclass(frozen=True)
class Code:
    """An expression of C.

    Args:
        text: Its text.
        type: Its type.
        strength: How strongly its outermost operator binds.
        path: The constant that it is, as "MACHINE.geometry"; None for none.
        variable: Whether it has an address.
    """

    text: str
    type: Type
    strength: int = 10
    path: str | None = None
    variable: bool = False

    def within(self, strength: int) -> str:
        """Its text as an operand of an operator that binds so strongly."""
        return self.text if self.strength >= strength else f"({self.text})"


_GENERIC: Final = ("Step", "Command")
"""Names of structs of more than one package."""


def struct_name(struct: Any) -> str:
    """The name of a struct in C: its own, after its package's where several have it."""
    if struct.key not in _GENERIC:
        return str(struct.key)
    packages = [one for one in struct.cls.__module__.split(".")[:-1] if one != "kernels"]
    return f"{packages[-1].capitalize()}{struct.key}"


_SCALAR_NAMES: Final = {
    "int": "int32_t",
    "real": "real",
    "float": "float",
    "bool": "bool",
    "uint64": "uint64_t",
    "void": "void",
}

INT, REAL, FLOAT, BOOL = Type("int"), Type("real"), Type("float"), Type("bool")
UINT64, VOID = Type("uint64"), Type("void")


def type_of(given: Any, field: bool = False) -> Type:
    """The type that an annotation or a Warp type stands for.

    Args:
        given: Warp's or Python's type.
        field: Whether it is that of a struct's field, whose arrays are only read.
    """
    simple = {int: INT, wp.int32: INT, bool: BOOL, wp.bool: BOOL, wp.uint64: UINT64, None: VOID}
    if given is real or given is float:
        return REAL
    if given is wp.float32:
        return FLOAT
    if given in simple:
        return simple[given]
    if isinstance(given, wp.array):
        return Type("array", type_of(given.dtype), (given.ndim,), constant=field)
    if hasattr(given, "vars") and hasattr(given, "key"):
        return Type("struct", struct=given)
    shape = getattr(given, "_shape_", None)
    if shape is None:
        raise TypeError(f"{given!r} has no form in C")
    return Type("vector" if len(shape) == 1 else "matrix", type_of(given._wp_scalar_type_), tuple(shape))


def fields_of(struct: Any) -> dict[str, Type]:
    """Fields of a struct, in order."""
    return {name: type_of(variable.type, field=True) for name, variable in struct.vars.items()}


def comments_of(struct: Any) -> dict[str, str]:
    """The comment behind each field of a struct, in its source; none for one that is made by a program."""
    try:
        source = textwrap.dedent(inspect.getsource(struct.cls))
    except (OSError, TypeError):
        return {}
    found: dict[str, str] = {}
    lines = source.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            field = re.match(r"\s*(\w+)\s*:", lines[token.start[0] - 1])
            if field:
                found[field.group(1)] = token.string.lstrip("# ")
    return found


def about(text: str | None) -> str:
    """A docstring as the text of a comment in C, its references as plain names."""
    plain = re.sub(r":\w+:`[~.]*(?:\w+\.)*(\w+)`", r"\1", inspect.cleandoc(text or ""))
    return plain.replace("``", "").replace("*/", "* /")


def number(value: Any, single: bool) -> str:
    """A floating-point number of C that reads back as the same bits."""
    value = float(getattr(value, "value", value))
    if np.isinf(value):
        return "(real)INFINITY" if value > 0.0 else "-(real)INFINITY"
    text = str(np.float32(value)) if single else repr(value)
    if not set(text) & set(".en"):
        text += ".0"
    return text + ("f" if single else "")
