"""A wheel: everything is in it, nothing collides with users' folders, and it works on its own."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from .repository import PACKAGES, ROOT, package_files

METADATA = ("pyproject.toml", "README.md", "LICENSE")


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

    It borrows the dependencies of the running one. A folder named in a .pth file has its own .pth
    files ignored, so an editable install of this repository stays out of sight.
    """
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=True)
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
        "baselines/washout/presets/est1.yaml",
        "envs/car/recorded/city-drive/cues.csv.gz",
        "envs/car/recorded/city-drive/NOTICE.md",
        "envs/car/recorded/commute/NOTICE.md",
        "evaluation/report.html",
    ],
)
def test_data_files_are_in_the_wheel(wheel, name):
    assert zipfile.ZipFile(wheel).getinfo(f"motion_cueing/{name}").file_size >= (0 if "typed" in name else 1)


def test_licences_are_in_the_wheel(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    licences = {name.split(".dist-info/licenses/")[1] for name in names if ".dist-info/licenses/" in name}
    notices = {path.as_posix() for path in package_files() if path.name.startswith("NOTICE")}
    assert licences == {"LICENSE"} | notices


def test_the_command_works_where_only_the_wheel_is(installed, tmp_path):
    listed = run(installed / "motion-cueing", "list", cwd=tmp_path)
    for name in ("classical", "steady-turn", "city-drive", "nads-1", "volvo-v40"):
        assert name in listed
    assert not list(tmp_path.iterdir())


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


@pytest.mark.parametrize("package", ["envs", "envs.car", "envs.platform", "envs.simulator", "baselines"])
def test_importing_needs_no_heavy_library(package, tmp_path):
    code = (
        f"import sys, motion_cueing.{package}\n"
        "print([name for name in ('torch', 'matplotlib', 'jinja2', 'tyro') if name in sys.modules])"
    )
    assert run(sys.executable, "-c", code, cwd=tmp_path).strip() == "[]"
