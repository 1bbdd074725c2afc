"""Policies for targets without Python: as C99, and as FMUs.

:func:`make_source` translates a washout or an agent, by itself or as the whole step from the car's cues to
the machine's set-points. :func:`write_files` writes it as one header and one file of code;
:func:`~.fmu.write_fmu` packs it as an FMU. :func:`~.check.compare` holds it against Python.
"""

from __future__ import annotations

import re

from ...baselines.policy import Policy
from ...envs.platform.machines import Platform
from .controllers import steps_of
from .source import Signal, Source, write_files, write_source
from .translator import TranslationError, Translator

__all__ = ["Signal", "Source", "TranslationError", "make_source", "write_files"]


def make_source(
    policy: Policy,
    platform: Platform | None = None,
    *,
    name: str | None = None,
    single: bool = False,
    command: str = "motion_cueing.realtime.export",
) -> Source:
    """A policy in C.

    Args:
        policy: A washout or an agent, made for the machine.
        platform: The machine, for the whole step from cues to set-points; None for the policy by itself.
        name: Of the export, before every name in its header; default: the policy's.
        single: Whether numbers are single precision.
        command: Named in the first lines.

    Raises:
        ConfigurationError: the policy has no form in C.
    """
    translator = Translator(single)
    steps = steps_of(policy, platform, translator)
    return write_source(c_name(name or policy.name), translator, steps, command)


def c_name(name: str) -> str:
    """A name of C like a name."""
    plain = re.sub(r"\W", "_", name)
    return plain if re.match(r"[A-Za-z]", plain) else f"policy_{plain}"
