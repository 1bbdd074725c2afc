"""An export as C99: one header and one file of code, from translated functions and a step around them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...envs.storage import write_text
from .translator import Translator
from .types import REAL, Type, comments_of, number, struct_name, type_of

_WIDTH: Final = 110


@dataclass(frozen=True)
class Signal:
    """Numbers that go in or out of a step.

    Args:
        name: In words of one underscore each.
        place: Where they are in the struct, as "force.v" or "acceleration"; indexed where there are several.
        size: How many.
        kind: Name of their type in C: "real", "float" or "uint64_t".
        unit: SI unit.
        about: For people.
    """

    name: str
    place: str
    size: int
    kind: str
    unit: str
    about: str

    def entries(self) -> list[tuple[str, str]]:
        """Name and place of each number."""
        if self.size == 1:
            return [(self.name, self.place)]
        return [(f"{self.name}_{k + 1}", f"{self.place}[{k}]") for k in range(self.size)]


@dataclass(frozen=True)
class Source:
    """An export in C.

    Args:
        name: Of its files, and before every name in its header.
        about: One line for people.
        header: Text of the header.
        code: Text of the code.
        inputs: Of a step, in the order of ``NAME_input``.
        outputs: Of a step, in the order of ``NAME_output``.
        time_step: Between two steps, s.
        single: Whether its numbers are single precision.
        ahead: Times of the samples of preview in an input, s.
        initial: Outputs before the first step, by name, where they are not 0.
    """

    name: str
    about: str
    header: str
    code: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    time_step: float
    single: bool
    ahead: tuple[float, ...] = ()
    initial: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Steps:
    """The parts of an export that are written by hand around the translated functions.

    Args:
        about: One line for people.
        input: Fields of ``NAME_input``, as lines of C.
        output: Fields of ``NAME_output``.
        state: Fields of ``NAME_state``.
        types: Types that these fields need.
        inputs: What ``input`` holds.
        outputs: What ``output`` holds.
        tables: Arrays and functions of C before the steps.
        ahead: Times of the samples of preview in an input, s.
        begin: Body of ``NAME_init(NAME_state *state)``.
        step: Body of ``NAME_step(NAME_state *state, const NAME_input *input, NAME_output *output)``.
        time_step: Between two steps, s.
    """

    about: str
    input: Sequence[str]
    output: Sequence[str]
    state: Sequence[str]
    types: Sequence[Type]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    begin: Sequence[str]
    step: Sequence[str]
    time_step: float
    tables: Sequence[str] = ()
    ahead: tuple[float, ...] = ()
    initial: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


def write_files(source: Source, folder: Path) -> list[Path]:
    """Write header and code into a folder."""
    files = [folder / f"{source.name}.h", folder / f"{source.name}.c"]
    for path, text in zip(files, (source.header, source.code), strict=True):
        write_text(path, text)
    return files


def write_source(name: str, translator: Translator, steps: Steps, command: str) -> Source:
    """The text of header and code.

    Args:
        name: Of the export; a name of C.
        translator: With the functions that the steps call.
        steps: The steps.
        command: Of the command line that made it, for the first lines.
    """
    writer = _Writer(name, translator, steps, command)
    header, code = writer.header(), writer.code()
    return Source(
        name,
        steps.about,
        header,
        code,
        steps.inputs,
        steps.outputs,
        steps.time_step,
        translator.single,
        steps.ahead,
        steps.initial,
    )


class _Writer:
    def __init__(self, name: str, translator: Translator, steps: Steps, command: str) -> None:
        self._name, self._to, self._steps, self._command = name, translator, steps, command
        self._structs = translator.structs()
        self._tables = self._constants()
        public = self._reachable(steps.types)
        vectors = self._vectors()
        self._public = [one for one in vectors if one.name in public]
        self._private = [one for one in vectors if one.name not in public]
        self._public_structs = [one for one in self._structs if struct_name(one) in public]

    def _vectors(self) -> list[Type]:
        """Vectors, matrices and rows in use, those of the fields of structs first."""
        for struct in self._structs:
            for kind in self._to.fields(struct).values():
                self._to.helpers.use(kind)
                if kind.kind == "array" and kind.element is not None:
                    self._to.helpers.use(kind.element)
        for kind in self._steps.types:
            self._to.helpers.use(kind)
        return list(self._to.helpers.types.values())

    def _reachable(self, kinds: Sequence[Type]) -> set[str]:
        """Names of the types that the public structs hold."""
        found: set[str] = set()
        for kind in kinds:
            if kind.kind == "struct":
                found |= self._reachable(list(self._to.fields(kind.struct).values()))
            if not kind.is_scalar:
                found.add(kind.name)
        return found

    def header(self) -> str:
        """The header."""
        steps, guard = self._steps, f"{self._name.upper()}_H"
        public = {one.name for one in self._public} | {struct_name(one) for one in self._public_structs}
        prefix = {name: f"{self._name}_{name}" for name in (*public, "real")}
        kind = "float" if self._to.single else "double"
        lines = [
            f"/*\n * {steps.about}.\n *",
            f" * Made by: {self._command}",
            " * One step is one call. It allocates nothing, and needs no library but C's own mathematics.",
            " */",
            f"#ifndef {guard}\n#define {guard}\n",
            "#include <stdbool.h>\n#include <stdint.h>\n",
            f"/* Numbers: m, s, rad; x forward, y right, z down. */\ntypedef {kind} {self._name}_real;\n",
            *[_renamed(_vector(one), prefix) for one in self._public if one.kind != "array"],
            *[_renamed(self._struct(one), prefix) for one in self._public_structs],
            _renamed(_plain("input", f"{self._name}_input", steps.input, "What a step is given."), prefix),
            _renamed(_plain("output", f"{self._name}_output", steps.output, "What a step gives."), prefix),
            _renamed(
                _plain("state", f"{self._name}_state", steps.state, "What lasts from step to step."), prefix
            ),
            f"/* Time from one step to the next, s. */\n#define {self._name.upper()}_TIME_STEP "
            f"{number(steps.time_step, self._to.single)}\n",
            "/* Begin anew. */",
            f"void {self._name}_init({self._name}_state *state);\n",
            "/* One time step. */",
            f"void {self._name}_step({self._name}_state *state, const {self._name}_input *input, "
            f"{self._name}_output *output);\n",
            f"#endif /* {guard} */",
        ]
        return _wrapped("\n".join(lines)) + "\n"

    def code(self) -> str:
        """The code."""
        name, steps = self._name, self._steps
        private = [one for one in self._structs if one not in self._public_structs]
        aliases = [one.name for one in self._public] + [struct_name(one) for one in self._public_structs]
        rows = [one for one in self._private if one.kind == "array"]
        parts = [
            f"/*\n * {steps.about}.\n *\n * Made by: {self._command}\n"
            " * Numbers of equations are those of the paper that the project's documentation names.\n */",
            f'#include "{name}.h"\n\n#include <math.h>\n#include <stddef.h>',
            "\n".join(f"typedef {name}_{one} {one};" for one in ("real", *aliases)),
            *[_vector(one) for one in self._private if one.kind != "array"],
            *[_rows(one) for one in rows if one.element is not None and one.element.kind != "struct"],
            *[self._struct(one) for one in private],
            *[_rows(one) for one in rows if one.element is not None and one.element.kind == "struct"],
            "\n".join(self._to.numbers.values()),
            *self._tables,
            *self._to.helpers.definitions.values(),
            *[one.text for one in self._to.functions],
            *steps.tables,
            "\n".join([f"void {name}_init({name}_state *state) {{", *_indented(self._own(steps.begin)), "}"]),
            "\n".join(
                [
                    f"void {name}_step({name}_state *state, const {name}_input *input, "
                    f"{name}_output *output) {{",
                    *_indented(self._own(steps.step)),
                    "}",
                ]
            ),
        ]
        return _wrapped("\n\n".join(part for part in parts if part)) + "\n"

    def _own(self, lines: Sequence[str]) -> list[str]:
        return [one.replace("NAME_", f"{self._name}_") for one in lines]

    def _struct(self, struct: Any) -> str:
        comments = comments_of(struct)
        lines = []
        for name, kind in self._to.fields(struct).items():
            note = f" /* {comments[name]} */" if name in comments else ""
            lines.append(f"    {kind.declaration(name)};{note}")
        title = (struct.cls.__doc__ or "").strip().splitlines()
        document = re.sub(r":\w+:`[~.]*(?:\w+\.)*(\w+)`", r"\1", title[0]) if title else struct_name(struct)
        return (
            "\n".join([f"/* {document} */", "typedef struct {", *lines, f"}} {struct_name(struct)};"]) + "\n"
        )

    def _constants(self) -> list[str]:
        """Tables of the constants whose structs are in use."""
        texts: list[str] = []
        text = "\n".join([*(one.text for one in self._to.functions), *self._steps.begin, *self._steps.step])
        for name, value in self._to.constants.items():
            if re.search(rf"\b{name}\b", text):
                kind = type_of(value._cls)
                texts_of_arrays: list[str] = []
                body = self._initializer(value, kind, 1, name, texts_of_arrays)
                texts += [*texts_of_arrays, f"static const {kind.name} {name} = {body};"]
        return texts

    def _initializer(self, value: Any, kind: Type, depth: int, path: str, arrays: list[str]) -> str:
        """A value in C."""
        pad = "    " * depth
        if kind.kind == "struct":
            lines = []
            for name, inner in self._to.fields(kind.struct).items():
                text = self._initializer(getattr(value, name), inner, depth + 1, f"{path}_{name}", arrays)
                lines.append(f"{pad}.{name} = {text},")
            return "\n".join(["{", *lines, f"{'    ' * (depth - 1)}}}"])
        if kind.kind == "array":
            return self._array(value, kind, path, arrays)
        if kind.kind in ("vector", "matrix"):
            assert kind.element is not None
            return "{" + _nested(np.array(value).reshape(kind.shape), kind.element, self._to.single) + "}"
        return _scalar(value, kind, self._to.single)

    def _array(self, value: Any, kind: Type, path: str, arrays: list[str]) -> str:
        """A table of its own, and the pointer to it."""
        name, element = path.upper(), kind.element
        assert element is not None
        if value is None or value.size == 0:
            return "{NULL, {0, 0}}" if kind.shape == (2,) else "NULL"
        if element.kind == "struct":
            inner = [self._row(row, element, 1, name, arrays) for row in value.numpy()]
            arrays.append(f"static const {element.name} {name}[{len(inner)}] = {{{', '.join(inner)}}};")
            return name
        entries = value.numpy()
        text = ", ".join(_scalar(one, element, self._to.single) for one in entries.ravel())
        arrays.append(f"static const {element.name} {name}[{entries.size}] = {{{text}}};")
        return f"{{{name}, {{{entries.shape[0]}, {entries.shape[1]}}}}}" if kind.shape == (2,) else name

    def _row(self, row: Any, kind: Type, depth: int, path: str, arrays: list[str]) -> str:
        """A struct of a structured array."""
        lines = []
        for name, inner in self._to.fields(kind.struct).items():
            assert inner.element is not None
            values = np.array(row[name]).reshape(inner.shape)
            lines.append(f"    .{name} = {{{_nested(values, inner.element, self._to.single)}}},")
        return "\n".join(["{", *lines, "}"])


def _scalar(value: Any, kind: Type, single: bool) -> str:
    if kind.kind in ("int", "bool"):
        return str(int(value))
    if kind.kind == "uint64":
        return f"UINT64_C({int(value)})"
    return number(value, single or kind.kind == "float")


def _nested(values: Any, kind: Type, single: bool) -> str:
    if values.ndim == 0:
        return _scalar(values, kind, single)
    return "{" + ", ".join(_nested(one, kind, single) for one in values) + "}"


def array_text(name: str, values: Any, kind: str, single: bool) -> str:
    """A table of numbers in C."""
    values = np.asarray(values)
    shape = "".join(f"[{n}]" for n in values.shape)
    element = Type("float") if kind == "float" else REAL
    return f"static const {kind} {name}{shape} = {_nested(values, element, single)};"


def _vector(kind: Type) -> str:
    assert kind.element is not None
    shape = "".join(f"[{n}]" for n in kind.shape)
    field = "v" if kind.kind == "vector" else "m"
    return f"typedef struct {{\n    {kind.element.name} {field}{shape};\n}} {kind.name};\n"


def _rows(kind: Type) -> str:
    assert kind.element is not None
    constant = "const " if kind.constant else ""
    fields = f"    {constant}{kind.element.name} *data;\n    int32_t shape[2];"
    return f"typedef struct {{\n{fields}\n}} {kind.name};\n"


def _plain(what: str, name: str, lines: Sequence[str], about: str) -> str:
    return "\n".join([f"/* {about} */", "typedef struct {", *_indented(lines), f"}} {name};\n"])


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {one}" if one else "" for one in lines]


def _renamed(text: str, names: Mapping[str, str]) -> str:
    """Types by their public names, outside of comments."""
    pattern = re.compile(r"(/\*.*?\*/)|\b(" + "|".join(map(re.escape, names)) + r")\b", re.S)
    return pattern.sub(lambda found: found.group(1) or names[found.group(2)], text)


def _wrapped(text: str) -> str:
    """Lines of at most :data:`_WIDTH` characters, broken behind commas and before operators."""
    return "\n".join(part for line in text.splitlines() for part in _parts(line))


def _parts(line: str) -> list[str]:
    pad = " " * (len(line) - len(line.lstrip()) + 4)
    parts = []
    while len(line) > _WIDTH and not line.lstrip().startswith(("/*", " *", "*")):
        cut = max(line.rfind(", ", len(pad) + 4, _WIDTH) + 1, line.rfind(" + ", len(pad) + 4, _WIDTH))
        cut = max(cut, line.rfind(" && ", len(pad) + 4, _WIDTH), line.rfind(" - ", len(pad) + 4, _WIDTH))
        if cut <= len(pad):
            break
        parts.append(line[:cut])
        line = pad + line[cut:].lstrip()
    return [*parts, line]
