"""Recorded launches: the bits of Warp's own launches, with every kind of argument, and when Warp differs."""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import warp as wp

from motion_cueing.envs.arrays import FLOAT, real, vec3
from motion_cueing.envs.launch import TRIED, Launch

N = 5
DEVICE = wp.get_device("cpu")


@wp.struct
class Entry:
    """An entry of an array of structs."""

    force: vec3
    count: int


@wp.struct
class Inner:
    """A struct within a struct."""

    table: wp.array(dtype=real)
    flag: wp.bool


@wp.struct
class Rules:
    """A struct with numbers, an array and a struct."""

    gain: real
    offsets: wp.array2d(dtype=wp.float32)
    inner: Inner


@wp.kernel(module="unique")
def combine(
    rules: Rules,
    entries: wp.array(dtype=Entry),
    rows: wp.array2d(dtype=real),
    chosen: wp.array(dtype=wp.bool),
    direction: vec3,
    factor: real,
    shift: int,
    out: wp.array2d(dtype=real),
    entries_out: wp.array(dtype=Entry),
) -> None:
    """Something that depends on all of its arguments."""
    i = wp.tid()
    e = entries[i]
    value = wp.dot(e.force, direction) * rules.gain + factor * rules.inner.table[i]
    if chosen[i] and rules.inner.flag:
        value = value + wp.sin(real(e.count + shift)) * real(rules.offsets[i, 1])
    for k in range(2):
        out[i, k] = value * rows[i, k] * rows[i, k]
    e.count = e.count + shift
    e.force = e.force * value
    entries_out[i] = e


@wp.kernel(enable_backward=False, module="unique")
def count_up(out: wp.array(dtype=int), step: int) -> None:
    """Add to every entry."""
    i = wp.tid()
    out[i] = out[i] + step


def arguments(seed: int = 0) -> tuple[list[Any], list[Any]]:
    """Inputs and outputs of :func:`combine`, new arrays with the same numbers for the same seed."""
    rng = np.random.default_rng(seed)
    keep = {"device": DEVICE, "requires_grad": True}
    rules: Any = Rules()
    rules.gain = 1.7
    rules.offsets = wp.array(rng.standard_normal((N, 2)).astype(np.float32), device=DEVICE)
    rules.inner.table = wp.array(rng.standard_normal(N).astype(FLOAT), dtype=real, device=DEVICE)
    rules.inner.flag = True
    entries = wp.zeros(N, dtype=Entry, **keep)
    values = np.zeros(N, dtype=entries.numpy().dtype)
    values["force"], values["count"] = rng.standard_normal((N, 3)), np.arange(N)
    entries.assign(values)
    inputs = [
        rules,
        entries,
        wp.array(rng.standard_normal((N, 2)).astype(FLOAT), dtype=real, **keep),
        wp.array(np.arange(N) % 2 == 0, dtype=wp.bool, device=DEVICE),
        vec3(*rng.standard_normal(3).tolist()),
        real(0.3),
        4,
    ]
    return inputs, [wp.zeros((N, 2), dtype=real, **keep), wp.zeros(N, dtype=Entry, **keep)]


def bits(*arrays: Any) -> list[bytes]:
    """The content of arrays."""
    return [array.numpy().tobytes() for array in arrays]


def direct(launch: Launch) -> bool:
    """Whether a launch is direct where it can be: with a version of Warp that was tried."""
    return launch.direct == (wp.__version__ in TRIED)


def test_the_same_bits_with_every_kind_of_argument() -> None:
    inputs, expected = arguments()
    wp.launch(combine, N, inputs=inputs, outputs=expected, device=DEVICE)
    inputs, found = arguments()
    launch = Launch(combine, N, inputs, found, device=DEVICE)
    assert direct(launch)
    assert not found[0].numpy().any(), "recording launches nothing"
    launch.launch()
    assert bits(*found) == bits(*expected)
    assert np.all(found[0].numpy() != 0.0)


def test_new_content_of_arrays_is_seen() -> None:
    inputs, found = arguments()
    launch = Launch(combine, N, [*inputs, *found], device=DEVICE)
    launch.launch()
    others, expected = arguments(seed=1)
    others[4] = inputs[4]
    wp.launch(combine, N, inputs=others, outputs=expected, device=DEVICE)
    for ours, other in zip(
        [inputs[0].offsets, inputs[0].inner.table, *inputs[1:4]],
        [others[0].offsets, others[0].inner.table, *others[1:4]],
        strict=True,
    ):
        ours.assign(other)
    launch.launch()
    assert bits(*found) == bits(*expected)


