"""Warp functions in C: each operation against NumPy, and what is left out of a function."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
import warp as wp

from motion_cueing.envs.arrays import mat33, mat63, real, vec2, vec3, vec6
from motion_cueing.realtime.export.check import WARNINGS, run_compiler
from motion_cueing.realtime.export.source import Steps, write_source
from motion_cueing.realtime.export.translator import TranslationError, Translator
from motion_cueing.realtime.export.types import INT, REAL, Code, type_of

from . import needs_compiler

A = np.array([[2.0, 0.3, -0.1], [0.4, 1.5, 0.2], [-0.3, 0.1, 1.1]])
X = np.array([0.4, -1.2, 0.7])


@wp.struct
class Options:
    """Two integers and a gain."""

    mode: int
    count: int
    gain: real  # 1/s


@wp.struct
class Pair:
    """Two vectors."""

    first: vec3
    second: vec3


@wp.func
def algebra(a: mat33, x: vec3) -> vec3:
    """inv(A) x + A^T (x cross A x) / |x|, its entries within +-1."""
    y = wp.inverse(a) * x + wp.transpose(a) * wp.cross(x, a * x) / wp.length(x)
    return wp.min(wp.max(y, vec3(real(-1.0), real(-1.0), real(-1.0))), vec3(real(1.0), real(1.0), real(1.0)))


@wp.func
def rows(a: mat33, x: vec3) -> real:
    """Sum over six rows, there and back, of A x, times det(A), less the largest entry of |x|."""
    both = mat63()
    for i in range(6):
        for j in range(3):
            both[i, j] = a[wp.min(i, 5 - i), j]
    y = both * x
    total = real(0.0)
    for i in range(6):
        total = total + y[i]
    return total * wp.determinant(a) - wp.max(wp.abs(x))


@wp.func
def iterated(x: real) -> real:
    """Square root of x by Newton's iteration, with its sign."""
    root = wp.max(wp.abs(x), real(1.0))
    count = 0
    while wp.abs(root * root - wp.abs(x)) > real(1e-12) and count < 50:
        root = real(0.5) * (root + wp.abs(x) / root)
        count = count + 1
    if x != real(0.0):
        return wp.sign(x) * root
    return x


@wp.func
def swapped(p: Pair) -> Pair:
    """The pair with its vectors exchanged."""
    out = p
    out.first = p.second
    out.second = wp.normalize(p.first)
    return out


@wp.func
def optional(o: Options, x: real, y: real) -> real:
    """x, or what the mode makes of it and of y."""
    extra = o.gain * y
    if o.mode == 1:
        x = x + extra
    for _ in range(o.count):
        x = real(2.0) * x
    return x


@wp.func
def comprehended(x: vec2) -> real:
    """Python that kernels do not have."""
    return sum(value for value in x)


def run(tmp_path, function, arguments, size, *, single=False):
    """Values of a translated function, by a library of its own."""
    to = Translator(single)
    kinds = [type_of(one) for one in function.func.__globals__["_KINDS"][function.key]]
    names = [f"argument_{k}" for k in range(len(kinds))]
    call = to.call(
        function, *(Code(name, kind, variable=True) for name, kind in zip(names, kinds, strict=True))
    )
    flat = np.concatenate([np.ravel(one) for one in arguments]).astype(np.float64)
    lines, at = [], 0
    for name, kind in zip(names, kinds, strict=True):
        n = int(np.prod(kind.shape)) if kind.shape else 1
        entries = ", ".join(f"input->x[{at + k}]" for k in range(n))
        if kind.kind == "matrix":
            rows_ = [", ".join(f"input->x[{at + 3 * i + j}]" for j in range(3)) for i in range(3)]
            entries = ", ".join("{" + one + "}" for one in rows_)
        value = entries if kind == REAL else f"({kind.name}){{{{{entries}}}}}"
        to.helpers.use(kind)
        lines.append(f"const {kind.name} {name} = {value};")
        at += n
    lines.append(f"const {call.type.name} result = {call.text};")
    place = "result" if call.type == REAL else "result.v[i]"
    lines += [f"for (int32_t i = 0; i < {size}; i++) {{", f"    output->y[i] = {place};", "}", "(void)state;"]
    steps = Steps("test", [f"real x[{len(flat)}];"], [f"real y[{size}];"], ["int32_t none;"], [], (), (),
                  ["state->none = 0;"], lines, 0.01)  # fmt: skip
    source = write_source("tried", to, steps, "test")
    (tmp_path / "tried.h").write_text(source.header)
    (tmp_path / "tried.c").write_text(source.code)
    library = tmp_path / "tried.so"
    said = run_compiler(
        [*WARNINGS, "-O2", "-shared", "-fPIC", "-o", str(library), str(tmp_path / "tried.c"), "-lm"]
    )
    assert said == ""
    kind = ctypes.c_float if single else ctypes.c_double
    given, out = (kind * len(flat))(*flat), (kind * size)()
    ctypes.CDLL(str(library)).tried_step(None, given, out)
    return np.array(out)


