"""Parameter sets by name: YAML files beside this module."""

from __future__ import annotations

from pathlib import Path

from ...envs.errors import look_up
from ...envs.settings import load
from .parameters import MpcParameters

_FOLDER = Path(__file__).parent / "presets"


def mpc_presets() -> list[str]:
    """Names :func:`load_mpc` knows."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def load_mpc(name: str | Path) -> MpcParameters:
    """Parameters of a predictive controller, by name or from a YAML file with the fields of MpcParameters.

    Raises:
        UnknownNameError: no set has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field is wrong.
    """
    if Path(name).suffix in (".yaml", ".yml"):
        return load(MpcParameters, name)
    return load(MpcParameters, look_up("predictive controller", str(name), _files()))


def _files() -> dict[str, Path]:
    return {name: _FOLDER / f"{name}.yaml" for name in mpc_presets()}
