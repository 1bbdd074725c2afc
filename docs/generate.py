"""Write what the documentation takes from the code: tables of declarations, help texts, notebooks.

``python docs/generate.py`` fills ``build/generated`` with tables, which pages include as snippets, and makes
a notebook beside every tutorial. ``--pictures`` first runs the tutorials and keeps the pictures they show.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import io
import os
import re
import shutil
import sys
import tempfile
import types
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, get_args, get_type_hints
from unittest.mock import patch

DOCS = Path(__file__).resolve().parent
TUTORIALS = sorted((DOCS / "tutorials").glob("[0-9]-*.md"))
GENERATED = DOCS.parent / "build" / "generated"
PACKAGES = ("envs", "baselines", "train", "evaluation", "realtime")


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; pipes within cells are escaped."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_cell(cell) for cell in line) + " |" for line in lines) + "\n"


def _cell(value: object) -> str:
    return re.sub(r"\s+", " ", str(value)).replace("|", "\\|").strip()


# Configurations: a row for each field, with its default and the line of its docstring.


def argument_texts(cls: type[Any]) -> dict[str, str]:
    """The lines under ``Args:`` of a docstring, by name."""
    doc = inspect.getdoc(cls) or ""
    found: dict[str, str] = {}
    name = ""
    for line in doc.partition("Args:\n")[2].splitlines():
        if line and not line.startswith(" "):
            break
        begins = re.match(r"    (\w+): (.*)", line)
        if begins:
            name, found[begins[1]] = begins[1], begins[2]
        elif name and line.strip():
            found[name] += " " + line.strip()
    return {key: _plain(text) for key, text in found.items()}


def _plain(text: str) -> str:
    """Sphinx's roles as code."""
    return re.sub(r":\w+:`[~!.]*([^`]+)`", r"`\1`", text).replace("``", "`")


def field_rows(cls: type[Any], prefix: str = "", depth: int = 3) -> Iterator[tuple[str, str, str]]:
    """Name, default and meaning of every field, those of nested configurations with dots."""
    texts, hints = argument_texts(cls), get_type_hints(cls)
    for item in dataclasses.fields(cls):
        yield f"`{prefix}{item.name}`", _default(item), texts.get(item.name, "")
        nested = _nested(hints[item.name])
        if nested is not None and depth > 0:
            yield from field_rows(nested, f"{prefix}{item.name}.", depth - 1)


