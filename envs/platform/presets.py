"""Platforms by name: the paper's machine, real ones for comparison, and each with subsystems locked.

Figures marked (m) are class values or from the literature as remembered, not read off a data sheet.
"""

from __future__ import annotations

import math
from dataclasses import replace as replaced
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..errors import GeometryError, UnknownNameError
from ..registry import Registry
from ..settings import Vector3, load
from .kinematics import check_geometry
from .machines import Carriage, Hexapod, Joints, Platform, Turntable

_ABLATIONS: Final = {
    "no-turntable": (("turntable",), "its turntable locked"),
    "no-carriage": (("carriage",), "its carriage locked"),
    "hexapod-only": (("turntable", "carriage"), "turntable and carriage locked"),
}
"""Subsystems that a machine loses, and how that is described, by the end of its name."""


def ablations(platform: Platform) -> list[Platform]:
    """The machine without turntable, without carriage and with the hexapod alone, as far as it has them.

    The names are the machine's with -no-turntable, -no-carriage and -hexapod-only at the end.
    """
    found = []
    for suffix, (parts, about) in _ABLATIONS.items():
        if all(getattr(platform, part) is not None for part in parts):
            locked: dict[str, Any] = dict.fromkeys(parts)
            described: dict[str, Any] = {
                "name": f"{platform.name}-{suffix}",
                "description": f"{platform.name} with {about}",
            }
            found.append(replaced(platform, **locked, **described))
    return found


_PAPER_UPPER: Final = (
    (1.5969, 0.1), (-0.7118, 1.4329), (-0.885, 1.3329), (-0.885, -1.3329), (-0.7118, -1.4329), (1.5969, -0.1),
)  # fmt: skip
_PAPER_LOWER: Final = (
    (1.0711, 1.2551), (0.5514, 1.5551), (-1.6225, 0.3), (-1.6225, -0.3), (0.5514, -1.5551), (1.0711, -1.2551),
)  # fmt: skip


def _planar(points: tuple[tuple[float, float], ...]) -> Joints:
    return tuple((x, y, 0.0) for x, y in points)


def joint_pairs(radius: float, spacing: float, first: float) -> Joints:
    """Six joints in three pairs on a circle.

    Args:
        radius: Of the circle, m.
        spacing: Distance between the two joints of a pair, m.
        first: Direction of the first pair from x towards y, rad; the others follow every 120 degrees.
    """
    half = math.asin(0.5 * spacing / radius)
    angles = [first + k * 2.0 * math.pi / 3.0 + sign * half for k in range(3) for sign in (-1.0, 1.0)]
    return tuple((radius * math.cos(a), radius * math.sin(a), 0.0) for a in angles)


def paired_hexapod(upper: tuple[float, float], lower: tuple[float, float]) -> tuple[Joints, Joints]:
    """Joints A_i and B_i of a hexapod given by radius and pair spacing above and below.

    Pairs above stand at 0, 120 and 240 degrees, pairs below between them; each leg joins neighbors.
    """
    above = joint_pairs(*upper, first=0.0)
    below = joint_pairs(*lower, first=math.pi / 3.0)
    return (*above[1:], above[0]), below


def neutral_height(upper: Joints, lower: Joints, length: float) -> Vector3:
    """S_0 above the middle of the base at which the legs have this root-mean-square length, m.

    Raises:
        GeometryError: the legs are too short to close.
    """
    flat = np.array(upper)[:, :2] - np.array(lower)[:, :2]
    span = math.sqrt(float(np.mean(np.sum(flat**2, axis=1))))
    if length <= span:
        raise GeometryError(
            f"the hexapod cannot close: legs of {length:.3f} m do not reach between the joints, "
            f"which lie {span:.3f} m apart in plan; lengthen the legs or move the joints"
        )
    return (0.0, 0.0, -math.sqrt(length**2 - span**2))


def paper() -> Platform:
    """The paper's machine: turntable on a hexapod (+-0.67 m) on a carriage (+-13.72 m).

    Strokes are the paper's; the joints are SIMONA's (m), turntable rates NADS-1's class (m).
    """
    return Platform(
        name="paper",
        description="unlimited turntable on a +-0.67 m hexapod on a +-13.72 m carriage (the paper's)",
        carriage=Carriage(
            travel_x=(-13.72, 13.72), travel_y=(-13.72, 13.72), velocity=6.0, acceleration=0.6 * 9.81
        ),
        hexapod=Hexapod(
            upper_joints=_planar(_PAPER_UPPER),
            lower_joints=_planar(_PAPER_LOWER),
            neutral=(0.0, 0.0, -2.4396),
            extension=(-0.67, 0.67),
            velocity=1.0,
            acceleration=10.0,
        ),
        turntable=Turntable(travel=None, velocity=math.radians(60.0), acceleration=math.radians(120.0)),
    )