def test_repeated_launches_add_up() -> None:
    total = wp.zeros(N, dtype=int, device=DEVICE)
    launch = Launch(count_up, N, [total, 3], device=DEVICE)
    for _ in range(4):
        launch.launch()
    assert total.numpy().tolist() == [12] * N


def gradients(back: Callable[..., Callable[[], None]]) -> list[bytes]:
    """Adjoints of the inputs after two launches of the adjoint, made by ``back``."""
    inputs, outputs = arguments()
    wp.launch(combine, N, inputs=inputs, outputs=outputs, device=DEVICE)
    outputs[0].grad.fill_(real(1.0))
    adjoints = [Rules(), inputs[1].grad, inputs[2].grad, None, vec3(), real(0.0), 0]
    run = back(inputs, outputs, adjoints, [one.grad for one in outputs])
    run()
    run()
    assert np.any(inputs[2].grad.numpy() != 0.0)
    return bits(inputs[1].grad, inputs[2].grad)


def test_the_same_adjoint() -> None:
    def by_warp(inputs: Any, outputs: Any, adj_inputs: Any, adj_outputs: Any) -> Callable[[], None]:
        def run() -> None:
            wp.launch(
                combine, N, inputs, outputs, adj_inputs, adj_outputs, device=DEVICE, adjoint=True
            )  # fmt: skip

        return run

    def recorded(inputs: Any, outputs: Any, adj_inputs: Any, adj_outputs: Any) -> Callable[[], None]:
        launch = Launch(
            combine, N, inputs, outputs, device=DEVICE, adjoint=True,
            adj_inputs=adj_inputs, adj_outputs=adj_outputs,
        )  # fmt: skip
        assert direct(launch)
        return launch.launch

    assert gradients(recorded) == gradients(by_warp)


def another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    """Warp of a version that nobody tried."""
    monkeypatch.setattr("motion_cueing.envs.launch.TRIED", ("0.0",))


def no_internals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Warp without a function that builds the structure of arguments."""
    monkeypatch.delattr(wp._src.context, "_build_cpu_args_structs")


@pytest.mark.skipif(wp.__version__ not in TRIED, reason="the names of these parts are of the versions tried")
@pytest.mark.parametrize("change", [another_version, no_internals])
def test_warp_launches_where_its_parts_are_missing(
    monkeypatch: pytest.MonkeyPatch, change: Callable[[pytest.MonkeyPatch], None]
) -> None:
    inputs, expected = arguments()
    wp.launch(combine, N, inputs=inputs, outputs=expected, device=DEVICE)
    change(monkeypatch)
    inputs, found = arguments()
    launch = Launch(combine, N, inputs, found, device=DEVICE)
    assert not launch.direct
    launch.launch()
    assert bits(*found) == bits(*expected)


@pytest.mark.skipif(wp.__version__ not in TRIED, reason="the names of these parts are of the versions tried")
def test_warp_launches_while_a_graph_is_captured() -> None:
    total = wp.zeros(N, dtype=int, device=DEVICE)
    Launch(count_up, N, [total, 1], device=DEVICE).launch()
    with wp.ScopedCapture(device=DEVICE):
        launch = Launch(count_up, N, [total, 1], device=DEVICE)
        assert not launch.direct
    assert Launch(count_up, N, [total, 1], device=DEVICE).direct


def test_arguments_and_machine_code_live_as_long_as_the_launch() -> None:
    inputs, expected = arguments()
    wp.launch(combine, N, inputs=inputs, outputs=expected, device=DEVICE)
    inputs, found = arguments()
    launch = Launch(combine, N, inputs, found, device=DEVICE)
    # The arrays in a struct are replaced, all others forgotten, and the module unloaded.
    inputs[0].offsets = wp.zeros((N, 2), dtype=wp.float32, device=DEVICE)
    inputs[0].inner.table = wp.zeros(N, dtype=real, device=DEVICE)
    del inputs
    combine.module.unload()
    run = launch.launch
    del launch
    gc.collect()
    # Takes the memory of what was let go.
    held = [wp.full(size, 1e3, dtype=real, device=DEVICE) for size in range(1, 200)]
    run()
    assert bits(*found) == bits(*expected)
    assert len(held) == 199
