"""Names and descriptions of the shipped agents, read from their files without importing Warp."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

FOLDER: Final = Path(__file__).parent
SUFFIX: Final = ".safetensors"
METADATA: Final = "motion-cueing-agent"
"""Key of an agent's description in the metadata of its file."""
LENGTH: Final = 8
"""Bytes of the header's length, before the header, which begins with a brace."""
_LONGEST_HEADER: Final = 100_000_000
"""Bytes of a header that safetensors reads."""


def agent_names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def is_agent(name: str) -> bool:
    """Whether a name or file means an agent."""
    return name in agent_names() or Path(name).suffix == SUFFIX


def description_of(algorithm: str, any_machine: bool, platform: str, mode: str) -> str:
    """One line about an agent.

    Args:
        algorithm: That trained it.
        any_machine: Whether its observation describes the machine.
        platform: Name of the machine it was trained on.
        mode: Of its actions.
    """
    machine = "any motion base, which it observes" if any_machine else f"the motion base {platform}"
    return f"agent by {algorithm} for {machine}, action {mode}"


def description_in(path: Path) -> str:
    """The description of an agent in a file, from its header alone."""
    with open(path, "rb") as file:
        length = int.from_bytes(file.read(LENGTH), "little")
        header = json.loads(file.read(min(length, _LONGEST_HEADER)))
    about: dict[str, Any] = json.loads(header["__metadata__"][METADATA])["contents"]
    task = about["task"]
    return description_of(
        about["record"]["algo"],
        bool(task["observation"].get("machine")),
        about["platform"]["name"],
        task["action"]["mode"],
    )
