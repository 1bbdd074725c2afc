"""Operations of C on numbers, vectors and matrices, each written where a function uses it."""

from __future__ import annotations

from typing import Any, Final

from .types import BOOL, FLOAT, REAL, UINT64, Code, Type, number

_ELEMENTWISE: Final = {"add": "+", "subtract": "-", "multiply": "*"}


class Helpers:
    """The operations in use.

    Args:
        single: Whether numbers are single precision.

    Attributes:
        definitions: Their functions, by name.
        types: Vectors and matrices, by name.
    """

    def __init__(self, single: bool) -> None:
        self._single = single
        self.definitions: dict[str, str] = {}
        self.types: dict[str, Type] = {}

    def use(self, kind: Type) -> None:
        """Take a vector or matrix type into the export."""
        if kind.kind in ("vector", "matrix") or (kind.kind == "array" and kind.shape == (2,)):
            self.types.setdefault(kind.name, kind)

    def function(self, name: str) -> str:
        """A function of the mathematical library, for the precision."""
        return f"{name}f" if self._single else name

    def operator(self, symbol: str, a: Type, b: Type) -> tuple[str, Type]:
        """Function and result of an operator on vectors and matrices."""
        if symbol in "+-":
            return self.need({"+": "add", "-": "subtract"}[symbol], a), a
        if symbol == "/":
            return self.need("divide", a), a
        if a.is_scalar or b.is_scalar:
            kind = b if a.is_scalar else a
            return self.need("scale", kind), kind
        if b.kind == "vector":
            result = Type("vector", REAL, (a.shape[0],))
        else:
            result = Type("matrix", REAL, (a.shape[0], b.shape[1]))
        return self._times(a, b, result), result

    def need(self, operation: str, kind: Type) -> str:
        """The name of an operation on a type, which is written if it is not yet."""
        self.use(kind)
        name = f"{kind.name}_{operation}"
        if name not in self.definitions:
            self.definitions[name] = ""  # Its place: before those that it needs are written, see below.
            text = self._written(operation, kind, name)
            del self.definitions[name]
            self.definitions[name] = text
        return name

    def _number(self, value: float) -> str:
        return number(value, self._single)

    def _written(self, operation: str, kind: Type, name: str) -> str:
        t, loops, at, ends = kind.name, *_loops(kind)
        assert kind.element is not None
        e, inner = kind.element.name, "    " * (1 + len(kind.shape))
        if operation in _ELEMENTWISE:
            body = f"{loops}{inner}a.{at} {_ELEMENTWISE[operation]}= b.{at};\n{ends}    return a;"
            return _function(t, name, f"{t} a, {t} b", body)
        if operation in ("scale", "divide"):
            sign, by = ("*", "factor") if operation == "scale" else ("/", "divisor")
            return _function(
                t, name, f"{t} a, {e} {by}", f"{loops}{inner}a.{at} {sign}= {by};\n{ends}    return a;",
            )  # fmt: skip
        if operation == "negative":
            return _function(t, name, f"{t} a", f"{loops}{inner}a.{at} = -a.{at};\n{ends}    return a;")
        if operation == "abs":
            f = self.function("fabs")
            return _function(t, name, f"{t} a", f"{loops}{inner}a.{at} = {f}(a.{at});\n{ends}    return a;")
        if operation in ("min", "max"):
            sign = "<" if operation == "min" else ">"
            body = f"{loops}{inner}a.{at} = a.{at} {sign} b.{at} ? a.{at} : b.{at};\n{ends}    return a;"
            return _function(t, name, f"{t} a, {t} b", body)
        if operation == "zero":
            zero = "{{0}}" if kind.element.kind == "int" else f"{{{{{self._number(0.0)}}}}}"
            zero = zero if kind.kind == "vector" else f"{{{{{{{self._number(0.0)}}}}}}}"
            return _function(t, name, "void", f"    return ({t}){zero};")
        if operation == "largest":
            body = (
                f"    {e} largest = a.v[0];\n    for (int32_t i = 1; i < {kind.shape[0]}; i++) {{\n"
                f"        largest = a.v[i] > largest ? a.v[i] : largest;\n    }}\n    return largest;"
            )
            return _function(e, name, f"{t} a", body)
        if operation == "dot":
            body = (
                f"    {e} sum = {self._number(0.0)};\n    for (int32_t i = 0; i < {kind.shape[0]}; i++) {{\n"
                f"        sum += a.v[i] * b.v[i];\n    }}\n    return sum;"
            )
            return _function(e, name, f"{t} a, {t} b", body)
        if operation == "length":
            return _function(
                e, name, f"{t} a", f"    return {self.function('sqrt')}({self.need('dot', kind)}(a, a));"
            )
        if operation == "normalize":
            length, scale = self.need("length", kind), self.need("divide", kind)
            zero = self.need("zero", kind)
            body = (
                f"    const {e} length = {length}(a);\n"
                f"    return length > {self._number(0.0)} ? {scale}(a, length) : {zero}();"
            )
            return _function(t, name, f"{t} a", body)
        if operation == "cross":
            entries = [f"a.v[{i}] * b.v[{j}] - a.v[{j}] * b.v[{i}]" for i, j in ((1, 2), (2, 0), (0, 1))]
            return _function(t, name, f"{t} a, {t} b", f"    return ({t}){{{{{', '.join(entries)}}}}};")
        if operation == "transpose":
            rows, columns = kind.shape
            result = Type("matrix", kind.element, (columns, rows))
            self.use(result)
            body = (
                f"    {result.name} out;\n    for (int32_t i = 0; i < {rows}; i++) {{\n"
                f"        for (int32_t j = 0; j < {columns}; j++) {{\n            out.m[j][i] = a.m[i][j];\n"
                "        }\n    }\n    return out;"
            )
            return _function(result.name, name, f"{t} a", body)
        if operation == "determinant":
            terms = " + ".join(
                f"a.m[0][{i}] * (a.m[1][{j}] * a.m[2][{k}] - a.m[1][{k}] * a.m[2][{j}])"
                for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
            )
            return _function(e, name, f"{t} a", f"    return {terms};")
        if operation == "inverse":
            return self._inverse(kind, name)
        raise NotImplementedError(operation)

    def _inverse(self, kind: Type, name: str) -> str:
        determinant, zero = self.need("determinant", kind), self.need("zero", kind)
        t, e = kind.name, kind.element.name if kind.element else ""
        lines = []
        for i in range(3):
            for j in range(3):
                r, s = [k for k in range(3) if k != j], [k for k in range(3) if k != i]
                r = [(j + 1) % 3, (j + 2) % 3]
                s = [(i + 1) % 3, (i + 2) % 3]
                lines.append(
                    f"    out.m[{i}][{j}] = (a.m[{r[0]}][{s[0]}] * a.m[{r[1]}][{s[1]}] - "
                    f"a.m[{r[0]}][{s[1]}] * a.m[{r[1]}][{s[0]}]) / determinant;"
                )
        size = f"{self.function('fabs')}(determinant)"
        body = (
            f"    const {e} determinant = {determinant}(a);\n    {t} out = {zero}();\n"
            f"    if (!({size} > {self._number(0.0)})) {{\n        return out;\n    }}\n"
            + "\n".join(lines)
            + "\n    return out;"
        )
        return _function(t, name, f"{t} a", body)

    def _times(self, a: Type, b: Type, result: Type) -> str:
        for kind in (a, b, result):
            self.use(kind)
        name = f"{a.name}_times_{b.name}"
        if name in self.definitions:
            return name
        rows, inner = a.shape
        zero = self._number(0.0)
        if b.kind == "vector":
            body = (
                f"    {result.name} out;\n    for (int32_t i = 0; i < {rows}; i++) {{\n"
                f"        real sum = {zero};\n        for (int32_t k = 0; k < {inner}; k++) {{\n"
                "            sum += a.m[i][k] * b.v[k];\n        }\n"
                "        out.v[i] = sum;\n    }\n    return out;"
            )
        else:
            body = (
                f"    {result.name} out;\n    for (int32_t i = 0; i < {rows}; i++) {{\n"
                f"        for (int32_t j = 0; j < {b.shape[1]}; j++) {{\n            real sum = {zero};\n"
                f"            for (int32_t k = 0; k < {inner}; k++) {{\n"
                "                sum += a.m[i][k] * b.m[k][j];\n            }\n"
                "            out.m[i][j] = sum;\n"
                "        }\n    }\n    return out;"
            )
        self.definitions[name] = _function(result.name, name, f"{a.name} a, {b.name} b", body)
        return name

    def _scalar(self, operation: str, kind: Type) -> str:
        name, t = f"{operation}_{kind.kind}", kind.name
        if name not in self.definitions:
            if operation in ("min", "max"):
                body = f"    return a {'<' if operation == 'min' else '>'} b ? a : b;"
                self.definitions[name] = _function(t, name, f"{t} a, {t} b", body)
            elif operation == "clamp":
                low = self._scalar("max", kind)
                high = self._scalar("min", kind)
                body = f"    return {high}({low}(lowest, x), highest);"
                self.definitions[name] = _function(t, name, f"{t} x, {t} lowest, {t} highest", body)
            else:
                body = f"    return x < {self._number(0.0)} ? {self._number(-1.0)} : {self._number(1.0)};"
                self.definitions[name] = _function(t, name, f"{t} x", body)
        return name

    def builtin(self, name: str, given: list[Code]) -> Code:
        """A call of one of Warp's own functions."""
        first = given[0].type
        texts = ", ".join(one.text for one in given)
        if name in ("sin", "cos", "tan", "sqrt", "atan2", "floor", "ceil"):
            return Code(f"{self.function(name)}({texts})", REAL)
        if name in ("lshift", "rshift"):
            symbol = "<<" if name == "lshift" else ">>"
            return Code(f"{given[0].within(9)} {symbol} {given[1].within(9)}", UINT64, 5)
        if name == "where":
            return Code(
                f"{given[0].within(6)} ? {given[1].within(2)} : {given[2].within(2)}", given[1].type, 1
            )
        if first.is_scalar:
            if name == "abs":
                suffix = {REAL: self.function("fabs"), FLOAT: "fabsf"}[first]
                return Code(f"{suffix}({texts})", first)
            if name in ("min", "max", "clamp", "sign"):
                return Code(f"{self._scalar(name, first)}({texts})", first)
        simple: dict[str, Any] = {
            "dot": ("dot", first.element),
            "cross": ("cross", first),
            "length": ("length", first.element),
            "normalize": ("normalize", first),
            "abs": ("abs", first),
            "cw_mul": ("multiply", first),
            "determinant": ("determinant", first.element),
            "inverse": ("inverse", first),
        }
        if name in simple:
            operation, kind = simple[name]
            return Code(f"{self.need(operation, first)}({texts})", kind)
        if name in ("min", "max"):
            if len(given) == 1 and name == "max":
                return Code(f"{self.need('largest', first)}({texts})", first.element or BOOL)
            return Code(f"{self.need(name, first)}({texts})", first)
        if name == "transpose":
            shape = (first.shape[1], first.shape[0])
            return Code(f"{self.need('transpose', first)}({texts})", Type("matrix", first.element, shape))
        if name == "matrix_from_rows":
            result = Type("matrix", first.element, (len(given), first.shape[0]))
            self.use(result)
            rows = [
                "{" + ", ".join(f"row_{i}.v[{j}]" for j in range(first.shape[0])) + "}"
                for i in range(len(given))
            ]
            of = f"{result.name}_of_rows"
            parameters = ", ".join(f"{first.name} row_{i}" for i in range(len(given)))
            body = f"    return ({result.name}){{{{{', '.join(rows)}}}}};"
            self.definitions.setdefault(of, _function(result.name, of, parameters, body))
            return Code(f"{of}({texts})", result)
        raise NotImplementedError(f"warp.{name} has no form in C here")


def _loops(kind: Type) -> tuple[str, str, str]:
    """Loops over the entries of a vector or matrix: their begin, an entry, their end."""
    begin = f"    for (int32_t i = 0; i < {kind.shape[0]}; i++) {{\n"
    if kind.kind == "vector":
        return begin, "v[i]", "    }\n"
    return (
        begin + f"        for (int32_t j = 0; j < {kind.shape[1]}; j++) {{\n",
        "m[i][j]",
        "        }\n    }\n",
    )


def _function(result: str, name: str, parameters: str, body: str) -> str:
    return f"static {result} {name}({parameters}) {{\n{body}\n}}"
