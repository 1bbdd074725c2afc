"""Arrays that the host writes or reads and kernels work on."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray


class Mirror:
    """A device array and its image on the host; on the CPU both are the same memory.

    Args:
        shape: Of the array.
        dtype: Of its entries, a Warp type or struct.
        device: Where kernels work on it.
    """

    def __init__(self, shape: int | tuple[int, ...], dtype: Any, device: Any) -> None:
        host = wp.zeros(shape, dtype=dtype, device="cpu")
        self.view: NDArray[Any] = np.asarray(host.numpy())
        self.shared = bool(wp.get_device(device).is_cpu)
        self.array = host if self.shared else wp.zeros(shape, dtype=dtype, device=device)
        self._host = host

    def push(self) -> None:
        """Bring what the host wrote into :attr:`view` to the device."""
        if not self.shared:
            wp.copy(self.array, self._host)

    def pull(self) -> NDArray[Any]:
        """Bring what kernels wrote to the host, and return :attr:`view`."""
        if not self.shared:
            self.view[...] = self.array.numpy()
        return self.view
