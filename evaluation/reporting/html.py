"""Self-contained HTML pages: their templates, their styles and scripts, and data that cannot end a script."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

_PACKAGE: Final = "motion_cueing.evaluation.reporting"


def template(path: str) -> Template:
    """A template by its path in this package, as ``page/report.html``; whatever it shows is escaped."""
    environment = Environment(
        loader=PackageLoader(_PACKAGE, ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(path)


def assets(*paths: str) -> str:
    """Styles or scripts by their paths in this package, one behind the other."""
    return "\n".join(files(_PACKAGE).joinpath(path).read_text(encoding="utf-8") for path in paths)


def script_json(content: Any) -> str:
    """JSON that may stand in a script: no name in it can end the script."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
