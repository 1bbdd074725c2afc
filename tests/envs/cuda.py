"""Kernels compiled for CUDA, which needs no GPU."""

from __future__ import annotations

from pathlib import Path

import warp as wp


def ptx_of(kernel: wp.Kernel) -> str:
    """A kernel's module as PTX; Warp's cache keeps it, so only a module that has changed is compiled."""
    wp.compile_aot_module(kernel.module, arch=90, use_ptx=True)
    (ptx,) = Path(wp.config.kernel_cache_dir, kernel.module.get_module_identifier()).glob("*.sm90.ptx")
    return ptx.read_text()