def dim_hexapod() -> Platform:
    """The hexapod of VI-grade's DiM simulators, as published with MATMPC; leg speeds are (m)."""
    upper, lower = paired_hexapod((0.700, 0.25), (1.150, 0.25))
    return Platform(
        name="dim-hexapod",
        description="VI-grade DiM hexapod alone, legs 1.045 to 1.375 m (MATMPC's example)",
        hexapod=Hexapod(
            upper_joints=upper,
            lower_joints=lower,
            neutral=neutral_height(upper, lower, 1.210),
            extension=(1.045 - 1.210, 1.375 - 1.210),
            velocity=1.0,
            acceleration=10.0,
        ),
    )


def table_24_inch() -> Platform:
    """The 24-inch hexapod with a yaw table of jozbee/mpc_comparison; accelerations are (m).

    Neutral is at the published height difference of the joints, 1.410 - 0.216 m, lower than mid-stroke.
    """
    upper, lower = paired_hexapod((0.4545, 0.218), (0.9568, 0.181))
    neutral = (0.0, 0.0, -(1.410 - 0.216))
    length = float(np.linalg.norm(np.array(upper[0]) - np.array(lower[0]) + np.array(neutral)))
    return Platform(
        name="24-inch",
        description="24-inch hexapod with a +-85 degree turntable (jozbee/mpc_comparison)",
        hexapod=Hexapod(
            upper_joints=upper,
            lower_joints=lower,
            neutral=neutral,
            extension=(1.1604 - length, 1.7700 - length),
            velocity=0.508,
            acceleration=5.0,
        ),
        turntable=Turntable(
            travel=(-math.radians(85.0), math.radians(85.0)), velocity=0.5, acceleration=math.radians(120.0)
        ),
    )


def nads_1() -> Platform:
    """NADS-1 (Iowa): carriage +-9.75 m, yaw +-330 degrees (m).

    Its hexapod's joints are not published. The paper's joints with a stroke of +-0.545 m come near its
    heave of +-0.61 m and tilt of +-25 degrees: 0.60 m up, 0.64 m down, roll 24.5, pitch 22.3 to 22.9 degrees.
    """
    base = paper().hexapod
    return Platform(
        name="nads-1",
        description="NADS-1: +-9.75 m carriage, heave +-0.6 m, tilt about +-23 degrees, yaw +-330 degrees",
        carriage=Carriage(travel_x=(-9.75, 9.75), travel_y=(-9.75, 9.75), velocity=6.1, acceleration=6.1),
        hexapod=Hexapod(
            upper_joints=base.upper_joints,
            lower_joints=base.lower_joints,
            neutral=base.neutral,
            extension=(-0.545, 0.545),
            velocity=1.5,
            acceleration=10.0,
        ),
        turntable=Turntable(
            travel=(-math.radians(330.0), math.radians(330.0)),
            velocity=math.radians(60.0),
            acceleration=math.radians(120.0),
        ),
    )


_PLATFORMS: Final[Registry[Any]] = Registry("platform", "motion_cueing.platforms")

for _preset in (paper, dim_hexapod, table_24_inch, nads_1):
    _platform = _preset()
    _PLATFORMS.register(_platform.name, _platform, _platform.description)


register = _PLATFORMS.register
"""Give a platform, or what makes it, a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""

platform_names = _PLATFORMS.names
"""Names of whole machines that :func:`get_platform` knows."""


def ablation_names() -> list[str]:
    """Names of machines with a subsystem locked that :func:`get_platform` knows, too."""
    return list(_ablated())


def _ablated() -> dict[str, Platform]:
    return {platform.name: platform for name in _PLATFORMS for platform in ablations(get_platform(name))}


def describe_platform(name: str) -> str:
    """One line about a platform or an ablation."""
    described = _PLATFORMS.description(name) if name in _PLATFORMS else ""
    return described or get_platform(name).description


def get_platform(name: str) -> Platform:
    """A machine by name; -no-turntable, -no-carriage or -hexapod-only at its end locks subsystems.

    Raises:
        UnknownNameError: no platform has this name.
    """
    if name in _PLATFORMS:
        platform: Platform = _PLATFORMS.make(name)
        return platform if platform.name == name else replaced(platform, name=name)
    ablated = _ablated()
    if name not in ablated:
        raise UnknownNameError("platform", name, [*platform_names(), *ablated])
    return ablated[name]


def load_platform(path: str | Path) -> Platform:
    """A machine from a YAML file with the fields of :class:`Platform`.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: a field is wrong, or (GeometryError) the hexapod holds no platform at neutral.
    """
    platform = load(Platform, path)
    try:
        check_geometry(platform.hexapod)
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None
    return platform
