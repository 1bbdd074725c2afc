"""A translator from Warp functions to C99: what is exported is what the simulator runs.

Kernels are written in a small part of Python: typed arguments, structs, vectors and matrices, assignments,
``if``, ``while``, loops over ``range``, and calls. Each function becomes a ``static`` function of C with the
same name, the same docstring and the same names of its variables. Structs keep the fields that are used.

**Constants.** A struct that is bound with :meth:`Translator.bind`, such as the machine, becomes a table.
Functions that take it read the table instead, and branches that its integers switch off are left out. So are
arguments that nothing reads.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
import warp as wp

from ...envs.arrays import real
from ...envs.errors import MotionCueingError
from .helpers import Helpers
from .pruning import Pruner, assigned_in, flows_to, nodes_of, root_of, without, without_unread
from .types import (
    BOOL,
    FLOAT,
    INT,
    REAL,
    UINT64,
    VOID,
    Code,
    Type,
    about,
    fields_of,
    number,
    struct_name,
    type_of,
)

_RESERVED: Final = frozenset(
    [
        "auto",
        "case",
        "char",
        "const",
        "default",
        "do",
        "double",
        "enum",
        "extern",
        "float",
        "goto",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "real",
        "main",
    ]
)

_BINARY: Final[dict[type[ast.operator], tuple[str, int]]] = {
    ast.Add: ("+", 7),
    ast.Sub: ("-", 7),
    ast.Mult: ("*", 8),
    ast.Div: ("/", 8),
    ast.BitOr: ("|", 4),
    ast.BitAnd: ("&", 5),
}

_COMPARED: Final[dict[type[ast.cmpop], str]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}

_PRIMARY: Final = 10
_UNARY: Final = 9


class TranslationError(MotionCueingError, NotImplementedError):
    """A function uses a part of Python that has no form in C here."""


@dataclass
class Translated:
    """A function of C.

    Args:
        name: Its name.
        result: Type of its value.
        text: Its definition.
        passed: Which arguments of the Warp function it takes, by name, with their types.
    """

    name: str
    result: Type
    text: str = ""
    passed: dict[str, Type] = field(default_factory=dict)


class Translator:
    """Functions, structs and constants of one export.

    Args:
        single: Whether numbers are single precision.

    Attributes:
        functions: In the order of their definition.
        constants: Tables by name.
        helpers: Operations on vectors and matrices that the functions use.
    """

    def __init__(self, single: bool = False) -> None:
        self.single = single
        self.functions: list[Translated] = []
        self.constants: dict[str, Any] = {}
        self.numbers: dict[str, str] = {}
        self.helpers = Helpers(single)
        self._known: dict[Any, Translated] = {}
        self._used: dict[str, set[str]] = {}
        self._structs: dict[str, Any] = {}
        self._places: dict[str, list[str]] = {}

    def bind(self, name: str, value: Any) -> None:
        """Make a struct's value a table called ``name``."""
        self.constants[name] = value
        self._places = {}
        for table, known in self.constants.items():
            for path, key in _structs_in(table, known):
                self._places.setdefault(key, []).append(path)

    def is_single(self, struct: Any) -> bool:
        """Whether one place alone in all tables holds a value of this struct."""
        return len(self._places.get(struct_name(struct), ())) == 1

    def value(self, path: str) -> Any:
        """The constant at a path."""
        name, *fields = path.split(".")
        value = self.constants[name]
        for one in fields:
            value = getattr(value, one)
        return value

    def use(self, struct: Any, *names: str) -> None:
        """Keep fields of a struct; all of them where none is named."""
        self.struct(struct)
        self._used[struct_name(struct)].update(names or struct.vars)
        for name in names or struct.vars:
            kind = fields_of(struct)[name]
            inner = kind.element if kind.kind == "array" and kind.element is not None else kind
            if inner.kind == "struct":
                self.struct(inner.struct)

    def struct(self, struct: Any) -> None:
        """Take a struct into the export."""
        known = self._structs.setdefault(struct_name(struct), struct)
        if known is not struct:
            raise TranslationError(f"two structs are called {struct_name(struct)}")
        self._used.setdefault(struct_name(struct), set())

    def call(self, function: Any, *arguments: Code) -> Code:
        """A call of a Warp function, which is translated if it is not yet."""
        pre: list[str] = []
        known = self.translated(function, list(arguments))
        code = self.call_of(known, function, list(arguments), pre)
        if pre:
            raise TranslationError(f"call of {function.key}: give variables for its structs")
        return code

    def fields(self, struct: Any) -> dict[str, Type]:
        """Fields of a struct that are used, in order; the first of one that has none."""
        known, used = fields_of(struct), self._used[struct_name(struct)]
        kept = {name: kind for name, kind in known.items() if name in used}
        return kept or dict(list(known.items())[:1])

    def structs(self) -> list[Any]:
        """Structs in the order of their definition."""
        ordered: list[Any] = []

        def visit(struct: Any) -> None:
            if struct in ordered:
                return
            self.struct(struct)
            for kind in self.fields(struct).values():
                inner = kind.element if kind.kind == "array" and kind.element is not None else kind
                if inner.kind == "struct":
                    visit(inner.struct)
            ordered.append(struct)

        for struct in list(self._structs.values()):
            visit(struct)
        return ordered

    def translated(self, function: Any, arguments: list[Code]) -> Translated:
        """A Warp function for arguments, of which some are constants."""
        names = list(inspect.signature(function.func).parameters)
        if len(arguments) != len(names):
            raise TranslationError(f"{function.key}: {len(arguments)} arguments of {len(names)}")
        bound = tuple(one.path if self._is_bound(one) else None for one in arguments)
        kinds = tuple(
            one.type if annotation == "Any" else None
            for one, annotation in zip(arguments, _annotations(function), strict=True)
        )
        key = (function.func, bound, kinds)
        if key not in self._known:
            name = self._name(function, kinds)
            self._known[key] = _Function(self, function, arguments, bound).translate(name)
            self.functions.append(self._known[key])
        return self._known[key]

    def _is_bound(self, one: Code) -> bool:
        """Whether a function reads an argument as a table: there is one of its kind, or it is a whole one."""
        if one.path is None or one.type.kind != "struct":
            return False
        return "." not in one.path or self.is_single(one.type.struct)

    def call_of(self, known: Translated, function: Any, arguments: list[Code], pre: list[str]) -> Code:
        """A call of a translated function; ``pre`` takes the variables it needs before."""
        names = inspect.signature(function.func).parameters
        given = [
            self._passed(one, known.passed[name], pre)
            for name, one in zip(names, arguments, strict=True)
            if name in known.passed
        ]
        return Code(f"{known.name}({', '.join(given)})", known.result)

    def _name(self, function: Any, kinds: tuple[Type | None, ...]) -> str:
        name: str = function.func.__name__ + "".join(f"_{kind.name}" for kind in kinds if kind)
        taken = {one.name for one in self._known.values()}
        while name in taken or name in _RESERVED:
            name += "_"
        return name

    def _passed(self, one: Code, kind: Type, pre: list[str]) -> str:
        if kind.kind != "struct":
            return self.converted(one, kind).text
        if one.path:
            return f"&{one.text}"
        if not one.variable:
            name = f"{one.type.name[0].lower()}{one.type.name[1:]}_{len(pre) + 1}"
            pre.append(f"const {one.type.name} {name} = {one.text};")
            return f"&{name}"
        return one.text[2:-1] if one.text.startswith("(*") and one.text.endswith(")") else f"&{one.text}"

    def converted(self, one: Code, kind: Type) -> Code:
        """An expression as a value of a type."""
        if one.type == kind or not kind.is_scalar or (one.type.kind == kind.kind):
            return one
        return Code(f"({kind.name}){one.within(_UNARY)}", kind, _UNARY)


