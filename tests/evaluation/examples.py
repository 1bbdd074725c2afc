"""Results of made-up policies on two synthetic maneuvers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.results import Failure, Provenance, Results

from .synthetic import drive

ORIGIN = Provenance("motion-cueing evaluate", "2026-01-01T00:00:00+00:00", {}, "paper", "sedan", {})

GAINS = {
    "no-motion": 0.0,
    "mpc": 0.85,
    "optimal-washout-tuned": 0.6,
    "optimum-perceived": 0.93,
    "optimum": 0.95,
}
"""Gain of a made-up simulator for each policy."""


def results_of(
    gains: Mapping[str, float], criteria: Criteria | None = None, failures: Sequence[Failure] = ()
) -> Results:
    maneuvers = {
        name: {policy: measure(drive(gain, lag)) for policy, gain in gains.items()}
        for name, lag in (("weave", 0.0), ("late", 0.1))
    }
    return Results.of(maneuvers, list(failures), ORIGIN, criteria)
