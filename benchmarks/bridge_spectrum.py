"""The spectrum of a game's cues behind the bridge: is a beat of 60 Hz against the policy's 100 Hz left?

`python -m benchmarks.bridge_spectrum` sends a tone of 3 Hz and 1 m/s^2 as a game at 60 frames a second with
stamps in milliseconds. Its datagrams are up to 4 ms late. Cues are taken 100 times a second, as policies do.
It prints the largest line that is not the tone's, for frames that are held and for each smoothing;
`--out FILE.png` draws the spectra.
"""

from __future__ import annotations

import argparse
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motion_cueing.envs.telemetry import get_source
from motion_cueing.realtime.bridge import Bridge, BridgeOptions

Floats = NDArray[np.float64]
FPS, RATE, TONE, SECONDS, JITTER = 60.0, 100.0, 3.0, 40.0, 0.004


def frames(seed: int = 0) -> list[tuple[float, bytes]]:
    """Arrival and datagram of each frame of a Forza whose car sways at the tone."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(int(SECONDS * FPS)):
        t = k / FPS
        force = np.sin(2.0 * np.pi * TONE * t)
        sled = struct.pack("<iI3f3f3f", 1, int(1000.0 * t), 0, 0, 0, force, 0, 0, 0.1 * t, 0, 20)
        found.append((t + rng.uniform(0.0, JITTER), sled + bytes(232 - len(sled))))
    return found


def held() -> Floats:
    """f_y at each step of the policy if the newest frame counts, as without a bridge."""
    arrivals = frames()
    times = np.array([arrival for arrival, _ in arrivals])
    steps = np.arange(2.0, SECONDS - 1.0, 1.0 / RATE)
    newest = np.searchsorted(times, steps, side="right") - 1
    return np.sin(2.0 * np.pi * TONE * newest / FPS)


def bridged(smoothing: int) -> Floats:
    """f_y at each step of the policy behind the bridge."""
    bridge, waiting, rows = Bridge(get_source("forza"), BridgeOptions(smoothing=smoothing)), frames(), []
    for step in np.arange(0.0, SECONDS - 1.0, 1.0 / RATE):
        while waiting[0][0] <= step:
            arrival, data = waiting.pop(0)
            bridge.take(data, arrival)
        rows.append(bridge.cues(float(step)).force[1])
    return np.array(rows)[int(2.0 * RATE) :]


def spectrum(values: Floats) -> tuple[Floats, Floats]:
    """Frequencies, Hz, and amplitudes of tones."""
    window = np.blackman(len(values))
    height = 2.0 * np.abs(np.fft.rfft(window * (values - values.mean()))) / window.sum()
    return np.fft.rfftfreq(len(values), 1.0 / RATE), height


def strongest(values: Floats) -> tuple[float, float]:
    """Frequency and amplitude of the largest line besides the tone's."""
    frequency, height = spectrum(values)
    height = np.where(np.abs(frequency - TONE) < 0.5, 0.0, height)
    return float(frequency[np.argmax(height)]), float(height.max())


def cases() -> dict[str, Floats]:
    """Each way of taking the frames."""
    names = {1: "smoothing 1 (linear)", 2: "smoothing 2 (default)", 3: "smoothing 3"}
    return {"held frames": held(), **{name: bridged(n) for n, name in names.items()}}


def draw(found: dict[str, Floats], out: Path) -> None:
    """The spectra, one above the other."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(found), 1, figsize=(8.0, 6.0), sharex=True, layout="constrained")
    for ax, (name, values) in zip(axes, found.items(), strict=True):
        frequency, height = spectrum(values)
        ax.semilogy(frequency, np.maximum(height, 1e-6), linewidth=0.8)
        ax.set(ylim=(1e-5, 2.0), ylabel="m/s²")
        ax.set_title(name, loc="left", fontsize=9)
        ax.grid(alpha=0.3)
    axes[-1].set_xlabel("frequency, Hz")
    figure.savefig(out, dpi=110)


def main() -> None:
    """Print the table, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=None, help="picture to write")
    given = parser.parse_args()
    found = cases()
    print("| frames | tone of 1 m/s² | strongest other line | at |")
    print("|---|---|---|---|")
    for name, values in found.items():
        frequency, height = spectrum(values)
        tone = height[np.argmin(np.abs(frequency - TONE))]
        at, other = strongest(values)
        print(f"| {name} | {tone:.3f} m/s² | {1e3 * other:.2f} mm/s² | {at:.1f} Hz |")
    if given.out is not None:
        draw(found, given.out)


if __name__ == "__main__":
    main()
