"""Predictive controllers by name and from files; their libraries are imported only when one is made."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ..envs.platform.machines import Platform
from ..envs.settings import from_dict
from .policy import ForeknowingPolicy, Policy
from .presets import named

DESCRIPTIONS: Final = {
    "mpc": "predictive control that knows nothing of the drive ahead",
    "mpc-preview": "predictive control that sees 2 s of the drive ahead",
    "mpc-full": "predictive control that knows the drive over its whole horizon, 8 s",
    "nmpc": "nonlinear predictive control that knows nothing of the drive ahead",
    "nmpc-preview": "nonlinear predictive control that sees 2 s of the drive ahead",
}
"""One line about each by name."""

PREDICTIVE: Final = ("mpc", "nmpc")
"""What a file calls them, as its ``algorithm``."""


def make_predictive(name: str, platform: Platform) -> Policy | ForeknowingPolicy:
    """The controller of a name of :data:`DESCRIPTIONS` for a machine.

    Raises:
        ConfigurationError: a library is missing; the message says how to get it.
    """
    from .mpc import load_mpc, make_mpc
    from .nmpc import NmpcParameters, make_nmpc

    if name.startswith("nmpc"):
        return make_nmpc(platform, NmpcParameters(mpc=load_mpc(name.removeprefix("n"))), name)
    return make_mpc(platform, load_mpc(name), name)


def predictive_from_file(
    values: dict[str, object], path: str | Path, platform: Platform
) -> Policy | ForeknowingPolicy:
    """The controller with the parameters of a file.

    Args:
        values: Of the file; its ``algorithm`` is one of :data:`PREDICTIVE`.
        path: Of the file, for its name and messages.
        platform: The machine.

    Raises:
        ConfigurationError: a field is wrong, or a library is missing.
    """
    from .mpc import MpcParameters, make_mpc
    from .nmpc import NmpcParameters, make_nmpc

    if values["algorithm"] == "nmpc":
        nonlinear = from_dict(NmpcParameters, named(NmpcParameters, values, path), str(path))
        return make_nmpc(platform, nonlinear, Path(path).stem)
    linear = from_dict(MpcParameters, named(MpcParameters, values, path), str(path))
    return make_mpc(platform, linear, Path(path).stem)
