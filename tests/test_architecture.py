"""Imports go one way only, as docs/architecture.md says."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from .repository import PACKAGES, ROOT, package_files

BASICS = {"envs.errors", "envs.settings", "envs.storage", "envs.arrays", "envs.cues"}
"""Modules every room may use."""

ALLOWED = {
    "envs": {"envs"},
    "baselines": {"envs", "baselines"},
    "train": {"envs", "baselines", "train"},
    "evaluation": {"envs", "baselines", "train", "evaluation"},
}
"""What each package may import of this project."""

ROOMS = ("envs.car", "envs.platform", "envs.perception")
"""Rooms of envs that know nothing of each other: only the simulator brings them together."""


def module_of(path: Path) -> str:
    """``envs/car/fleet.py`` is ``envs.car.fleet``, a package its own name."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in package_files() if path.suffix == ".py"}


def targets(node: ast.stmt, module: str, path: Path) -> set[str]:
    """Modules of this project that an import statement names."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        above = module.split(".") + (["__init__"] if path.name == "__init__.py" else [])
        base = ".".join(above[: len(above) - node.level]) if node.level else ""
        whole = ".".join(part for part in (base, node.module) if part)
        names = [f"{whole}.{alias.name}" for alias in node.names]
    else:
        return set()
    plain = (name.removeprefix("motion_cueing.") for name in names)
    return {nearest for name in plain if (nearest := nearest_module(name))}


def nearest_module(name: str) -> str | None:
    """The module that holds ``name``: itself, or the one it is an attribute of."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name or None


def imports(module: str, everywhere: bool = True) -> set[str]:
    """Modules of this project that a module imports; when it is loaded, or anywhere in it."""
    path = MODULES[module]
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    nodes = ast.walk(tree) if everywhere else tree.body
    return {name for node in nodes for name in targets(node, module, path)} - {module}


def room(module: str) -> str | None:
    """The room of envs a module stands in."""
    return next((name for name in ROOMS if module == name or module.startswith(f"{name}.")), None)


def test_the_imports_of_known_modules_are_found():
    assert "envs.platform.kernels.geometry" in imports("baselines.washout.kernels.step")
    assert {"envs.cues", "evaluation.trajectory", "baselines.policy"} <= imports("evaluation.rollout")
    assert "evaluation.policies" not in imports("cli.arguments", everywhere=False)
    assert "evaluation.policies" in imports("cli.arguments")
    assert set(ALLOWED) == set(PACKAGES)


@pytest.mark.parametrize("module", MODULES)
def test_a_package_knows_only_those_below_it(module):
    used = {name.split(".")[0] for name in imports(module)}
    assert used <= ALLOWED[module.split(".")[0]]


@pytest.mark.parametrize("module", [module for module in MODULES if room(module)])
def test_rooms_of_envs_know_only_the_basics_and_themselves(module):
    outside = {name for name in imports(module) if room(name) != room(module)}
    assert outside <= BASICS


def test_the_basics_use_no_room():
    assert not {name for module in BASICS for name in imports(module)} - BASICS


def test_no_import_goes_round_in_a_circle():
    graph = {module: imports(module, everywhere=False) for module in MODULES}
    # A package imports its modules to name them; what asks for one of them does not ask for the others.
    plain = {module: names for module, names in graph.items() if MODULES[module].name != "__init__.py"}
    assert list(TopologicalSorter(plain).static_order())
