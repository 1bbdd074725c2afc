"""Rows of numbers as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, Final

from pydantic import JsonValue

from ..envs.settings import configuration, to_dict
from ..envs.storage import write_text
from .comparison import Share, Standing, Verdict, judge, judge_suite, shares
from .metrics import Criteria, Metrics
from .saved import Saved


def save_rows(
    rows: Sequence[Mapping[str, Any]], path: str | Path, header: Sequence[str] | None = None
) -> None:
    """Write rows under a header, whole or not at all; what is None becomes an empty cell.

    Args:
        rows: Cells by column.
        path: The file.
        header: Columns; those of the first row if not given.
    """
    columns = list(header or (rows[0] if rows else ()))
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, buffer.getvalue())


# The result of an evaluation as ``results.json`` and ``results.csv``; see docs/results-format.md.


SCHEMA: Final = 1
"""Version of ``results.json``; a reader refuses others."""


@configuration
class Failure:
    """A drive that gave no result.

    Args:
        maneuver: Name of the maneuver.
        policy: Name of the policy; None where the maneuver itself could not be made.
        message: What went wrong.
    """

    maneuver: str
    policy: str | None
    message: str


@configuration
class Provenance:
    """What made the results.

    Args:
        command: The command line.
        created: UTC, ISO 8601.
        versions: Of this package, Python and the libraries that matter.
        platform: Name of the motion base.
        car: Name of the car.
        configuration: Everything in force: ``platform``, ``car``, and the metadata of each of ``policies``.
    """

    command: str
    created: str
    versions: dict[str, str]
    platform: str
    car: str
    configuration: dict[str, JsonValue]


@configuration
class Results(Saved):
    """Everything an evaluation found: ``results.json``.

    Args:
        schema: :data:`SCHEMA`.
        provenance: What made the results.
        maneuvers: Metrics by maneuver and policy.
        verdicts: One a maneuver, then that of the suite ("all").
        standings: Policies over the suite, best first.
        failures: Drives without a result.
        criteria: The thresholds the metrics were measured with.
        shares: Share of the gap by maneuver and policy.
        left_out: Policies that were asked for but cannot be driven here, and why.
        notes: What policies counted in a drive, by maneuver and policy, where they did.
    """

    what = "results"
    version = SCHEMA

    schema: int
    provenance: Provenance
    maneuvers: dict[str, dict[str, Metrics]]
    verdicts: tuple[Verdict, ...]
    standings: tuple[Standing, ...]
    failures: tuple[Failure, ...]
    criteria: Criteria
    shares: dict[str, dict[str, Share]] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    notes: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        maneuvers: dict[str, dict[str, Metrics]],
        failures: list[Failure],
        provenance: Provenance,
        criteria: Criteria | None = None,
        left_out: Mapping[str, str] | None = None,
        notes: Mapping[str, dict[str, dict[str, str]]] | None = None,
    ) -> Results:
        """Judge the metrics and put everything together."""
        criteria = criteria or Criteria()
        finished = {name: drives for name, drives in maneuvers.items() if drives}
        verdicts = [judge(name, drives) for name, drives in finished.items()]
        overall, standings = judge_suite(finished, criteria.references)
        if overall is not None:
            verdicts.append(overall)
        return cls(
            schema=SCHEMA,
            provenance=provenance,
            maneuvers=finished,
            verdicts=tuple(verdicts),
            standings=tuple(standings),
            failures=tuple(failures),
            criteria=criteria,
            shares={name: shares_of(drives, criteria) for name, drives in finished.items()},
            left_out=dict(left_out or {}),
            notes=dict(notes or {}),
        )

    @property
    def overall(self) -> Verdict | None:
        """The verdict of the suite."""
        return next((verdict for verdict in self.verdicts if verdict.maneuver == "all"), None)

    @property
    def policies(self) -> list[str]:
        """Names of the policies, best first where they have a standing."""
        ranked = [standing.policy for standing in self.standings]
        found = {policy for drives in self.maneuvers.values() for policy in drives}
        return ranked + sorted(found - set(ranked))

    def save_csv(self, path: str | Path) -> None:
        """Write ``results.csv``: one row a drive, one column a metric, nothing where undefined."""
        rows = [
            {"maneuver": maneuver, "policy": policy}
            | dict(_flat(to_dict(metrics)))
            | self._share_columns(maneuver, policy)
            for maneuver, drives in self.maneuvers.items()
            for policy, metrics in drives.items()
        ]
        save_rows(rows, path, None if rows else ("maneuver", "policy"))

    def _share_columns(self, maneuver: str, policy: str) -> dict[str, float | None]:
        share = self.shares.get(maneuver, {}).get(policy, Share())
        return {"share": share.cue_error, "perceived_share": share.perceived_cue_error}


def shares_of(drives: Mapping[str, Metrics], criteria: Criteria) -> dict[str, Share]:
    """Share of the gap of each policy on one maneuver."""
    errors = {name: metrics.cue_error for name, metrics in drives.items()}
    perceived = {name: metrics.perceived_cue_error for name, metrics in drives.items()}
    return shares(errors, perceived, criteria.references)


def _flat(values: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested values as ``axes.f_x.rmse``."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value
