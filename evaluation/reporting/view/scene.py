"""The scene: meshes and geometry of a motion base, for a page that draws it.

All lengths are in meters, x forward, y right, z down. The meshes are those of the environment's own renderer,
so every machine that it draws is drawn here, with or without carriage and turntable.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ....envs.platform import Platform
from ....envs.rendering import theme
from ....envs.rendering.drawing import Mesh, joined
from ....envs.rendering.machine_model import CabParts, Legs, machine_parts

_DIGITS: Final = 4
"""Of a length, a tenth of a millimeter."""
_DRIVER: Final = 2
"""Place of the seat with the driver in the furniture of a cab."""


def scene_of(platform: Platform) -> dict[str, Any]:
    """What a page must know of a machine, as JSON: meshes by the part that they move with, and geometry."""
    hexapod, parts = platform.hexapod, machine_parts(platform)
    legs = Legs.of(hexapod, parts.scale)
    return {
        "name": platform.name,
        "floor": round(parts.floor, _DIGITS),
        "scale": parts.scale,
        "meshes": {
            name: _mesh(one)
            for name, one in {
                "rails": parts.rails,
                "bridge": parts.bridge,
                "carriage": parts.carriage,
                "platform": parts.platform,
                "turntable": parts.turntable,
                "marks": parts.marks,
                **_cab(parts.cab),
            }.items()
            if one is not None
        },
        "legs": {
            "lower": _rows(hexapod.lower_joints),
            "upper": _rows(hexapod.upper_joints),
            "neutral": list(hexapod.neutral),
            "lengths": hexapod.neutral_lengths.tolist(),
            "extension": list(hexapod.extension),
            "barrel": legs.barrel,
            "color": [theme.color_of_use(use) for use in np.linspace(0.0, 1.0, 21).tolist()],
        },
        "carriage": None
        if platform.carriage is None
        else {"x": list(platform.carriage.travel_x), "y": list(platform.carriage.travel_y)},
        "turntable": platform.turntable is not None,
        "head": np.asarray(parts.cab.driver).tolist(),
    }


def _cab(cab: CabParts) -> dict[str, Mesh | None]:
    """Parts that move with the turntable; the driver apart, who is not drawn where the camera is the head."""
    around = [one for i, one in enumerate(cab.furniture) if i != _DRIVER]
    tires = [part for side in cab.wheels for part in side]
    return {
        "inside": joined(*cab.inside),
        "furniture": joined(*around),
        "driver": cab.furniture[_DRIVER],
        "shell": cab.shell,
        "tires": joined(*tires) if tires else None,
    }


def _rows(points: Any) -> list[list[float]]:
    return [[float(value) for value in point] for point in points]


def _mesh(mesh: Mesh) -> dict[str, Any]:
    """Corners, faces of four of them, and for each face its place in a list of looks."""
    looks = np.column_stack([mesh.colors, mesh.gloss, mesh.opacity])
    different, place = np.unique(looks, axis=0, return_inverse=True)
    return {
        "vertices": np.round(mesh.vertices, _DIGITS).ravel().tolist(),
        "faces": mesh.faces.ravel().tolist(),
        "look": place.ravel().tolist(),
        "looks": [
            {"color": look[:3].tolist(), "gloss": round(look[3], 3), "opacity": round(look[4], 3)}
            for look in different
        ],
    }
