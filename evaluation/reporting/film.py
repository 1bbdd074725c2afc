"""Films and pictures of a drive: every file is written whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import ConfigurationError, DataError
from ...envs.platform import Platform
from ...envs.rendering import CueHistory, MotionView, Renderer, theme
from ...envs.rendering.drawing import load
from ...envs.storage import write_bytes
from ..trajectory import Trajectory

Picture = NDArray[np.uint8]

SUFFIXES: Final = (".gif", ".mp4", ".png")
"""Kinds of file :func:`save_film` writes."""
_GIF_COLORS: Final = 256
_SWATCH_HEIGHT: Final = 3
_CODEC: Final = "libx264"
_QUALITY: Final = 7
"""Of the mp4, 0 to 10 (imageio-ffmpeg's scale)."""


def film_frames(
    trajectory: Trajectory, renderer: Renderer, rate: float, begin: float = 0.0, end: float | None = None
) -> Iterator[Picture]:
    """Frames of a drive at true speed.

    Args:
        trajectory: The drive.
        renderer: Of the machine that drove it.
        rate: Frames a second.
        begin: Time of the first frame, s; the charts show what went before.
        end: Time of the last frame, s; default: the end of the drive.
    """
    history = CueHistory(trajectory.maneuver, trajectory.policy, trajectory.dt)
    reference = np.hstack([trajectory.f_reference, trajectory.w_reference])
    simulated = np.hstack([trajectory.f_simulator, trajectory.w_simulator])
    row = -1
    for k in frame_rows(trajectory, rate, begin, end):
        while row < k:
            row += 1
            history.append(trajectory.time[row], reference[row], simulated[row])
        yield renderer.frame(view_of(trajectory, k), history)


def frame_rows(trajectory: Trajectory, rate: float, begin: float, end: float | None) -> list[int]:
    """Row of the trajectory for each frame: the last one that is not later than the frame.

    Raises:
        ConfigurationError: the rate is not positive, or the drive has nothing between ``begin`` and ``end``.
    """
    time = trajectory.time - trajectory.time[0]
    last = float(time[-1]) if end is None else min(end, float(time[-1]))
    if not rate > 0.0:
        raise ConfigurationError(f"rate must be positive, found {rate}")
    if not 0.0 <= begin <= last:
        raise ConfigurationError(
            f"begin is {begin:g} s and end {last:g} s; the drive goes from 0 to {time[-1]:g} s"
        )
    at = begin + np.arange(int((last - begin) * rate + 1e-9) + 1) / rate
    return [int(row) for row in np.searchsorted(time, at + 1e-9, side="right") - 1]


def view_of(trajectory: Trajectory, row: int) -> MotionView:
    """The machine in a row of a trajectory."""
    return MotionView(
        trajectory.carriage[row],
        trajectory.hexapod[row],
        float(trajectory.turntable[row]),
        trajectory.legs[row],
    )


def drawn(trajectory: Trajectory, platform: Platform, time: float, size: tuple[int, int]) -> Picture:
    """One frame of a drive, (height, width, 3), at a time in seconds."""
    *_, last = film_frames(trajectory, Renderer(platform, size), rate=1.0, begin=time, end=time)
    return last


def check_suffix(path: Path) -> str:
    """The kind of a film's file."""
    if path.suffix.lower() not in SUFFIXES:
        raise DataError(f"{path}: name a file that ends in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    return path.suffix.lower()


def save_film(path: str | Path, frames: Iterable[Picture], rate: float) -> None:
    """Write frames as a film; of a png only the first one is written.

    Raises:
        DataError: the suffix is unknown, or there is no frame.
        RenderingUnavailableError: an mp4 is asked for without the package that writes it.
    """
    path = Path(path)
    suffix = check_suffix(path)
    remaining = iter(frames)
    first = next(remaining, None)
    if first is None:
        raise DataError(f"{path}: a film needs at least one frame")
    if suffix == ".png":
        buffer = io.BytesIO()
        _image(first).save(buffer, format="PNG", optimize=True)
        write_bytes(path, buffer.getvalue())
    elif suffix == ".gif":
        write_bytes(path, _gif(first, remaining, rate))
    else:
        write_bytes(path, _mp4(first, remaining, rate))


def gif_rate(rate: float) -> float:
    """The nearest rate a GIF can have: its frames last whole hundredths of a second."""
    return 100.0 / max(2, round(100.0 / rate))


def _gif(first: Picture, rest: Iterable[Picture], rate: float) -> bytes:
    """An endless GIF of one palette, without dither, so that still parts stay still."""
    palette = _image(np.concatenate([first, _swatches(first.shape[1])])).quantize(_GIF_COLORS)

    def indexed(frame: Picture) -> Any:
        return _image(frame).quantize(palette=palette, dither=0)

    buffer = io.BytesIO()
    indexed(first).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=(indexed(frame) for frame in rest),
        duration=round(1000.0 / gif_rate(rate)),
        loop=0,
        optimize=True,
    )
    return buffer.getvalue()


def _swatches(width: int) -> Picture:
    """Colors that later frames will need and the first may lack, (height, width, 3)."""
    uses = [theme.color_of_use(use) for use in (0.0, 0.6, 0.7, 0.8, 0.9, 1.0)]
    bright = [
        theme.REFERENCE,
        theme.SIMULATOR,
        theme.TRAVEL,
        theme.SKIN,
        theme.SHIRT,
        theme.TAIL_LIGHT,
        *uses,
    ]
    shades = [theme.blend(theme.CARD, color, weight) for color in bright for weight in (0.2, 0.6, 1.0)]
    rows = np.repeat(np.array(shades, dtype=np.uint8), _SWATCH_HEIGHT, axis=0)
    return np.repeat(rows[:, None], width, axis=1)


def _mp4(first: Picture, rest: Iterable[Picture], rate: float) -> bytes:
    ffmpeg = load("imageio_ffmpeg", "imageio-ffmpeg")
    height, width = first.shape[:2]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "film.mp4"
        writer = ffmpeg.write_frames(
            str(file), (width, height), fps=rate, codec=_CODEC, quality=_QUALITY, macro_block_size=2
        )
        writer.send(None)
        writer.send(first.tobytes())
        for frame in rest:
            writer.send(frame.tobytes())
        writer.close()
        return file.read_bytes()


def _image(frame: Picture) -> Any:
    return load("PIL.Image", "pillow").fromarray(frame)