_KINDS = {"algebra": (mat33, vec3), "rows": (mat33, vec3), "iterated": (real,)}


@needs_compiler
@pytest.mark.parametrize(("single", "accuracy"), [(False, 1e-14), (True, 1e-6)])
def test_operations_on_vectors_and_matrices(single, accuracy, tmp_path):
    expected = np.linalg.inv(A) @ X + A.T @ np.cross(X, A @ X) / np.linalg.norm(X)
    found = run(tmp_path, algebra, [A, X], 3, single=single)
    np.testing.assert_allclose(found, np.clip(expected, -1.0, 1.0), atol=accuracy)


@needs_compiler
def test_loops_over_matrices(tmp_path):
    expected = 2.0 * (A @ X).sum() * np.linalg.det(A) - np.abs(X).max()
    assert run(tmp_path, rows, [A, X], 1)[0] == pytest.approx(expected, abs=1e-14)


@needs_compiler
@pytest.mark.parametrize("x", [2.0, -9.0, 0.0])
def test_a_while_loop_and_the_sign(x, tmp_path):
    assert run(tmp_path, iterated, [np.array([x])], 1)[0] == pytest.approx(
        np.sign(x) * np.sqrt(abs(x)), abs=1e-11
    )


def translated(mode: int, count: int) -> str:
    to = Translator()
    values = Options()
    values.mode, values.count, values.gain = mode, count, 3.0
    to.bind("OPTIONS", values)
    call = to.call(
        optional, Code("OPTIONS", type_of(Options), path="OPTIONS"), Code("x", REAL), Code("y", REAL)
    )
    return call.text + "\n" + to.functions[-1].text


def test_what_a_constant_switches_off_is_left_out():
    plain = translated(0, 0)
    assert plain.startswith("optional(x)\n")
    assert "y" not in plain.split("{", 1)[1]
    assert "return x;" in plain
    full = translated(1, 3)
    assert full.startswith("optional(x, y)\n")
    assert "real extra = OPTIONS.gain * y;" in full
    assert "x = x + extra;" in full
    assert "for (int32_t _ = 0; _ < OPTIONS.count; _++) {" in full


def test_structs_keep_the_fields_that_are_used_and_their_comments():
    to = Translator()
    to.call(swapped, Code("p", type_of(Pair), variable=True))
    assert list(to.fields(Pair)) == ["first", "second"]
    assert "const Pair *p" in to.functions[-1].text
    assert "Pair out = *p;" in to.functions[-1].text
    to = Translator()
    values = Options()
    to.bind("OPTIONS", values)
    to.call(optional, Code("o", type_of(Options), variable=True), Code("x", REAL), Code("y", REAL))
    assert list(to.fields(Options)) == ["mode", "count", "gain"]


def test_other_python_is_refused_by_name():
    with pytest.raises(TranslationError, match=r"comprehended: .*for value in x.* has no form in C here"):
        Translator().call(comprehended, Code("x", type_of(vec2)))
    with pytest.raises(TranslationError, match="2 arguments of 1"):
        Translator().call(iterated, Code("x", REAL), Code("y", INT))


def test_kernels_that_are_exported_use_these_types():
    assert [type_of(one).name for one in (vec6, mat63, real, int, wp.vec2f)] == [
        "vec6", "mat63", "real", "int32_t", "vec2f",
    ]  # fmt: skip
