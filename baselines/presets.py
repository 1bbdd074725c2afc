"""Parameter sets that come with the package, a YAML file each, and those of users."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from ..envs.errors import UnknownNameError
from ..envs.settings import load

T = TypeVar("T")


def preset_names(folder: Path) -> list[str]:
    """Names of the parameter sets in a folder."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def load_preset(cls: type[T], kind: str, name: str | Path, folder: Path) -> T:
    """A parameter set by its name in a folder, or from a YAML file.

    Args:
        cls: The configuration it is.
        kind: What it is called in messages.
        name: A name, or a path that ends in .yaml or .yml.
        folder: Of the sets that go by name.

    Raises:
        UnknownNameError: no set has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return load(cls, path)
    if str(name) not in preset_names(folder):
        raise UnknownNameError(kind, str(name), preset_names(folder))
    return load(cls, folder / f"{name}.yaml")
