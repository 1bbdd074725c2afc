"""Files of results: written whole or not at all, and read from this and from earlier versions.

:class:`Results` is ``results.json`` of an evaluation; docs/reference/file-formats.md describes the fields.
Studies, endurance, frequency responses and the paper's cases have files of their own kind.
"""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeVar

from pydantic import JsonValue
from typing_extensions import Self

from ..envs.cues import UNSCALED, CueScale
from ..envs.errors import DataError, reason
from ..envs.limits import LARGEST_RESULTS, parse_json, read_bytes
from ..envs.provenance import now, package_version, plain, versions
from ..envs.settings import configuration, from_dict, renamed, to_dict
from ..envs.storage import write_text
from .comparison import NormalizedScore, SuiteScore, Verdict, judge, judge_suite, normalized_scores
from .metrics import Criteria, Metrics

if TYPE_CHECKING:
    import pandas as pd

SCHEMA: Final = 2
"""Version of ``results.json``; version 1 is read, too."""


class Saved:
    """A configuration with a file of its own. Its field ``schema`` is the version of the file.

    Attributes:
        what: Its name in messages.
        version: Version that is written.
        oldest: Oldest version that is read.
    """

    what: ClassVar[str]
    version: ClassVar[int]
    oldest: ClassVar[int | None] = None

    def save_json(self, path: str | Path) -> None:
        """Write the file, whole or not at all."""
        write_text(path, json.dumps(to_dict(self), indent=1, allow_nan=False) + "\n")

    @classmethod
    def load_json(cls, path: str | Path) -> Self:
        """Read a file of this version, or of an earlier one that can be brought up to it.

        Raises:
            DataError: the file is missing, broken, or of another version.
            ConfigurationError: a field is missing, unknown or wrong.
        """
        try:
            values = parse_json(read_bytes(path, LARGEST_RESULTS).decode("utf-8"))
        except (OSError, ValueError) as error:
            raise DataError(f"{path}: cannot be read as {cls.what} ({reason(error)})") from None
        schema = values.get("schema") if isinstance(values, dict) else None
        oldest = cls.version if cls.oldest is None else cls.oldest
        if not isinstance(schema, int) or not oldest <= schema <= cls.version:
            known = f"{cls.version}" if oldest == cls.version else f"{oldest} to {cls.version}"
            raise DataError(f"{path}: {cls.what} of version {schema}, this package reads {known}")
        return from_dict(cls, cls.upgrade(values) | {"schema": cls.version}, str(path))

    @classmethod
    def upgrade(cls, values: dict[str, Any]) -> dict[str, Any]:
        """The content of a file, with the structure of the current version."""
        return values


@configuration
class Headed(Saved):
    """Results that begin with their origin.

    Args:
        schema: Version of the file.
        command: The command line.
        created: UTC, ISO 8601.
        versions: Of this package, Python and the libraries that matter.
    """

    schema: int
    command: str
    created: str
    versions: dict[str, str]

    @classmethod
    def head(cls, words: Sequence[str]) -> dict[str, Any]:
        """The fields above, for results that a command line (program first) makes now."""
        return {
            "schema": cls.version,
            "command": shlex.join(words),
            "created": now(),
            "versions": versions(),
        }


T = TypeVar("T")


def load_drives_done(kind: type[T], path: Path, of: str) -> T:
    """Read a file of finished drives.

    Args:
        kind: The configuration in it.
        path: The file, which exists.
        of: What the drives belong to, for messages.
    """
    try:
        return from_dict(kind, parse_json(read_bytes(path, LARGEST_RESULTS)), str(path))
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError:
        # Which of its many numbers is wrong helps nobody.
        raise DataError(f"{path}: damaged, not the drives of {of}; delete it, or add --fresh") from None


def drive_key(**parts: Any) -> str:
    """A hash of everything that a drive depends on, as plain values.

    The version of the package is in it, changes to its code within a version are not.
    """
    whole = {"version": package_version(), **parts}
    return hashlib.sha256(json.dumps(whole, sort_keys=True, default=str).encode()).hexdigest()


def save_rows(rows: Sequence[Mapping[str, Any]], path: str | Path) -> None:
    """Write rows (cells by column) as CSV, whole or not at all; None becomes an empty cell."""
    import pandas as pd

    # Objects keep their own text: a count beside an empty cell stays a whole number.
    save_frame(pd.DataFrame([*map(dict, rows)], columns=list(rows[0]) if rows else [], dtype=object), path)


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
        scale: Motion scale of the reference; results of different scales are not compared.
    """

    command: str
    created: str
    versions: dict[str, str]
    platform: str
    car: str
    configuration: dict[str, JsonValue]
    scale: CueScale = UNSCALED

    @classmethod
    def of(
        cls,
        words: Sequence[str],
        platform: Any,
        car: Any,
        policies: Mapping[str, Any],
        scale: CueScale = UNSCALED,
    ) -> Self:
        """The origin of results that a command line makes now, with the metadata of each policy."""
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
            scale=scale,
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
        skipped: Requested policies that cannot be driven here, and why; by file, what is left out of a log.
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
