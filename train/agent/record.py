"""How an agent was made."""

from __future__ import annotations

from dataclasses import field

from ...envs.settings import NonNegative, configuration


@configuration
class Record:
    """How an agent was made; everything that is needed to make it again.

    Args:
        algo: The algorithm.
        seed: Of the training.
        command: The command line.
        steps: Actions taken in training, over all environments.
        wall_time: Of the training, s.
        hardware: The machine it was trained on.
        versions: Of this package and the libraries, by name.
        created: When, ISO 8601.
        validation: J on the validation drives; None where it was not measured.
        initial: How the agent was made that the training began with; None where it began anew.
    """

    algo: str
    seed: int
    command: str = ""
    steps: int = 0
    wall_time: NonNegative = 0.0
    hardware: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    created: str = ""
    validation: NonNegative | None = None
    initial: Record | None = None
