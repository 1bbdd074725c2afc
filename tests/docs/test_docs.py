"""The documentation: its code runs, its commands exist, its links lead somewhere."""

from __future__ import annotations

import gc
import importlib.util
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from motion_cueing.cli.main import COMMANDS, parse
from motion_cueing.envs.errors import MotionCueingError
from motion_cueing.envs.provenance import package_version
from motion_cueing.envs.registry import Registry

from ..envs.logs import synthetic_log
from ..repository import ROOT
from ..train import agents

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def registries_as_before():
    """Pages register names of their own; a registry has no way to forget, so its entries are put back."""
    registries = [one for one in gc.get_objects() if isinstance(one, Registry)]
    entries = [dict(one._entries) for one in registries]
    yield
    for one, before in zip(registries, entries, strict=True):
        one._entries = before


DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])
FOLDERS = (
    "baselines",
    "benchmarks",
    "cli",
    "docs",
    "envs",
    "evaluation",
    "examples",
    "realtime",
    "tests",
    "train",
)
_FEW = 'episode={"library": 2, "drive_duration": 22.0}'
SMALL = {
    "4_000_000": "2_000",
    "random_drives(24, 60.0": "random_drives(2, 22.0",
    'gymnasium.make("motion_cueing/CueingPreview-v0")': (
        f'gymnasium.make("motion_cueing/CueingPreview-v0", {_FEW})'
    ),
    'VecEnv(128, "cueing-preview", group=8)': f'VecEnv(8, "cueing-preview", group=8, {_FEW})',
}
"""What makes the training of a tutorial a matter of seconds."""
FEWER = {'group=8, episode={"library": 128})': 'group=8, episode={"library": 2})'}
"""The same of the guide to other libraries."""
GROUPS = {
    '128, "cueing-preview", group=8, stagger=True': f'8, "cueing-preview", {_FEW}, group=8, stagger=True'
}
"""The same of the guide to reinforcement learning."""


def generate():
    """The script that makes generated tables and notebooks."""
    spec = importlib.util.spec_from_file_location("generate", DOCS / "generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    """Fenced blocks of a language; "" for those without one."""
    found = re.findall(r"^```([^\n]*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return [block for name, block in found if name == language]


def commands(text: str) -> list[list[str]]:
    """Words of every ``motion-cueing`` call in blocks and in passing, continued lines joined."""
    lines = [line for block in blocks(text, "") for line in block.replace("\\\n", " ").splitlines()]
    lines += re.findall(r"`(motion-cueing [^`]+)`", text)
    return [shlex.split(line, comments=True) for line in lines if line.startswith("motion-cueing ")]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the log and the agent that the examples speak of."""
    truth = synthetic_log.drive()
    log = synthetic_log.Device(pitch=0.1, yaw=0.2).records(truth)
    log["t"], log["ay"], log["gps_speed"] = 1000.0 * log["t"], -log["ay"], 3.6 * log["v"]
    synthetic_log.write(tmp_path / "drive.csv", log)
    agents.agent().save(tmp_path / "runs" / "first" / "best.safetensors")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    return tmp_path


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(text_of(p), "python")],
                         ids=lambda page: page.relative_to(ROOT).as_posix())  # fmt: skip
def test_python_runs(page, folder):
    def smaller(code: str) -> str:
        for large, small in (SMALL | FEWER | GROUPS).items():
            code = code.replace(large, small)
        return code

    generate().run_page(page, smaller)
    shown = re.findall(r"\]\(images/(\d-[\w.-]+)\)", text_of(page))
    assert [name for name in shown if not (folder / name).exists()] == []


def test_small_trainings_are_in_the_pages():
    text = text_of(DOCS / "tutorials" / "2-train.md")
    assert [large for large in SMALL if large not in text] == []
    text = text_of(DOCS / "guides" / "other-libraries.md")
    assert [large for large in FEWER if large not in text] == []
    text = text_of(DOCS / "guides" / "reinforcement-learning.md")
    assert [large for large in GROUPS if large not in text] == []


def test_the_first_example_scores_better_than_standing_still_and_the_second_keeps_an_agent(folder, capsys):
    code = "\n".join(blocks(text_of(ROOT / "README.md"), "python"))
    for large, small in SMALL.items():
        code = code.replace(large, small)
    exec(code, {"__name__": "page"})
    # J of no motion in the lane change is 1.7.
    assert 0.0 < float(capsys.readouterr().out) < 1.5
    assert Path("mine.safetensors").exists()


def test_the_import_of_the_example_finds_the_drive(folder):
    names: dict[str, object] = {}
    for block in blocks(text_of(DOCS / "guides" / "import-a-log.md"), "python"):
        exec(block, names)
    found = names["imported"].trace.specific_force
    truth = synthetic_log.drive()
    force = np.stack([np.interp(np.arange(len(found)) * 0.01, truth.time, f) for f in truth.force.T], axis=1)
    assert np.abs(found - force)[100:-100].max() < 0.1


def test_links_and_pictures_lead_somewhere():
    """What `make docs` finds in links between pages, and pictures and files of the repository besides."""
    broken = []
    for page in PAGES:
        targets = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```", "", text_of(page), flags=re.S))
        local = [target.split("#")[0] for target in targets if "://" not in target and target[0] != "#"]
        made = {".ipynb"}  # notebooks are made from the pages
        broken += [
            f"{page.relative_to(ROOT)}: {target}"
            for target in local
            if Path(target).suffix not in made and not (page.parent / target).exists()
        ]
    assert broken == []


def test_files_and_make_targets_exist():
    makefile = text_of(ROOT / "Makefile")
    missing = []
    for page in PAGES:
        text = text_of(page)
        named = re.findall(rf"`((?:{'|'.join(FOLDERS)})/[\w/.-]+)`", text)
        missing += [f"{page.name}: {name}" for name in named if not (ROOT / name).exists()]
        targets = set(re.findall(r"`make ([a-z-]+)[^`]*`", text)) | set(
            re.findall(r"^make ([a-z-]+)", text, re.M)
        )
        missing += [
            f"{page.name}: make {target}"
            for target in targets
            if not re.search(rf"^{target}:", makefile, re.M)
        ]
    assert missing == []


