"""``motion-cueing identify``: lag and dead time of a motion base, from a log of its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from .arguments import PlatformName, find_platform, option, several

if TYPE_CHECKING:
    from ..envs.platform.identification import Estimate, Identified
    from ..evaluation.reporting.text import TextTable

_LOOSE: Final = 0.01
"""Half interval of a dead time, s, from which on it is said to be unknown."""

_OFF: Final = 0.03
"""A gain that is further from 1 is named."""


@dataclass(frozen=True, kw_only=True)
class IdentifyCommand:
    """Find the lag and the dead time of each subsystem in a log of set-points and sensors.

    The log is a CSV file with time_s and pairs such as carriage_x_setpoint_m and carriage_x_sensor_m, of
    carriage_x, carriage_y, leg_1 to leg_6 or surge, sway, heave, roll, pitch, yaw, and turntable. Prints what
    was found with 95 % intervals, and writes it into a motion base's file.
    """

    file: Annotated[Path, option("LOG.csv")] = field(kw_only=False)
    """Log of at least 10 s in which the machine moves as in a drive."""
    columns: Annotated[tuple[str, ...], several("SIGNAL=COLUMN[:UNIT] ...")] = ()
    """Columns of other names, such as time=t:ms leg_1_setpoint=cmd1:mm leg_1_sensor=pos1:mm. Units are s, ms,
    us, ns; m, cm, mm, in; rad, mrad, deg."""
    subsystems: Annotated[tuple[Literal["carriage", "hexapod", "turntable"], ...], several("NAME ...")] = (
        "carriage",
        "hexapod",
        "turntable",
    )
    """Those to identify, where the log has them."""
    platform: PlatformName = "paper"
    out: Annotated[Path | None, option("FILE.yaml")] = None
    """Motion base to write: --platform with what was found, and the name of this file."""


def run(command: IdentifyCommand) -> int:
    """Identify, print and write."""
    from dataclasses import replace

    from ..envs.platform.identification import identify
    from ..envs.platform.motion_log import parse_motion_columns, read_motion_log
    from ..envs.settings import save
    from ..evaluation.reporting.text import print_table, table_console

    platform = find_platform(command.platform)
    if command.out is not None:
        if command.out.suffix not in (".yaml", ".yml"):
            raise ConfigurationError(f"--out {command.out}: a motion base's file ends in .yaml")
        check_file("--out", command.out)
    log = read_motion_log(command.file, parse_motion_columns(command.columns))
    found = identify(log, command.subsystems)
    missing = [one.subsystem for one in found if one.subsystem not in platform.dynamics]
    if missing and command.out is not None:
        raise ConfigurationError(
            f"--platform {platform.name} has no {missing[0]}, which the log has; name the machine it is of, "
            "or choose by --subsystems"
        )
    console = table_console()
    print_table(console, _table(found))
    for one in found:
        if one.dead_time.half > _LOOSE:
            print(
                f"{one.subsystem}: its lateness is known, but not how much of it is dead time; faster motion "
                "would tell"
            )
        for channel, gain in one.gains.items():
            if abs(gain - 1.0) > _OFF:
                print(f"{channel} moves {gain:.3f} times as far as its set-point")
    if command.out is not None:
        dynamics = {one.subsystem: one.dynamics for one in found}
        save(replace(platform.with_dynamics(dynamics), name=command.out.stem), command.out)
        print(f"{command.out}: {platform.name} with this lag and dead time")
    return 0


def _table(found: Sequence[Identified]) -> TextTable:
    from ..envs.platform.motion_log import ROTATIONS
    from ..evaluation.reporting.text import TextTable

    header = (
        "subsystem", "natural frequency rad/s", "damping", "dead time ms", "lateness ms", "residual",
        "residual %",
    )  # fmt: skip
    rows = []
    for one in found:
        worst = max(one.share, key=one.share.__getitem__)
        rows.append(
            (
                one.subsystem,
                "no lag" if one.natural_frequency is None else _cell(one.natural_frequency),
                "–" if one.natural_frequency is None else _cell(one.damping),
                _cell(one.dead_time, 1e3),
                _cell(one.lateness, 1e3),
                f"{1e3 * one.residual[worst]:.3g} {'mrad' if worst in ROTATIONS else 'mm'} {worst}",
                f"{100.0 * one.share[worst]:.2g}",
            )
        )
    return TextTable("Lag and dead time, with 95 % intervals", header, tuple(rows))


def _cell(estimate: Estimate, factor: float = 1.0) -> str:
    value, half = factor * estimate.value, factor * estimate.half
    return f"{value:.4g}" if half == 0.0 else f"{value:.4g} ± {half:.2g}"
