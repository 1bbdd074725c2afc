"""A wheel: everything is in it, nothing collides with users' folders, and it works on its own."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from .repository import PACKAGES, ROOT, package_files

pytestmark = pytest.mark.slow

LOADERS = ("find_spec", "import_module", "load")
"""Functions whose first argument, where it is text, names a module."""
METADATA = ("pyproject.toml", "setup.py", "README.md", "LICENSE")


def run(*words, cwd) -> str:
    """Output of a command that has to succeed."""
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from a copy: a build leaves files behind, and takes in what an earlier one left."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for path in [*map(Path, METADATA), *package_files()]:
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        (source / path).write_bytes((ROOT / path).read_bytes())
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", out, source, cwd=source)
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """The ``bin`` of a new virtual environment with the wheel in it.

    It borrows the dependencies of the running one, and pip. A folder named in a .pth file has its own .pth
    files ignored, so an editable install of this repository stays out of sight.
    """
    home = tmp_path_factory.mktemp("environment")
    venv.create(home)
    python = home / "bin" / "python"
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=home).strip()
    borrowed = dict.fromkeys(sysconfig.get_path(name) for name in ("purelib", "platlib"))
    (Path(site) / "borrowed.pth").write_text("\n".join(borrowed) + "\n")
    run(python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--force-reinstall",
        "--ignore-installed", wheel, cwd=home)  # fmt: skip
    return home / "bin"


def test_the_wheel_holds_every_file_of_the_packages_and_no_other(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    ours = {name for name in names if ".dist-info/" not in name}
    assert ours == {f"motion_cueing/{path.as_posix()}" for path in package_files()}


@pytest.mark.parametrize(
    "name",
    [
        "envs/py.typed",
        "baselines/washout/classical/presets/est1.yaml",
        "envs/maneuvers/recorded/city-drive/cues.csv.gz",
        "envs/maneuvers/recorded/city-drive/NOTICE.md",
        "envs/maneuvers/recorded/commute/NOTICE.md",
        "evaluation/reporting/page/report.html",
        "evaluation/reporting/page/report.js",
        "evaluation/reporting/page/uPlot.min.css",
    ],
)
def test_data_files_are_in_the_wheel(wheel, name):
    assert zipfile.ZipFile(wheel).getinfo(f"motion_cueing/{name}").file_size >= (0 if "typed" in name else 1)


def test_licenses_are_in_the_wheel(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    licenses = {name.split(".dist-info/licenses/")[1] for name in names if ".dist-info/licenses/" in name}
    notices = {
        path.as_posix()
        for path in package_files()
        if path.name.startswith("NOTICE") or path.name.endswith("-LICENSE.txt")
    }
    assert licenses == {"LICENSE"} | notices


def test_the_command_works_where_only_the_wheel_is(installed, tmp_path):
    listed = run(installed / "motion-cueing", "list", cwd=tmp_path)
    for name in ("classical", "steady-turn", "city-drive", "nads-1", "volvo-v40"):
        assert name in listed
    assert not list(tmp_path.iterdir())


def test_the_command_evaluates_where_only_the_wheel_is(installed, tmp_path):
    words = ("evaluate", "--maneuvers", "lane-change", "--policies", "no-motion", "--out", "out")
    assert "lane-change" in run(installed / "motion-cueing", *words, cwd=tmp_path)
    assert (tmp_path / "out" / "report.html").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_namespace_is_imported_from_the_wheel(installed, tmp_path):
    code = (
        "import motion_cueing.baselines, motion_cueing.evaluation, motion_cueing.train\n"
        "import motion_cueing.envs as e\n"
        "from motion_cueing.envs.platform import get_platform\n"
        "from importlib.util import find_spec\n"
        "print(e.__file__, get_platform('paper').name, [n for n in "
        f"{PACKAGES!r} if find_spec(n)])"
    )
    place, platform, strays = run(installed / "python", "-c", code, cwd=tmp_path).split(maxsplit=2)
    assert Path(place).is_relative_to(installed.parent)
    assert platform == "paper"
    assert strays.strip() == "[]"


@pytest.mark.parametrize(
    "package", ["envs", "envs.car", "envs.platform", "envs.simulator.simulator", "baselines"]
)
def test_importing_needs_no_heavy_library(package, tmp_path):
    code = (
        f"import sys, motion_cueing.{package}\n"
        "print([name for name in ('torch', 'matplotlib', 'jinja2', 'cyclopts') if name in sys.modules])"
    )
    assert run(sys.executable, "-c", code, cwd=tmp_path).strip() == "[]"


@cache
def distributions() -> Mapping[str, list[str]]:
    """Distributions by the module they install; slow to find."""
    return packages_distributions()


def canonical(distribution: str) -> str:
    """A name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", distribution).lower()


