"""Parameter sets that come with the package or are a user's YAML files, and the cache folder."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from ..envs.errors import UnknownNameError
from ..envs.settings import from_dict, load, read_yaml


def cache_folder() -> Path:
    """Folder for results that take long to compute; it may be deleted at any time.

    It is ``MOTION_CUEING_CACHE`` of the environment, else ``motion-cueing`` in ``XDG_CACHE_HOME`` or in
    ``~/.cache``.
    """
    chosen = os.environ.get("MOTION_CUEING_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "motion-cueing"


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
        return from_dict(cls, named(cls, read_yaml(path), path), str(path))
    if str(name) not in preset_names(folder):
        raise UnknownNameError(kind, str(name), preset_names(folder))
    return load(cls, folder / f"{name}.yaml")


def named(cls: type[Any], values: object, path: str | Path) -> object:
    """Values of a user's file, in which ``name`` and ``description`` may stand or not, whatever it is of.

    Args:
        cls: The configuration it is of.
        values: That stand in the file.
        path: Of the file; its stem is the name unless one is given.
    """
    if not isinstance(values, dict):
        return values
    known = {field.name for field in fields(cls)}
    if "algorithm" not in known and values.get("algorithm") == "classical":
        # What a file is where it says nothing may be said.
        values = {name: value for name, value in values.items() if name != "algorithm"}
    if "name" in known:
        return {"name": Path(path).stem, "description": f"set of {path}", **values}
    return {name: value for name, value in values.items() if name not in ("name", "description")}
