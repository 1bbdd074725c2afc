"""Drives that are done, in files: one a policy. So a run that was stopped goes on, and can be made longer."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ...envs.errors import DataError
from ...envs.platform import Platform
from ...envs.settings import from_dict, to_dict
from ...envs.storage import write_text
from ..file_names import plain_name
from ..provenance import package_version
from .options import Endurance
from .results import EnduredDrive, Extremes, PolicyEndurance

FOLDER: Final = "drives"
"""Within the folder of the results."""


class EnduranceStore:
    """Keeps the drives of one policy.

    Args:
        folder: Of the results.
        policy: Label of the policy.
        key: Of :func:`endurance_key`; drives of another key are not taken.
        fresh: Remove what is kept.

    Raises:
        DataError: a file is damaged.
    """

    def __init__(self, folder: Path, policy: str, key: str, fresh: bool = False) -> None:
        tag = hashlib.sha256(policy.encode()).hexdigest()[:6]
        self._path = folder / FOLDER / f"{plain_name(policy)}-{tag}.json"
        if fresh:
            self._path.unlink(missing_ok=True)
        self.kept = self._load(key)

    def _load(self, key: str) -> PolicyEndurance:
        try:
            kept = from_dict(
                PolicyEndurance, json.loads(self._path.read_text(encoding="utf-8")), str(self._path)
            )
        except FileNotFoundError:
            return PolicyEndurance(key)
        except OSError as error:
            raise DataError(f"{self._path}: cannot be read ({error.strerror})") from None
        except ValueError:
            raise DataError(
                f"{self._path}: damaged, not the drives of an endurance; delete it, or add --fresh"
            ) from None
        return kept if kept.key == key else PolicyEndurance(key)

    def missing(self, seeds: Sequence[int]) -> list[int]:
        """Those of the seeds whose drives are not done."""
        done = {drive.seed for drive in self.kept.drives}
        return [seed for seed in seeds if seed not in done]

    def keep(self, drives: Collection[EnduredDrive], found: Mapping[str, dict[str, float]]) -> None:
        """Write drives down at once, whole or not at all.

        Args:
            drives: That are done.
            found: Extremes of them by condition.
        """
        before = self.kept
        extremes = {
            condition: before.extremes.get(condition, Extremes()).with_found(values)
            for condition, values in found.items()
        }
        self.kept = PolicyEndurance(before.key, (*before.drives, *drives), extremes)
        write_text(self._path, json.dumps(to_dict(self.kept), allow_nan=False) + "\n")


def endurance_key(platform: Platform, endurance: Endurance, policy: Mapping[str, Any]) -> str:
    """A hash of all that makes a policy's drives what they are, but their seeds.

    Args:
        platform: The machine.
        endurance: What policies are put through.
        policy: Of ``study_store.identity``.
    """
    whole = {
        "version": package_version(),
        "platform": to_dict(platform),
        "endurance": to_dict(endurance),
        "policy": dict(policy),
    }
    return hashlib.sha256(json.dumps(whole, sort_keys=True, default=str).encode()).hexdigest()