def requirements(wheel: Path) -> dict[str, set[str]]:
    """Distributions by extra, as the wheel declares them; those always installed under an empty name."""
    archive = zipfile.ZipFile(wheel)
    (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
    found: dict[str, set[str]] = {}
    for line in re.findall(r"(?m)^Requires-Dist: (.+)$", archive.read(metadata).decode()):
        extra = re.search(r"extra == ['\"](\w+)['\"]", line)
        name = re.match(r"[\w.-]+", line)
        found.setdefault(extra[1] if extra else "", set()).add(canonical(name[0]))
    return found


def imports(node: ast.AST, deferred: bool = False) -> Iterator[tuple[str, bool]]:
    """Modules of other projects, each with whether it waits for a call or serves only type checkers."""
    names: list[str] = []
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and node.level == 0:
        names = [node.module]
    elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
        called = getattr(node.func, "attr", getattr(node.func, "id", ""))
        names = [node.args[0].value] if called in LOADERS and isinstance(node.args[0].value, str) else []
    roots = {name.split(".")[0] for name in names} - {"", "motion_cueing", *sys.stdlib_module_names}
    yield from ((root, deferred) for root in roots)
    typing_only = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    within = deferred or typing_only or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
    for child in ast.iter_child_nodes(node):
        yield from imports(child, within)


EXTRA_OF = {
    "train": "train",
    "baselines/mpc": "optimal",
    "baselines/optimum": "optimal",
    "baselines/symbolic.py": "optimal",
}
"""Folders that nobody imports without the extra, but inside of functions."""


def undeclared(path: Path, text: str, declared: dict[str, set[str]]) -> list[str]:
    """Imports of a file that no declared dependency provides."""
    extras = {extra for folder, extra in EXTRA_OF.items() if path.is_relative_to(folder)}
    wrong = []
    for name, deferred in imports(ast.parse(text)):
        usable = {"", *extras, *(declared.keys() - {"dev"} if deferred else ())}
        allowed = set().union(*(declared[extra] for extra in usable))
        found = {canonical(owner) for owner in distributions().get(name, [])}
        if not found & allowed:
            wrong.append(f"{path.as_posix()}: {name}")
    return wrong


def test_every_import_belongs_to_a_declared_dependency(wheel):
    declared = requirements(wheel)
    libraries = {"sbx", "skrl", "torchrl"}
    assert declared.keys() - libraries == {
        "", "dev", "docs", "export", "logs", "loop", "optimal", "ray", "render", "train",
    }  # fmt: skip
    assert libraries <= declared.keys()
    sources = [path for path in package_files() if path.suffix == ".py"]
    found = [
        line for path in sources for line in undeclared(path, (ROOT / path).read_text("utf-8"), declared)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("path", "text", "wrong"),
    [
        ("envs/a.py", "import numpy.linalg\nfrom .b import c\nimport json", False),
        ("envs/a.py", "import torch", True),
        ("envs/a.py", "class A:\n    import torch", True),
        ("envs/a.py", "def f():\n    import torch", False),
        ("envs/a.py", "def f():\n    from hypothesis import given", True),
        ("envs/a.py", "import pygame", True),
        ("envs/a.py", "def f():\n    load('pygame', 'pygame-ce')", False),
        ("envs/a.py", "import_module('pygame.draw')", True),
        ("train/a.py", "from torch import nn", False),
        ("train/a.py", "import pygame", True),
        ("train/a.py", "import no_such_module_anywhere", True),
    ],
)
def test_what_counts_as_declared(wheel, path, text, wrong):
    assert bool(undeclared(Path(path), text, requirements(wheel))) == wrong


def test_every_folder_of_the_packages_is_tracked(wheel):
    """A folder that git ignores is there for whoever wrote it, and for nobody else."""
    names = zipfile.ZipFile(wheel).namelist()
    folders = {
        Path(name).parent.relative_to("motion_cueing") for name in names if name.endswith("/__init__.py")
    }
    assert set(PACKAGES) <= {folder.as_posix() for folder in folders}
    if shutil.which("git") and (ROOT / ".git").exists():
        tracked = set(run("git", "ls-files", "--", *PACKAGES, cwd=ROOT).splitlines())
        assert [folder for folder in folders if f"{folder.as_posix()}/__init__.py" not in tracked] == []
