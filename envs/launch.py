"""Launches of a kernel that are repeated on the same arrays, at little cost from Python.

Warp's own recorded command builds a structure of all arguments at each launch, which takes longer than the
step of one environment. On the CPU this module builds it once and calls the compiled function directly.

For that it needs parts of Warp that are not public. So it does it with the versions in :data:`TRIED` alone,
where it finds all of these parts. Elsewhere, and always on CUDA, a launch is Warp's recorded command.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from importlib import import_module
from typing import Any, Final

import warp as wp

TRIED: Final = ("1.19.0",)
"""Versions of Warp with which direct calls were found to give the bits of its own launches."""


class Launch:
    """A launch of a kernel on fixed arguments, which it keeps alive.

    Numbers and the fields of structs are those of the moment of recording. Arrays may change their content.
    The machine code is of that moment, too: the launch keeps it where Warp unloads or recompiles the kernel's
    module, as Warp's recorded commands do. A graph capture of CPU work sees the launch only if it was
    recorded during the capture.

    Args:
        kernel: The kernel.
        n: Threads.
        inputs: Its arguments, or the first of them.
        outputs: The others.
        device: Where it runs.
        adjoint: Whether the kernel's adjoint is launched.
        adj_inputs: Adjoints of ``inputs``.
        adj_outputs: Adjoints of ``outputs``.

    Attributes:
        direct: Whether the compiled function is called without Warp in between.
    """

    def __init__(
        self,
        kernel: Any,
        n: int,
        inputs: Sequence[Any],
        outputs: Sequence[Any] = (),
        *,
        device: Any,
        adjoint: bool = False,
        adj_inputs: Sequence[Any] = (),
        adj_outputs: Sequence[Any] = (),
    ) -> None:
        self._kept = list(_arrays_in([*inputs, *outputs, *adj_inputs, *adj_outputs]))
        self._command = wp.launch(
            kernel,
            n,
            inputs=inputs,
            outputs=outputs,
            adj_inputs=adj_inputs,
            adj_outputs=adj_outputs,
            device=device,
            adjoint=adjoint,
            record_cmd=True,
        )
        function = _direct_call(self._command)
        self.direct = function is not None
        self._call: Callable[[], None] = function or self._command.launch

    def launch(self) -> None:
        """Launch the kernel."""
        self._call()


def _arrays_in(arguments: Iterable[Any]) -> Iterator[Any]:
    """The arrays among arguments, those in fields of structs too, which others may replace later."""
    for argument in arguments:
        if isinstance(argument, wp.array):
            yield argument
            yield argument.grad
        elif hasattr(argument, "_cls"):  # a struct
            yield from _arrays_in(vars(argument).values())


def _direct_call(command: Any) -> Callable[[], None] | None:
    """The compiled function with a recorded command's arguments; None where Warp must launch it."""
    if wp.__version__ not in TRIED or not command.device.is_cpu:
        return None
    try:
        context = import_module("warp._src.context")
        ordinary = type(command) is context.Launch and command.block_dim == 1
        if not ordinary or context.runtime._apic_capture is not None:
            return None
        function = command.hooks.backward if command.adjoint else command.hooks.forward
        structures = context._build_cpu_args_structs(
            command.kernel, command.hooks, command.params, command.adjoint
        )
    except (ImportError, AttributeError):
        return None
    if not callable(function):
        return None
    # These references keep the structures alive.
    return partial(function, *(ctypes.byref(one) for one in (command.bounds, *structures) if one is not None))
