"""The documentation: its code runs, its commands exist, its links lead somewhere."""

from __future__ import annotations

import re
import shlex

import numpy as np
import pytest
import yaml

from motion_cueing.cli.main import COMMANDS, main
from motion_cueing.envs.provenance import package_version

from .envs.logs import synthetic_log
from .repository import PACKAGES, ROOT
from .train import agents

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
NAMES = [page.relative_to(ROOT).as_posix() for page in PAGES]
EVERY_PAGE = pytest.mark.parametrize("page", PAGES, ids=NAMES)


def blocks(text: str, language: str) -> list[str]:
    """Fenced blocks of a language; "" for those without one."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


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
    return tmp_path


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p.read_text(encoding="utf-8"), "python")],
                         ids=lambda page: page.name)  # fmt: skip
def test_python_runs(page, folder):
    names: dict[str, object] = {"__name__": "page"}
    for block in blocks(page.read_text(encoding="utf-8"), "python"):
        exec(compile(block, page.name, "exec"), names)


def test_the_first_example_scores_the_washout_better_than_standing_still(folder, capsys):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    exec("\n".join(blocks(text, "python")), {"__name__": "page"})
    washout, still = map(float, capsys.readouterr().out.split())
    assert 0.0 < washout < still


def test_the_import_of_the_example_finds_the_drive(folder):
    page = ROOT / "docs" / "recorded-drives.md"
    names: dict[str, object] = {}
    for block in blocks(page.read_text(encoding="utf-8"), "python"):
        exec(block, names)
    found = names["imported"].trace.specific_force
    truth = synthetic_log.drive()
    force = np.stack([np.interp(np.arange(len(found)) * 0.01, truth.time, f) for f in truth.force.T], axis=1)
    assert np.abs(found - force)[100:-100].max() < 0.1


@EVERY_PAGE
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    local = [target.split("#")[0] for target in targets if "://" not in target and target[0] != "#"]
    assert [target for target in local if not (page.parent / target).exists()] == []


@EVERY_PAGE
def test_files_and_make_targets_exist(page):
    text = page.read_text(encoding="utf-8")
    folders = "|".join((*PACKAGES, "tests", "docs", "examples", "benchmarks"))
    named = re.findall(rf"`((?:{folders})/[\w/.-]+)`", text)
    assert [name for name in named if not (ROOT / name).exists()] == []
    targets = set(re.findall(r"`make ([a-z]+)[^`]*`", text)) | set(re.findall(r"^make ([a-z]+)", text, re.M))
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert {target for target in targets if not re.search(rf"^{target}:", makefile, re.M)} == set()


@EVERY_PAGE
def test_commands_and_their_options_exist(page, capsys):
    for _, *words in commands(page.read_text(encoding="utf-8")):
        name = words[0]
        if name.startswith("-") or name.isupper():
            continue
        assert name in COMMANDS
        assert main([name, "--help"]) == 0
        known = set(re.findall(r"--[a-z][a-z0-9-]*", capsys.readouterr().out))
        assert {word for word in words if word.startswith("--")} <= known


def test_the_index_names_every_page():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"README.md"}
    assert {page for page in pages if f"({page})" not in index} == set()


def test_the_citation_file_has_what_its_format_requires_and_the_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert all("name" in author for author in citation["authors"])
    assert citation["version"] == package_version()
