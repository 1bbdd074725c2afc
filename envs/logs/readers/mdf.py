"""ASAM MDF 3 and 4 (.mf4, .mdf, .dat): measurements of the car industry, channels on several rasters."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from ...errors import DataError, reason
from ..signals import ImportOptions
from .recording import Column, Reader, Recording, Table


def read_mdf(path: Path, options: ImportOptions) -> Recording:
    """The recording in an MDF file: a table for each channel group, timed by its master channel.

    Raises:
        DataError: the file cannot be read, or has no numbers with a clock.
        ImportError: asammdf is not installed.
    """
    import asammdf

    try:
        measurement = asammdf.MDF(str(path))
    # asammdf raises errors of many kinds on a damaged file.
    except Exception as error:
        raise DataError(f"{path}: cannot be read as MDF ({reason(error)})") from None
    tables = []
    with measurement:
        for index, group in enumerate(measurement.groups):
            names = [channel.name for channel in group.channels]
            master = measurement.masters_db.get(index)
            if master is None or group.channel_group.cycles_nr < 2:
                continue
            stamps = measurement.get_master(index)
            columns = [Column("time", np.asarray(stamps, dtype=np.float64), "s")]
            for place, name in enumerate(names):
                if place == master:
                    continue
                signal = measurement.get(name, group=index, index=place)
                if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iufb":
                    continue
                values = np.asarray(signal.samples, dtype=np.float64)
                if signal.invalidation_bits is not None:
                    values = np.where(np.asarray(signal.invalidation_bits, dtype=bool), np.nan, values)
                columns.append(Column(name, values, signal.unit or ""))
            title = getattr(group.channel_group, "acq_name", "") or f"group {index}"
            tables.append((title, tuple(columns)))
    if not tables:
        raise DataError(f"{path}: no channel group with numbers and a time")
    titles = [title for title, _ in tables]
    unique = [
        title if titles.count(title) == 1 else f"{title} ({place})" for place, title in enumerate(titles)
    ]
    found = tuple(Table(title, columns, "time") for title, (_, columns) in zip(unique, tables, strict=True))
    return Recording(f"ASAM MDF {measurement.version}, {len(found)} channel groups", found)


MDF: Final = Reader("ASAM MDF", lambda path, head: head[:8] in (b"MDF     ", b"UnFinMF "), read_mdf, "logs")
