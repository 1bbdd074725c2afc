"""Population based training: who goes on from whom, and with which values.

Jaderberg et al., "Population Based Training of Neural Networks", 2017, arXiv:1711.09846: truncation selection
(section 4.1.1: the worst take over weights and values of the best) and exploration by perturbing or drawing
anew. Everything drawn comes from the generator that is given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .config import Choice, PopulationOptions

Values = dict[str, Any]
"""What is varied, by path."""


@dataclass(frozen=True)
class Descent:
    """How a member of the next generation begins.

    Args:
        parent: The member of this generation whose checkpoint it goes on from.
        values: What it trains with.
    """

    parent: int
    values: Values


def draw(space: Mapping[str, Choice], random: np.random.Generator) -> Values:
    """Values of a member at the beginning."""
    return {name: _drawn(choice, random) for name, choice in space.items()}


def next_generation(
    ratings: Sequence[float],
    values: Sequence[Values],
    space: Mapping[str, Choice],
    options: PopulationOptions,
    random: np.random.Generator,
) -> list[Descent]:
    """Who goes on from whom.

    Args:
        ratings: Of each member, lower is better; what is not finite is worst.
        values: Of each member.
        space: What they may be.
        options: Shares and factors.
        random: Of everything that is drawn.

    Returns:
        A descent for each member: itself with the same values, or, of the worst, one of the best with others.
    """
    finite = [rating if math.isfinite(rating) else math.inf for rating in ratings]
    ranked = sorted(range(len(finite)), key=finite.__getitem__)
    count = max(1, int(options.replaced * len(ranked)))
    best, worst = ranked[:count], set(ranked[-count:])
    descents = []
    for member, own in enumerate(values):
        if member not in worst:
            descents.append(Descent(member, dict(own)))
            continue
        parent = int(random.choice(best))
        descents.append(Descent(parent, explored(values[parent], space, options, random)))
    return descents


def explored(
    values: Values, space: Mapping[str, Choice], options: PopulationOptions, random: np.random.Generator
) -> Values:
    """Values near others, or, with the probability ``options.redrawn``, any; each on its own."""
    return {
        name: _drawn(choice, random)
        if random.random() < options.redrawn
        else _near(values[name], choice, options, random)
        for name, choice in space.items()
    }


def _drawn(choice: Choice, random: np.random.Generator) -> Any:
    if choice.choices:
        return choice.choices[int(random.integers(len(choice.choices)))]
    low, high = choice.low or 0.0, choice.high or 0.0
    if choice.integer and not choice.log:
        return int(random.integers(int(low), int(high) + 1))
    found = (
        math.exp(random.uniform(math.log(low), math.log(high))) if choice.log else random.uniform(low, high)
    )
    return _within(found, choice)


def _near(value: Any, choice: Choice, options: PopulationOptions, random: np.random.Generator) -> Any:
    if choice.choices:
        place = choice.choices.index(value) + int(random.choice((-1, 1)))
        return choice.choices[min(max(place, 0), len(choice.choices) - 1)]
    moved = value * float(random.choice(options.factors))
    if choice.integer and round(moved) == value:
        # Small whole numbers would stay where they are.
        moved = value + math.copysign(1.0, moved - value)
    return _within(moved, choice)


def _within(value: float, choice: Choice) -> float | int:
    held = min(max(value, choice.low or 0.0), choice.high or 0.0)
    return round(held) if choice.integer else held
