"""Results of an evaluation: ``results.json`` and ``results.csv``; see docs/reference/file-formats.md."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import JsonValue
from typing_extensions import Self

from ..envs.provenance import now, plain, versions
from ..envs.settings import configuration, renamed, to_dict
from ..envs.storage import write_text
from .comparison import NormalizedScore, SuiteScore, Verdict, judge, judge_suite, normalized_scores
from .metrics import Criteria, Metrics
from .saved import Saved

if TYPE_CHECKING:
    import pandas as pd

SCHEMA: Final = 2
"""Version of ``results.json``; version 1 is read, too."""


def save_rows(
    rows: Sequence[Mapping[str, Any]], path: str | Path, header: Sequence[str] | None = None
) -> None:
    """Write rows as CSV, whole or not at all; None becomes an empty cell.

    Args:
        rows: Cells by column.
        path: The file.
        header: Columns; those of the first row if not given.
    """
    import pandas as pd

    # Objects keep their own text: a count beside an empty cell stays a whole number.
    columns = list(header or (rows[0] if rows else ()))
    save_frame(pd.DataFrame([*map(dict, rows)], columns=columns, dtype=object), path)


def save_frame(frame: pd.DataFrame, path: str | Path) -> None:
    """Write a table as CSV, whole or not at all; the floats are read back exactly."""
    write_text(path, frame.to_csv(index=False, lineterminator="\n"))


@configuration
class Failure:
    """A drive without a result.

    Args:
        maneuver: Name of the maneuver.
        policy: Name of the policy; None where the maneuver itself could not be made.
        message: The reason.
    """

    maneuver: str
    policy: str | None
    message: str


@configuration
class Provenance:
    """The origin of results.

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

    @classmethod
    def of(cls, words: Sequence[str], platform: Any, car: Any, policies: Mapping[str, Any]) -> Self:
        """The origin of results that are made now.

        Args:
            words: The command line, program first.
            platform: Configuration of the motion base; it has a name.
            car: Configuration of the car; it has a name.
            policies: Metadata of each policy.
        """
        return cls(
            command=shlex.join(words),
            created=now(),
            versions=versions(),
            platform=platform.name,
            car=car.name,
            configuration={
                "platform": plain(to_dict(platform)),
                "car": plain(to_dict(car)),
                "policies": plain(policies),
            },
        )


@configuration
class Results(Saved):
    """Everything that an evaluation measured: ``results.json``.

    Args:
        schema: :data:`SCHEMA`.
        provenance: The origin of the results.
        maneuvers: Metrics by maneuver and policy.
        verdicts: One a maneuver, then that of the suite ("all").
        scores: Policies over the suite, best first.
        failures: Drives without a result.
        criteria: The thresholds the metrics were measured with.
        normalized_scores: By maneuver and policy.
        skipped: Requested policies that cannot be driven here, and why.
        notes: Counts of the policies, such as solves without a solution, by maneuver and policy.
    """

    what = "results"
    version = SCHEMA
    oldest = 1

    schema: int
    provenance: Provenance
    maneuvers: dict[str, dict[str, Metrics]]
    verdicts: tuple[Verdict, ...]
    failures: tuple[Failure, ...]
    criteria: Criteria
    scores: tuple[SuiteScore, ...] = renamed("scores", "standings")
    normalized_scores: dict[str, dict[str, NormalizedScore]] = renamed(
        "normalized_scores", "shares", default_factory=dict
    )
    skipped: dict[str, str] = renamed("skipped", "left_out", default_factory=dict)
    notes: dict[str, dict[str, dict[str, str]]] = renamed("notes", default_factory=dict)

    @classmethod
    def of(
        cls,
        maneuvers: dict[str, dict[str, Metrics]],
        failures: Sequence[Failure],
        provenance: Provenance,
        criteria: Criteria | None = None,
        skipped: Mapping[str, str] | None = None,
        notes: Mapping[str, dict[str, dict[str, str]]] | None = None,
    ) -> Self:
        """Compare the policies and put everything together."""
        criteria = criteria or Criteria()
        finished = {name: drives for name, drives in maneuvers.items() if drives}
        verdicts = [judge(name, drives) for name, drives in finished.items()]
        overall, scores = judge_suite(finished, criteria.references)
        return cls(
            schema=SCHEMA,
            provenance=provenance,
            maneuvers=finished,
            verdicts=(*verdicts, *([overall] if overall else [])),
            scores=tuple(scores),
            failures=tuple(failures),
            criteria=criteria,
            normalized_scores={
                maneuver: normalized_scores(
                    {name: metrics.cue_error for name, metrics in drives.items()},
                    {name: metrics.perceived_cue_error for name, metrics in drives.items()},
                    criteria.references,
                )
                for maneuver, drives in finished.items()
            },
            skipped=dict(skipped or {}),
            notes=dict(notes or {}),
        )

    @property
    def overall(self) -> Verdict | None:
        """The verdict of the suite."""
        return next((verdict for verdict in self.verdicts if verdict.maneuver == "all"), None)

    @property
    def policies(self) -> list[str]:
        """Names of the policies, best first where they have a score."""
        ranked = [score.policy for score in self.scores]
        every = {policy for drives in self.maneuvers.values() for policy in drives}
        return ranked + sorted(every - set(ranked))

    def frame(self) -> pd.DataFrame:
        """One row a drive: ``maneuver``, ``policy``, every metric in SI units, and the normalized scores.

        Metrics of an axis and the like have dots in their names, such as ``axes.f_y.rmse``.
        """
        import pandas as pd

        rows = []
        for maneuver, drives in self.maneuvers.items():
            for policy, metrics in drives.items():
                score = self.normalized_scores.get(maneuver, {}).get(policy, NormalizedScore())
                rows.append(
                    {"maneuver": maneuver, "policy": policy, **to_dict(metrics)}
                    | {"normalized_score": score.cue_error}
                    | {"perceived_normalized_score": score.perceived_cue_error}
                )
        return pd.json_normalize(rows) if rows else pd.DataFrame(columns=["maneuver", "policy"])

    def save_csv(self, path: str | Path) -> None:
        """Write ``results.csv``: :meth:`frame`, with empty cells where a metric is undefined."""
        save_frame(self.frame(), path)
