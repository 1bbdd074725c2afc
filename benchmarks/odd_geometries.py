"""Legs and pose of a thousand odd machines under strong commands: ``python -m benchmarks.odd_geometries``."""

from __future__ import annotations

import argparse

import numpy as np

from tests.envs.platform.odd_geometries import AGREE, accepted_machines, drive


def main() -> None:
    """Draw machines, drive them, and print how far legs and pose ever part and how often a pose was held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=1000, help="accepted geometries")
    parser.add_argument("--steps", type=int, default=400, help="steps of 0.01 s")
    parser.add_argument("--seed", type=int, default=0, help="of machines and commands")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    worst, held = drive(accepted_machines(options.machines, rng), options.steps, rng)
    print(f"{options.machines} machines, {options.steps} steps: legs and pose differ by {worst.max():.1e} m")
    print(f"emergency stops: {held.sum()} in {np.count_nonzero(held)} machines")
    if worst.max() > AGREE:
        raise SystemExit(f"legs and pose part by more than {AGREE:g} m")


if __name__ == "__main__":
    main()