def _structs_in(path: str, value: Any) -> Iterator[tuple[str, str]]:
    """Paths and keys of all structs in a value."""
    yield path, struct_name(value._cls)
    for name, variable in value._cls.vars.items():
        if type_of(variable.type).kind == "struct":
            yield from _structs_in(f"{path}.{name}", getattr(value, name))


def _annotations(function: Any) -> list[Any]:
    """Annotations of the arguments, as written."""
    return [one.annotation for one in inspect.signature(function.func).parameters.values()]


class _Function:
    """The translation of one function for arguments, some of them bound to constants."""

    def __init__(
        self, to: Translator, function: Any, arguments: Sequence[Code], bound: Sequence[str | None]
    ) -> None:
        self._to, self._function = to, function
        python = function.func
        closure = inspect.getclosurevars(python).nonlocals
        self._globals: dict[str, Any] = {**python.__globals__, **closure}
        source = textwrap.dedent(inspect.getsource(python))
        self._lines = source.splitlines()
        tree: Any = ast.parse(source).body[0]
        self._tree = tree
        names = [one.arg for one in tree.args.args]
        self._bound = {name: path for name, path in zip(names, bound, strict=True) if path}
        self._variables: dict[str, Type] = {}
        self._pointers: set[str] = set()
        for name, one, annotation in zip(names, arguments, _annotations(function), strict=True):
            kind = one.type if annotation == "Any" else type_of(self._evaluated(annotation))
            self._variables[name] = kind
            if kind.kind == "struct":
                self._pointers.add(name)
                to.struct(kind.struct)
        self._arguments = names
        self._given = dict(self._variables)
        self._loops: set[str] = set()
        self._every: set[str] = set()
        self._written: set[str] = set()
        self._read: set[str] = set()
        self._result = VOID
        self._pre: list[str] = []

    def _evaluated(self, annotation: Any) -> Any:
        return eval(annotation, self._globals) if isinstance(annotation, str) else annotation

    def translate(self, name: str) -> Translated:
        """The function of C."""
        body = self._tree.body
        if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            body = body[1:]
        prune = Pruner(self._tree, self._globals, self._bound, self._to.value)
        body = prune(body)
        self._given.update(prune.aliases)
        while True:
            # A variable may turn out to be unread only where the functions that it is given to are known.
            body = without_unread(body)
            text = self._written_out(name, body)
            unread = self._every - set(self._arguments) - self._read - self._loops
            dead = [
                node
                for node in nodes_of(body)
                if isinstance(node, ast.Assign) and getattr(root_of(node.targets[0]), "id", None) in unread
            ]
            if not dead:
                return text
            body = without(body, dead)

    def _written_out(self, name: str, body: list[ast.stmt]) -> Translated:
        """The function of C with these statements."""
        self._variables = dict(self._given)
        self._read, self._written, self._loops = set(), set(), set()
        self._pointers = {one for one in self._arguments if self._variables[one].kind == "struct"}
        returns = self._tree.returns
        kind = type_of(self._evaluated(ast.unparse(returns))) if returns is not None else VOID
        values = [node.value for node in nodes_of(body) if isinstance(node, ast.Return)]
        # A function that always returns 0 is called for what it writes.
        nothing = kind == INT and all(isinstance(one, ast.Constant) and one.value == 0 for one in values)
        self._result = VOID if nothing else kind
        changed = {
            target.id
            for node in nodes_of(body)
            if isinstance(node, ast.Assign)
            for target in map(root_of, node.targets)
            if target is not None and target.id in self._arguments
        }
        copied = sorted(one for one in changed if one in self._pointers)
        self._pointers -= set(copied)
        self._declared: set[str] = set(self._arguments)
        self._every = set()
        lines = self._block(body, 1)
        parameters, passed = [], {}
        for argument in self._arguments:
            if argument in self._bound or argument not in self._read:
                continue
            parameters.append(self._parameter(argument, argument in copied))
            passed[argument] = self._variables[argument]
        lines = [f"    {self._variables[one].name} {_c(one)} = *{_c(one)}_given;" for one in copied] + lines
        if nothing and lines and lines[-1].strip() == "return;":
            lines.pop()
        head = f"static {self._result.name} {name}({', '.join(parameters) or 'void'}) {{"
        document = _comment(about(self._function.func.__doc__))
        return Translated(name, self._result, "\n".join([document, head, *lines, "}"]), passed)

    def _parameter(self, name: str, copied: bool) -> str:
        kind = self._variables[name]
        if kind.kind == "struct":
            return f"const {kind.name} *{_c(name)}{'_given' if copied else ''}"
        if kind.kind == "array" and kind.shape == (1,):
            kind = replace(kind, constant=name not in self._written)
            self._variables[name] = kind
        return kind.declaration(_c(name))

    # Statements.

    def _block(self, body: Sequence[ast.stmt], depth: int) -> list[str]:
        lines: list[str] = []
        for k, statement in enumerate(body):
            lines += self._declarations(body[k:], statement, depth)
            self._pre = []
            code = self._statement(statement, depth)
            pad = "    " * depth
            lines += [pad + one for one in self._comments(statement)]
            lines += [pad + one for one in self._pre] + code
        return lines

    def _declarations(self, rest: Sequence[ast.stmt], statement: ast.stmt, depth: int) -> list[str]:
        """Variables that a block inside of this statement assigns first, and that are read after it."""
        lines = []
        if isinstance(statement, ast.If | ast.While):
            for name in assigned_in([statement]):
                if name in self._declared or not flows_to(name, rest[1:]):
                    continue
                value = next(
                    node.value
                    for node in ast.walk(statement)
                    if isinstance(node, ast.Assign)
                    and isinstance(node.targets[0], ast.Name)
                    and node.targets[0].id == name
                )
                self._variables[name] = self._expression(value).type
                self._declare(name)
                lines.append(f"{'    ' * depth}{self._variables[name].name} {_c(name)};")
        return lines

    def _comments(self, statement: ast.stmt) -> list[str]:
        """Full lines of comment before a statement."""
        found: list[str] = []
        k = getattr(statement, "lineno", 1) - 2
        while k >= 0 and self._lines[k].strip().startswith("#"):
            found.insert(0, f"/* {self._lines[k].strip().lstrip('# ')} */")
            k -= 1
        return found

    def _statement(self, node: ast.stmt, depth: int) -> list[str]:
        pad = "    " * depth
        if isinstance(node, ast.Assign):
            return [pad + self._assignment(node)]
        if isinstance(node, ast.Return):
            if self._result == VOID or node.value is None:
                return [f"{pad}return;"]
            value = self._to.converted(self._expression(node.value), self._result)
            return [f"{pad}return {_bare(value.text)};"]
        if isinstance(node, ast.Expr):
            return [f"{pad}{self._expression(node.value).text};"]
        declared = set(self._declared)
        if isinstance(node, ast.If):
            test, pre = self._expression(node.test).text, self._pre
            lines = [f"{pad}if ({test}) {{", *self._block(node.body, depth + 1)]
            self._declared = set(declared)
            if node.orelse:
                lines += [f"{pad}}} else {{", *self._block(node.orelse, depth + 1)]
            self._pre = pre
        elif isinstance(node, ast.While):
            lines = [
                f"{pad}while ({self._expression(node.test).text}) {{",
                *self._block(node.body, depth + 1),
            ]
            self._pre = []
        elif isinstance(node, ast.For):
            lines = self._loop(node, depth)
        else:
            raise self._error(node)
        self._declared = declared
        return [*lines, f"{pad}}}"]

    def _declare(self, name: str) -> None:
        self._declared.add(name)
        self._every.add(name)

    def _loop(self, node: ast.For, depth: int) -> list[str]:
        if not isinstance(node.iter, ast.Call) or not isinstance(node.target, ast.Name):
            raise self._error(node)
        bounds = [self._expression(one) for one in node.iter.args]
        pre = self._pre
        name = node.target.id
        first = bounds[0].text if len(bounds) > 1 else "0"
        self._variables[name] = INT
        self._declare(name)
        self._loops.add(name)
        c, last = _c(name), bounds[-1].within(7)
        head = f"{'    ' * depth}for (int32_t {c} = {first}; {c} < {last}; {c}++) {{"
        lines = [head, *self._block(node.body, depth + 1)]
        self._pre = pre
        return lines

    def _assignment(self, node: ast.Assign) -> str:
        target, value = node.targets[0], self._expression(node.value)
        if isinstance(target, ast.Name):
            name = target.id
            if name in self._declared:
                return f"{_c(name)} = {_bare(self._to.converted(value, self._variables[name]).text)};"
            self._declare(name)
            self._variables[name] = value.type
            if value.type.kind == "array":
                raise self._error(node)
            return f"{value.type.name} {_c(name)} = {_bare(value.text)};"
        place = self._expression(target)
        root = root_of(target)
        if root is not None:
            self._written.add(root.id)
        return f"{place.text} = {_bare(self._to.converted(value, place.type).text)};"

    # Expressions.

    def _expression(self, node: ast.expr) -> Code:
        if isinstance(node, ast.Name | ast.Attribute):
            return self._named(node)
        if isinstance(node, ast.Constant):
            return self._literal(node.value)
        if isinstance(node, ast.Call):
            return self._called(node)
        if isinstance(node, ast.Subscript):
            return self._entry(node)
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            return self._binary(
                *_BINARY[type(node.op)], self._expression(node.left), self._expression(node.right)
            )
        if isinstance(node, ast.UnaryOp):
            return self._unary(node)
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            return self._comparison(node)
        if isinstance(node, ast.BoolOp):
            symbol = " && " if isinstance(node.op, ast.And) else " || "
            return Code(symbol.join(self._expression(one).within(5) for one in node.values), BOOL, 2)
        raise self._error(node)

    def _literal(self, value: Any) -> Code:
        if isinstance(value, bool | np.bool_):
            return Code("true" if value else "false", BOOL)
        if isinstance(value, int | np.integer):
            return Code(str(int(value)), INT, _PRIMARY if value >= 0 else _UNARY)
        if isinstance(value, wp.uint64):
            return Code(f"UINT64_C({value.value})", UINT64)
        text = number(value, self._to.single)
        return Code(text, REAL, _UNARY if text.startswith("-") else _PRIMARY)

    def _is_local(self, node: ast.expr) -> bool:
        root = root_of(node)
        return root is None or root.id in self._variables

    def _named(self, node: ast.Name | ast.Attribute) -> Code:
        if not self._is_local(node):
            return self._constant(node)
        if isinstance(node, ast.Name):
            name = node.id
            kind = self._variables[name]
            if name in self._bound:
                return Code(self._bound[name], kind, path=self._bound[name])
            self._read.add(name)
            text = f"(*{_c(name)})" if name in self._pointers else _c(name)
            return Code(text, kind, variable=True)
        inner = self._expression(node.value)
        if inner.type.kind == "array" and node.attr == "shape":
            return Code(f"{inner.text}.shape", Type("shape"))
        if inner.type.kind != "struct":
            raise self._error(node)
        self._to.use(inner.type.struct, node.attr)
        kind = fields_of(inner.type.struct)[node.attr]
        path = None if inner.path is None else f"{inner.path}.{node.attr}"
        pointer = inner.text.startswith("(*") and inner.text.endswith(")")
        text = f"{inner.text[2:-1]}->{node.attr}" if pointer else f"{inner.text}.{node.attr}"
        return Code(text, kind, path=path, variable=inner.variable)

    def _constant(self, node: ast.expr) -> Code:
        """A number of the module, by its name."""
        name = ast.unparse(node)
        value = eval(name, self._globals)
        if isinstance(value, int) and not isinstance(value, bool):
            return self._number(name.rpartition(".")[2], self._literal(value))
        if isinstance(value, float | wp.float64 | wp.float32):
            text = self._literal(self._of_precision(name, value))
            return self._number(name.rpartition(".")[2], text)
        raise self._error(node)

    def _number(self, name: str, code: Code) -> Code:
        line = f"static const {code.type.name} {name} = {code.text};"
        if self._to.numbers.setdefault(name, line) != line:
            raise TranslationError(f"{self._function.key}: two modules have a number called {name}")
        return Code(name, code.type)

    def _of_precision(self, name: str, value: Any) -> Any:
        """A number of the module, evaluated anew for single precision where it depends on it."""
        if not self._to.single or real is wp.float32 or "." in name:
            return value
        module = inspect.getmodule(self._function.func)
        # A name that is imported is declared elsewhere.
        for home in (module, *(m for m in _modules(self._globals) if hasattr(m, name))):
            if home is None:
                continue
            for statement in ast.parse(inspect.getsource(home)).body:
                if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == name:
                    return eval(ast.unparse(statement.value), {**vars(home), "real": wp.float32})
        return value

    def _entry(self, node: ast.Subscript) -> Code:
        inner = self._expression(node.value)
        kind = inner.type
        if kind.kind == "shape":
            return Code(f"{inner.text}[{ast.unparse(node.slice)}]", INT)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        places = [self._expression(one) for one in indices]
        assert kind.element is not None
        if kind.kind == "vector":
            return Code(f"{inner.text}.v[{places[0].text}]", kind.element, variable=inner.variable)
        if kind.kind == "matrix":
            row, column = places
            return Code(f"{inner.text}.m[{row.text}][{column.text}]", kind.element, variable=inner.variable)
        if kind.shape == (1,):
            return Code(f"{inner.text}[{places[0].text}]", kind.element, variable=True)
        row, column = places
        at = f"{row.within(8)} * {inner.text}.shape[1] + {column.within(7)}"
        return Code(f"{inner.text}.data[{at}]", kind.element, variable=True)

    def _unary(self, node: ast.UnaryOp) -> Code:
        inner = self._expression(node.operand)
        if isinstance(node.op, ast.Not):
            return Code(f"!{inner.within(_UNARY)}", BOOL, _UNARY)
        if not inner.type.is_scalar:
            return Code(f"{self._to.helpers.need('negative', inner.type)}({inner.text})", inner.type)
        return Code(f"-{inner.within(_PRIMARY)}", inner.type, _UNARY)

    def _comparison(self, node: ast.Compare) -> Code:
        left, right = self._expression(node.left), self._expression(node.comparators[0])
        symbol = _COMPARED[type(node.ops[0])]
        if left.type == REAL and symbol in ("==", "!="):
            # The comparison that compilers do not warn of.
            size = f"{self._to.helpers.function('fabs')}({self._binary('-', 7, left, right).text})"
            return Code(f"{size} {'>' if symbol == '!=' else '<='} {number(0.0, self._to.single)}", BOOL, 6)
        return Code(f"{left.within(7)} {symbol} {right.within(7)}", BOOL, 6)

    def _binary(self, symbol: str, strength: int, a: Code, b: Code) -> Code:
        if a.type.is_scalar and b.type.is_scalar:
            if symbol in "+-" and b.text in ("0.0", "0.0f"):
                return a
            right = strength + (1 if symbol in "-/" else 0)
            if symbol in "|&":
                strength, right = 4, 6
            return Code(
                f"{a.within(right if symbol in '|&' else strength)} {symbol} {b.within(right)}",
                a.type,
                strength,
            )
        name, kind = self._to.helpers.operator(symbol, a.type, b.type)
        if a.type.is_scalar:
            a, b = b, a
        return Code(f"{name}({a.text}, {b.text})", kind)

    def _called(self, node: ast.Call) -> Code:
        if self._is_local(node.func):
            raise self._error(node)
        target = eval(ast.unparse(node.func), self._globals)
        name = ast.unparse(node.func)
        if name == "wp.static":
            value = eval(ast.unparse(node.args[0]), self._globals)
            return self._literal(value)
        if hasattr(target, "native_func") and not name.startswith("wp."):
            return self._own_call(target, node)
        arguments = [self._expression(one) for one in node.args]
        if isinstance(target, type) or hasattr(target, "vars"):
            return self._made(target, arguments)
        return self._to.helpers.builtin(name.removeprefix("wp."), arguments)

    def _own_call(self, target: Any, node: ast.Call) -> Code:
        """A call of a Warp function; what is read for an argument that it does not take is not read."""
        before, arguments, reads = self._read, [], []
        for one in node.args:
            self._read = set()
            arguments.append(self._expression(one))
            reads.append(self._read)
        self._read = before
        known = self._to.translated(target, arguments)
        for name, given, read in zip(
            inspect.signature(target.func).parameters, node.args, reads, strict=True
        ):
            kind = known.passed.get(name)
            if kind is None:
                continue
            self._read |= read
            if kind.kind == "array" and not kind.constant and isinstance(given, ast.Name):
                self._written.add(given.id)
        return self._to.call_of(known, target, arguments, self._pre)

    def _made(self, target: Any, arguments: list[Code]) -> Code:
        """A value made by its type."""
        kind = type_of(target)
        if kind.kind == "struct":
            self._to.struct(kind.struct)
            return Code(f"({kind.name}){{0}}", kind)
        if kind.is_scalar:
            if kind in (REAL, FLOAT) and arguments[0].type == INT and arguments[0].text.isdigit():
                return self._literal(float(arguments[0].text))
            if kind == UINT64 and arguments[0].text.isdigit():
                return Code(f"UINT64_C({arguments[0].text})", UINT64)
            if arguments[0].type == kind:
                return arguments[0]
            return Code(f"({kind.name}){arguments[0].within(_UNARY)}", kind, _UNARY)
        self._to.helpers.use(kind)
        if not arguments:
            return Code(f"{self._to.helpers.need('zero', kind)}()", kind)
        values = [one.text for one in arguments]
        if kind.kind == "matrix":
            rows, columns = kind.shape
            inner = ", ".join(
                f"{{{', '.join(values[i * columns : (i + 1) * columns])}}}" for i in range(rows)
            )
            return Code(f"({kind.name}){{{{{inner}}}}}", kind)
        return Code(f"({kind.name}){{{{{', '.join(values)}}}}}", kind)

    def _error(self, node: ast.AST) -> TranslationError:
        return TranslationError(f"{self._function.key}: {ast.unparse(node)!r} has no form in C here")


def _modules(names: dict[str, Any]) -> Iterator[Any]:
    """Modules of the functions among names."""
    for value in list(names.values()):
        if hasattr(value, "native_func") and getattr(value, "func", None) is not None:
            module = inspect.getmodule(value.func)
            if module is not None:
                yield module


def _c(name: str) -> str:
    """A name that C lets a variable have."""
    return f"{name}_" if name in _RESERVED else name


def _bare(text: str) -> str:
    """A pointer's content, as the whole of a side of an assignment."""
    return text[1:-1] if text.startswith("(*") and text.count("(") == 1 and text.endswith(")") else text


def _comment(text: str) -> str:
    lines = text.splitlines()
    if len(lines) == 1:
        return f"/* {text} */"
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in lines), " */"])
