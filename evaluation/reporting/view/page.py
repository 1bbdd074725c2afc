"""The page of a view: one HTML file with the machine, its drives and the library that draws them."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ....envs.platform import Platform
from ....envs.storage import write_text
from ..html import assets, script_json, template
from ..packing import MISSING, PackedDrive
from ..signals import looks
from .scene import scene_of

STYLES: Final = ("page/uPlot.min.css", "page/report.css", "view/view.css")
LIBRARIES: Final = (
    "page/uPlot.iife.min.js",
    "page/unpack.js",
    "view/three.iife.min.js",
    "view/stage.js",
    "view/charts.js",
    "view/machine.js",
    "view/film.js",
)
"""What every page with a machine in it needs, in this order."""


def render_view(drives: Mapping[str, PackedDrive], platform: Platform, title: str = "") -> str:
    """The page.

    Args:
        drives: Of :func:`~.motion.pack_view`, by maneuver; at least one.
        platform: The machine that drove them.
        title: Of the page; default: the first drive and the machine.
    """
    names = list(dict.fromkeys(name for drive in drives.values() for name in drive.about["policies"]))
    about = {
        "drives": list(drives),
        "policies": names,
        "styles": {name: {"color": color, "dash": dash} for name, (color, dash) in looks(names).items()},
        "missing": MISSING,
    }
    return template("view/view.html").render(
        title=title or f"{next(iter(drives))} on the motion base {platform.name}",
        styles=assets(*STYLES),
        scripts=assets(*LIBRARIES, "view/view.js"),
        about=script_json(about),
        scene=deflated(scene_of(platform)),
        packed=[script_json(drive.content) for drive in drives.values()],
    )


def save_view(
    drives: Mapping[str, PackedDrive], platform: Platform, path: str | Path, title: str = ""
) -> None:
    """Write the page, whole or not at all."""
    write_text(path, render_view(drives, platform, title))


def render_live(platform: Platform, policy: str, states: Mapping[int, str]) -> str:
    """The page of a machine that moves now; it reads the stream of events ``/frames`` of its server.

    Args:
        platform: The machine.
        policy: Name of the policy.
        states: States of the controller in words.
    """
    return template("view/live.html").render(
        title=f"{policy} on the motion base {platform.name}, live",
        styles=assets(*STYLES),
        scripts=assets(*LIBRARIES, "view/live.js"),
        about=script_json({"policy": policy, "states": states}),
        scene=deflated(scene_of(platform)),
    )


def deflated(content: Any) -> str:
    """JSON, deflated, in base64: for data that is large beside what it says."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")
