"""Random drives beside recorded ones: sizes, spectra and histograms of force, jerk and rates, for each axis.

    python -m benchmarks.distributions
    python -m benchmarks.distributions --logs mine.csv other.csv.gz --figure drives.png

Columns are the distribution of random drives and each recorded drive of the package, and logs of cues given.
The figure needs the extra of the plots.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.signal import welch

from motion_cueing.envs.cues import GRAVITY, CueTrace
from motion_cueing.envs.maneuvers import get_recording, load_drives, random_drives, recording_names

Floats = NDArray[np.float64]

DT = 0.01
AXES = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
BANDS = ((0.1, 0.5), (0.5, 1.0), (1.0, 3.0), (3.0, 10.0))
"""Of the spectra, Hz."""

SEGMENT = 1024
"""Samples of a segment of Welch's method."""


def signals(trace: CueTrace) -> Floats:
    """(n, 6) specific force without gravity at rest, m/s^2, and angular velocity, deg/s, at 100 Hz."""
    trace = trace.resampled(DT)
    force = trace.specific_force + np.array([0.0, 0.0, GRAVITY])
    return np.hstack((force, np.degrees(trace.angular_velocity)))


def sizes(traces: Sequence[CueTrace]) -> dict[str, Floats]:
    """Six numbers a row: rms, percentiles, those of the derivative, and rms within bands of frequency."""
    pieces = [signals(trace) for trace in traces]
    level = np.concatenate(pieces)
    change = np.concatenate([np.gradient(piece, DT, axis=0) for piece in pieces])
    rows = {"rms": np.sqrt(np.mean(level**2, axis=0))}
    for share in (95.0, 99.0, 99.9):
        rows[f"{share:g} %"] = np.percentile(np.abs(level), share, axis=0)
    rows["derivative, rms"] = np.sqrt(np.mean(change**2, axis=0))
    rows["derivative, 99 %"] = np.percentile(np.abs(change), 99.0, axis=0)
    frequency, density = spectrum(pieces)
    for low, high in BANDS:
        inside = (frequency >= low) & (frequency < high)
        rows[f"rms {low:g} to {high:g} Hz"] = np.sqrt(density[inside].sum(axis=0) * frequency[1])
    return rows


def spectrum(pieces: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Frequencies, Hz, and mean one-sided densities (k, 6)."""
    found = [welch(piece, fs=1.0 / DT, nperseg=SEGMENT, axis=0) for piece in pieces if len(piece) >= SEGMENT]
    weights = [len(piece) for piece in pieces if len(piece) >= SEGMENT]
    return found[0][0], np.average([density for _, density in found], axis=0, weights=weights)


def tables(named: Mapping[str, Sequence[CueTrace]]) -> Table:
    """A row for each axis and size, a column for each set of drives."""
    found = {name: sizes(traces) for name, traces in named.items()}
    table = Table("axis", "size", *named)
    for k, axis in enumerate(AXES):
        for size in next(iter(found.values())):
            table.add_row(axis, size, *[f"{rows[size][k]:.3g}" for rows in found.values()])
    return table


def figure(named: Mapping[str, Sequence[CueTrace]], path: Path) -> None:
    """Spectra above, histograms of the derivatives below, one column an axis."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    drawing, panels = pyplot.subplots(2, 6, figsize=(17.0, 6.0), constrained_layout=True)
    for name, traces in named.items():
        pieces = [signals(trace) for trace in traces]
        frequency, density = spectrum(pieces)
        change = np.concatenate([np.gradient(piece, DT, axis=0) for piece in pieces])
        for k, axis in enumerate(AXES):
            panels[0, k].loglog(frequency[1:], np.sqrt(density[1:, k]), label=name, lw=1.2)
            panels[0, k].set(title=axis, xlabel="Hz", xlim=(0.1, 30.0))
            bound = 20.0 if k < 3 else 150.0
            counts, edges = np.histogram(change[:, k], bins=80, range=(-bound, bound), density=True)
            panels[1, k].semilogy(0.5 * (edges[1:] + edges[:-1]), np.maximum(counts, 1e-7), lw=1.2)
            panels[1, k].set(xlabel="m/s³" if k < 3 else "deg/s²", ylim=(1e-6, None))
    panels[0, 0].set_ylabel("density, (unit)/√Hz")
    panels[1, 0].set_ylabel("share of the derivative")
    panels[0, 0].legend(fontsize=8)
    drawing.savefig(path, dpi=80)


def main() -> None:
    """Print the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=128, help="random drives of a minute")
    parser.add_argument("--random", nargs="+", default=["broad"], help="distributions by name or file")
    parser.add_argument("--logs", nargs="*", default=[], help="CSV files of cues")
    parser.add_argument("--figure", type=Path, help="PNG file")
    given = parser.parse_args()
    named: dict[str, Sequence[CueTrace]] = {"ordinary": random_drives(given.drives, 60.0, 1)}
    for name in given.random:
        named[name] = random_drives(given.drives, 60.0, 1, drives=load_drives(name))
    named |= {name: [get_recording(name)] for name in recording_names()}
    named |= {Path(log).name.split(".")[0]: [CueTrace.from_csv(log)] for log in given.logs}
    Console(width=140).print(tables(named))
    if given.figure:
        figure(named, given.figure)


if __name__ == "__main__":
    main()