def test_commands_are_accepted():
    """By the parser; those with a placeholder such as NAME are of an existing command."""
    wrong = []
    for page in PAGES:
        for _, *words in commands(text_of(page)):
            if not words or words[0].startswith("-") or words[0].isupper():
                continue
            if words[0] not in COMMANDS:
                wrong.append(f"{page.name}: {words[0]}")
            elif not any(re.fullmatch(r"[A-Z]+(\.[a-z]+)?|\.\.\.", word) for word in words) and words[1:]:
                try:
                    parse(words[0], words[1:])
                except MotionCueingError as error:
                    wrong.append(f"{page.name}: {' '.join(words)}: {error}")
    assert wrong == []


def test_code_names_pages_that_exist():
    """In docstrings, comments, help texts and configuration: pages by their paths from the root."""
    files = [ROOT / "Makefile", *ROOT.glob("*.py"), *ROOT.glob("*.toml"), *ROOT.glob("*.yml")]
    for folder in FOLDERS:
        files += [path for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".yaml", ".html")]
    missing = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in files
        for name in re.findall(r"\bdocs/[\w./-]+\.md\b", text_of(path))
        if not (ROOT / name).exists()
    ]
    assert missing == []


def test_the_architecture_names_every_folder():
    """Packages and the packages in them, one line each."""
    table = re.findall(r"^\| \**`([\w/]+)`\** \|", text_of(DOCS / "explanation" / "architecture.md"), re.M)
    packages = [ROOT / name for name in ("envs", "baselines", "train", "evaluation", "realtime", "cli")]
    folders = [*packages, *(path.parent for top in packages for path in top.glob("*/__init__.py"))]
    assert sorted(table) == sorted(path.relative_to(ROOT).as_posix() for path in folders)


def test_the_site_shows_every_page():
    """The navigation of the site names each page, and only pages that exist."""
    text = text_of(ROOT / "mkdocs.yml")
    named = set(re.findall(r"([\w/.-]+\.md)\s*$", text, re.M))
    assert named == {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")}


def test_every_folder_of_pages_has_an_index_that_names_them():
    for index in DOCS.glob("*/index.md"):
        text = text_of(index)
        pages = {page.name for page in index.parent.glob("*.md")} - {"index.md"}
        assert {page for page in pages if f"({page})" not in text} == set(), index


def test_the_readme_is_short():
    assert len(text_of(ROOT / "README.md").split()) < 700


def test_the_readme_shows_the_figures_of_the_benchmark():
    """J, perceived J, tilt rate and step time, to the digits of the README."""

    def rows(page: Path) -> dict[str, list[str]]:
        lines = [
            line.strip("|* ").split("|") for line in text_of(page).splitlines() if line.startswith("| `")
        ]
        return {re.match(r"`([\w-]+)`", line[0])[1]: [cell.strip() for cell in line] for line in lines}

    shown, measured = rows(ROOT / "README.md"), rows(DOCS / "results" / "benchmark.md")
    assert len(shown) == 6
    # The benchmark's page has a table by drive, too, whose first column is a maneuver.
    for policy, (_, _, *cells) in shown.items():
        for cell, column in zip(cells, (1, 2, 8, 11), strict=True):
            digits = len(cell.partition(".")[2])
            assert cell == f"{float(measured[policy][column]):.{digits}f}", policy


def test_a_table_of_fields_has_every_field_with_its_default_and_meaning():
    @dataclass(frozen=True)
    class Inner:
        """An inner one.

        Args:
            low: Least value, m.
        """

        low: float = 0.5

    @dataclass(frozen=True)
    class Outer:
        """An outer one.

        Args:
            name: How it is
                called.
            inner: Its part, or None.
        """

        name: str
        inner: Inner | None = None

    made = generate()
    # Annotations as text are looked up in the module.
    Outer.__annotations__ = {"name": str, "inner": Inner | None}
    Inner.__annotations__ = {"low": float}
    assert list(made.field_rows(Outer)) == [
        ("`name`", "required", "How it is called."),
        ("`inner`", "none", "Its part, or None."),
        ("`inner.low`", "`0.5`", "Least value, m."),
    ]


def test_every_generated_table_of_a_page_is_made(tmp_path):
    made = generate()
    made.GENERATED = tmp_path / "generated"
    made.write_tables()
    shown = {name for page in PAGES for name in re.findall(r'--8<-- "([\w.-]+)"', text_of(page))}
    assert shown == {path.name for path in made.GENERATED.iterdir()}
    assert all(
        path.read_text(encoding="utf-8").startswith(("| ", "```yaml")) for path in made.GENERATED.iterdir()
    )


def test_tutorials_are_notebooks_too(tmp_path):
    jupytext = pytest.importorskip("jupytext")
    for page in generate().TUTORIALS:
        notebook = jupytext.reads(text_of(page), fmt="md")
        code = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
        assert code == [block.rstrip("\n") for block in blocks(text_of(page), "python")]


def test_the_citation_file_has_what_its_format_requires_and_the_version():
    citation = yaml.safe_load(text_of(ROOT / "CITATION.cff"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert all("name" in author for author in citation["authors"])
    assert citation["version"] == package_version()