def _nested(hint: Any) -> type[Any] | None:
    """The configuration within an annotation, if there is one."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return hint
    if getattr(hint, "__origin__", None) in (tuple, list, dict):
        return None
    found = (_nested(part) for part in get_args(hint))
    return next((cls for cls in found if cls is not None), None)


def _default(item: dataclasses.Field[Any]) -> str:
    value = item.default
    if value is dataclasses.MISSING and item.default_factory is not dataclasses.MISSING:
        value = item.default_factory()
    if value is dataclasses.MISSING:
        return "required"
    if dataclasses.is_dataclass(value) or value == ():
        return ""
    return "none" if value is None else f"`{_number(value)}`"


def _number(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple):
        return "[" + ", ".join(_number(entry) for entry in value) + "]" if len(value) < 10 else "[...]"
    return str(value)


def fields_table(cls: type[Any]) -> str:
    """A table of a configuration."""
    return table(("field", "default", "meaning"), field_rows(cls))


# The environment.


def action_table() -> str:
    """What an action of 1 stands for on each machine."""
    from motion_cueing.envs.platform import get_platform, platform_names
    from motion_cueing.envs.task.kernels.action import acceleration_scale

    def cells(name: str) -> list[str]:
        scale = acceleration_scale(get_platform(name))
        groups = (scale[:2], scale[2:5], scale[5:8], scale[8:])
        return [", ".join(f"{v:.2f}" for v in group) if group.any() else "none" for group in groups]

    header = (
        "machine",
        "carriage m/s²",
        "surge, sway, heave m/s²",
        "roll, pitch, yaw rad/s²",
        "turntable rad/s²",
    )
    return table(header, [(f"`{name}`", *cells(name)) for name in platform_names()])


# Files that people write.


def configuration_tables() -> dict[str, str]:
    """Fields of machines, cars, washouts, predictive controllers, tasks and trainings."""
    from motion_cueing.baselines.mpc import MpcParameters
    from motion_cueing.baselines.washout import WashoutParameters
    from motion_cueing.baselines.washout.adaptive import AdaptiveParameters
    from motion_cueing.baselines.washout.optimal import OptimalParameters
    from motion_cueing.envs.car import Car
    from motion_cueing.envs.platform import Platform
    from motion_cueing.envs.task import TaskOptions
    from motion_cueing.train.config import TrainingConfig

    tables = {
        "platform": Platform,
        "car": Car,
        "washout": WashoutParameters,
        "mpc": MpcParameters,
        "task": TaskOptions,
    }
    found = {f"fields-{name}": fields_table(cls) for name, cls in tables.items()}
    training = (row for row in field_rows(TrainingConfig) if not row[0].startswith("`task."))
    found["fields-training"] = table(("field", "default", "meaning"), training)
    common = {item.name for item in dataclasses.fields(WashoutParameters)}
    for name, cls in {"adaptive": AdaptiveParameters, "optimal": OptimalParameters}.items():
        own = (row for row in field_rows(cls) if row[0].strip("`").split(".")[0] not in common)
        found[f"fields-{name}"] = table(("field", "default", "meaning"), own)
    return found


# The command line.


def command_line() -> str:
    """Every command with its help."""
    from motion_cueing.cli.main import COMMANDS, main

    def help_of(*words: str) -> str:
        out = io.StringIO()
        plain = patch.dict(os.environ, COLUMNS="110", NO_COLOR="1", TERM="dumb")
        with plain, contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            main([*words, "--help"])
        return re.sub(r"\x1b\[[0-9;]*m", "", out.getvalue()).strip()

    rows = [(f"[`{name}`](#{name})", command.summary) for name, command in COMMANDS.items()]
    parts = [table(("command", "what it does"), rows)]
    for name, command in COMMANDS.items():
        summary = command.summary[0].upper() + command.summary[1:]
        parts.append(f"## {name}\n\n{summary.rstrip('.')}.\n\n```text\n{help_of(name)}\n```\n")
    return "\n".join(parts)


def link_packages() -> None:
    """Fill ``build/api`` with the packages alone: what mkdocstrings reads, without tests and environments."""
    folder = GENERATED.parent / "api" / "motion_cueing"
    folder.mkdir(parents=True, exist_ok=True)
    for name in PACKAGES:
        if not (folder / name).exists():
            (folder / name).symlink_to(DOCS.parent / name)


def telemetry() -> str:
    """Every protocol that the bridge reads, with the bytes that it takes."""
    from motion_cueing.envs.telemetry import get_source, source_names

    sources = [get_source(name) for name in source_names()]
    rows = [(f"[`{one.name}`](#{one.name})", one.summary, one.uncertain or "nothing") for one in sources]
    parts = [table(("protocol", "program", "left open by its description"), rows)]
    for source in sources:
        parts.append(f"### {source.name}\n")
        for layout in source.layouts:
            rows = [(f"`{field}`", place, kind, meaning) for place, kind, field, meaning in layout.rows()]
            title = f"{layout.name}, {layout.size} bytes:"
            parts.append(f"{title}\n\n" + table(("field", "bytes", "type", "meaning"), rows))
    return "\n".join(parts)


def learning_tasks() -> str:
    """The file of the task `cueing`."""
    file = resources.files("motion_cueing.envs.task") / "presets" / "cueing.yaml"
    return f"```yaml\n{file.read_text(encoding='utf-8')}```"


def write_tables() -> None:
    """Fill ``build/generated``."""
    from motion_cueing.envs.task.kernels.observation import observation_table
    from motion_cueing.envs.task.kernels.reward import reward_table
    from motion_cueing.evaluation.reporting.report import definitions

    texts = {
        **definitions(),
        **configuration_tables(),
        "observation-rows": observation_table(),
        "learning-tasks": learning_tasks(),
        "telemetry": telemetry(),
        "reward-terms": reward_table(),
        "action-scale": action_table(),
        "command-line": command_line(),
    }
    GENERATED.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (GENERATED / f"{name}.md").write_text(text, encoding="utf-8")


# Tutorials.


def write_notebooks() -> None:
    """A notebook beside every tutorial, without outputs."""
    import jupytext

    for page in TUTORIALS:
        notebook = jupytext.reads(page.read_text(encoding="utf-8"), fmt="md")
        notebook.metadata["kernelspec"] = {
            "name": "python3",
            "display_name": "Python 3",
            "language": "python",
        }
        jupytext.write(notebook, page.with_suffix(".ipynb"), fmt="ipynb")


def python_blocks(page: Path) -> list[str]:
    """The Python of a page, block by block."""
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def run_page(page: Path, edit: Callable[[str], str] = lambda code: code) -> None:
    """Run a page's Python in the current folder."""
    module = sys.modules["page"] = types.ModuleType("page")  # dataclasses look their module up
    for block in python_blocks(page):
        exec(compile(edit(block), page.name, "exec"), module.__dict__)


def keep_pictures() -> None:
    """Run the tutorials and copy the pictures that their pages show to ``docs/tutorials/images``."""
    for page in TUTORIALS:
        shown = re.findall(r"\]\(images/([\w.-]+)\)", page.read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            run_page(page)
            for name in shown:
                shutil.copy(name, DOCS / "tutorials" / "images" / name)


if __name__ == "__main__":
    if "--pictures" in sys.argv:
        keep_pictures()
    link_packages()
    write_tables()
    write_notebooks()
