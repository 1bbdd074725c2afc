"""What is left of a function's source where some of its arguments are known constants."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from .types import Type, type_of


class Pruner:
    """Leaves out the branches that constants switch off.

    Args:
        tree: The function.
        names: What the names of its module and closure stand for.
        bound: Paths of the constants that its arguments are.
        constant_at: The constant at a path.

    Attributes:
        bound: The same, with variables that are another name of a constant.
        aliases: Types of these variables.
    """

    def __init__(
        self,
        tree: ast.FunctionDef,
        names: Mapping[str, Any],
        bound: dict[str, str],
        constant_at: Callable[[str], Any],
    ) -> None:
        self._tree, self._globals, self.bound, self._constant_at = tree, names, bound, constant_at
        self.aliases: dict[str, Type] = {}

    def __call__(self, body: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Statements without the branches that are switched off."""
        return self._pruned(body, {name: self._constant_at(path) for name, path in self.bound.items()})

    def _value(self, node: ast.expr, known: dict[str, Any]) -> Any:
        """The value of an expression of constants; raises where it is not known."""
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and part.id not in known and part.id in self._locals:
                raise LookupError(part.id)
            if isinstance(part, ast.Call) and ast.unparse(part.func) not in (
                "real",
                "bool",
                "int",
                "wp.static",
            ):
                raise LookupError(ast.unparse(part))
        spaces = {**self._globals, **known, "real": float}
        return eval(compile(ast.Expression(_static_free(node)), "<constant>", "eval"), spaces)

    @cached_property
    def _locals(self) -> set[str]:
        stored = {
            n.id for n in ast.walk(self._tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }
        return stored | {one.arg for one in self._tree.args.args}

    def _folded(self, node: ast.expr, known: dict[str, Any]) -> ast.expr:
        """A condition with its known parts replaced by True or False."""
        try:
            return ast.Constant(bool(self._value(node, known)))
        except Exception:  # It is not known.
            pass
        if isinstance(node, ast.BoolOp):
            decisive = isinstance(node.op, ast.Or)
            parts = [self._folded(one, known) for one in node.values]
            if any(isinstance(one, ast.Constant) and one.value is decisive for one in parts):
                return ast.Constant(decisive)
            left = [one for one in parts if not isinstance(one, ast.Constant)]
            if len(left) == 1:
                return left[0]
            return ast.copy_location(ast.BoolOp(node.op, left), node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            inner = self._folded(node.operand, known)
            return (
                ast.Constant(not inner.value)
                if isinstance(inner, ast.Constant)
                else ast.UnaryOp(node.op, inner)
            )
        return node

    def _pruned(self, body: Iterable[ast.stmt], known: dict[str, Any]) -> list[ast.stmt]:
        """Statements without the branches that are switched off."""
        out: list[ast.stmt] = []
        assigned = [
            target.id
            for node in ast.walk(self._tree)
            if isinstance(node, ast.Assign)
            for target in map(root_of, node.targets)
            if target is not None
        ]
        for given in body:
            statement = copy.copy(given)
            if isinstance(statement, ast.If):
                test = self._folded(statement.test, known)
                if isinstance(test, ast.Constant):
                    out += self._pruned(statement.body if test.value else statement.orelse, known)
                else:
                    statement.test = test
                    statement.body = self._pruned(statement.body, known)
                    statement.orelse = self._pruned(statement.orelse, known)
                    if statement.body or statement.orelse:
                        out.append(statement)
            elif isinstance(statement, ast.For | ast.While):
                statement.body = self._pruned(statement.body, known)
                if statement.body and not self._never(statement, known):
                    out.append(statement)
            else:
                if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
                    name = statement.targets[0].id
                    path = self._path(statement.value)
                    if path and assigned.count(name) == 1:
                        # Another name of a table.
                        value = self._constant_at(path)
                        if hasattr(value, "_cls"):
                            known[name], self.bound[name] = value, path
                            self.aliases[name] = type_of(value._cls)
                            continue
                    condition = isinstance(statement.value, ast.BoolOp | ast.Compare)
                    if condition and assigned.count(name) == 1:
                        statement.value = self._folded(statement.value, known)
                        if isinstance(statement.value, ast.Constant):
                            known[name] = statement.value.value
                out.append(statement)
            if out and isinstance(out[-1], ast.Return):
                break
        return out

    def _path(self, node: ast.expr) -> str | None:
        """The constant that an expression is, by its path."""
        if isinstance(node, ast.Name):
            return self.bound.get(node.id)
        inner = self._path(node.value) if isinstance(node, ast.Attribute) else None
        return f"{inner}.{node.attr}" if inner and isinstance(node, ast.Attribute) else None

    def _never(self, loop: ast.For | ast.While, known: dict[str, Any]) -> bool:
        """Whether a loop is over nothing."""
        try:
            if isinstance(loop, ast.While):
                return not self._value(loop.test, known)
            assert isinstance(loop.iter, ast.Call)
            return not len(range(*(self._value(one, known) for one in loop.iter.args)))
        except Exception:  # It is not known.
            return False


def without_unread(body: list[ast.stmt]) -> list[ast.stmt]:
    """Statements without variables that nothing reads."""
    while True:
        read = {
            node.id
            for node in nodes_of(body)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
        }
        dead = [
            node
            for node in nodes_of(body)
            if isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Name)
            and node.targets[0].id not in read
        ]
        if not dead:
            return body
        body = without(body, dead)


def root_of(node: ast.expr) -> ast.Name | None:
    """The variable that an expression is a part of."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node if isinstance(node, ast.Name) else None


def nodes_of(body: Iterable[ast.stmt]) -> Iterator[ast.AST]:
    """All nodes of statements."""
    for statement in body:
        yield from ast.walk(statement)


def assigned_in(body: Iterable[ast.stmt]) -> list[str]:
    """Names that statements assign, in order."""
    names = [
        node.targets[0].id
        for node in nodes_of(body)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    ]
    return list(dict.fromkeys(names))


def flows_to(name: str, rest: Sequence[ast.stmt]) -> bool:
    """Whether later statements read a variable before they assign it."""
    for node in nodes_of(rest):
        if isinstance(node, ast.Name) and node.id == name:
            # In ast.walk a statement comes before its parts, and an assignment lists its target first.
            return not _assigned_first(name, rest)
    return False


def _assigned_first(name: str, rest: Sequence[ast.stmt]) -> bool:
    for statement in rest:
        reads = any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(statement))
        if reads:
            if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
                inside = any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(statement.value))
                return statement.targets[0].id == name and not inside
            if isinstance(statement, ast.For):
                return _assigned_first(name, statement.body)
            return False
    return False


def without(body: list[ast.stmt], dead: list[Any]) -> list[ast.stmt]:
    """Statements without some of them, at any depth."""
    out = []
    for statement in body:
        if any(statement is one for one in dead):
            continue
        if isinstance(statement, ast.If | ast.For | ast.While):
            statement.body = without(statement.body, dead)
            if isinstance(statement, ast.If):
                statement.orelse = without(statement.orelse, dead)
                if not statement.body and not statement.orelse:
                    continue
            if not statement.body:
                if isinstance(statement, ast.If):
                    statement.test, statement.body = ast.UnaryOp(ast.Not(), statement.test), statement.orelse
                    statement.orelse = []
                else:
                    continue
        out.append(statement)
    return out


def _static_free(node: ast.expr) -> ast.expr:
    """An expression whose ``wp.static(x)`` is x."""

    class Bare(ast.NodeTransformer):
        def visit_Call(self, call: ast.Call) -> ast.expr:
            self.generic_visit(call)
            return call.args[0] if ast.unparse(call.func) == "wp.static" else call

    bare: ast.expr = Bare().visit(copy.deepcopy(node))
    return ast.fix_missing_locations(bare)
