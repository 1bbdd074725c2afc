"""The layout as a test: which room may import which, and no circle of imports at any level."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from .repository import PACKAGES, ROOT, package_files

BASICS = "envs"
"""Modules that stand directly in envs (errors, settings, cues ...): every room may use them."""

ROOMS = {
    "envs": set(),
    "envs.car": {"envs"},
    "envs.maneuvers": {"envs", "envs.car"},
    "envs.logs": {"envs", "envs.telemetry"},
    "envs.telemetry": {"envs"},
    "envs.platform": {"envs"},
    "envs.perception": {"envs"},
    "envs.simulator": {"envs", "envs.perception", "envs.platform"},
    "envs.rendering": {"envs", "envs.platform", "envs.simulator"},
    "envs.task": {
        "envs",
        "envs.car",
        "envs.maneuvers",
        "envs.perception",
        "envs.platform",
        "envs.rendering",
        "envs.simulator",
    },
    "baselines": {"envs"},
    "train": {"envs", "baselines"},
    "evaluation": {"envs", "baselines", "train"},
    "realtime": {"envs", "baselines", "train", "evaluation"},
    "cli": {"envs", "baselines", "train", "evaluation", "realtime"},
}
"""What each room may import beside itself; `envs` stands for all of envs outside of envs itself."""

EXCEPTIONS = {("evaluation.__main__", "cli")}
"""``python -m motion_cueing.evaluation`` is the command line by another name."""


def module_of(path: Path) -> str:
    """``envs/car/vehicles.py`` is ``envs.car.vehicles``, a package its own name."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in package_files() if path.suffix == ".py"}


def room(module: str) -> str:
    """The room a module stands in."""
    inner = ".".join(module.split(".")[:2])
    return inner if inner in ROOMS else module.split(".")[0]


def runtime_nodes(tree: ast.AST) -> list[ast.AST]:
    """All nodes but those under ``if TYPE_CHECKING``, which never run."""
    nodes: list[ast.AST] = []
    for child in ast.iter_child_nodes(tree):
        if (
            isinstance(child, ast.If)
            and isinstance(child.test, ast.Name)
            and child.test.id == "TYPE_CHECKING"
        ):
            nodes += [inner for statement in child.orelse for inner in runtime_nodes(statement)]
        else:
            nodes += [child, *runtime_nodes(child)]
    return nodes


def imports(module: str) -> set[str]:
    """Modules of this project that a module imports, at its top or inside functions."""
    path = MODULES[module]
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    found: set[str] = set()
    for node in runtime_nodes(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            whole = [*base, *(node.module.split(".") if node.module else [])]
            names = [".".join([*whole, alias.name]) for alias in node.names]
        for name in names:
            plain = name.removeprefix("motion_cueing.")
            while plain and plain not in MODULES:
                plain = plain.rpartition(".")[0]
            if plain:
                found.add(plain)
    return found - {module}


IMPORTS = {module: imports(module) for module in MODULES}


def test_the_imports_of_known_modules_are_found():
    assert "envs.platform.kernels.geometry" in IMPORTS["baselines.washout.kernels.step"]
    assert {"envs.cues", "evaluation.trajectory", "baselines.policy"} <= IMPORTS["evaluation.rollout"]
    assert {room(module) for module in MODULES} == set(ROOMS)
    assert {name.split(".")[0] for name in ROOMS} == set(PACKAGES)


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_imports_only_what_the_layout_says(name):
    allowed = ROOMS[name] | {name}
    if not name.startswith("envs"):
        allowed |= {inner for inner in ROOMS if inner.split(".")[0] in allowed}
    for module in MODULES:
        if room(module) == name:
            outside = {used for used in IMPORTS[module] if room(used) not in allowed}
            outside = {used for used in outside if (module, room(used)) not in EXCEPTIONS}
            assert not outside, f"{module} imports {sorted(outside)}"


def test_no_import_goes_round_in_a_circle():
    # A package names what its modules define; its modules import each other, not the package.
    graph = {m: used for m, used in IMPORTS.items() if MODULES[m].name != "__init__.py"}
    try:
        list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))
