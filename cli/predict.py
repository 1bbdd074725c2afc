"""``motion-cueing predict``: a predictor's errors by lead time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ..envs.errors import ConfigurationError
from ..envs.storage import check_folder, write_bytes
from .arguments import OutFolder, Whole, option


@dataclass(frozen=True, kw_only=True)
class PredictCommand:
    """Measure a predictor on random drives by held-out drivers, in cars that no training has.

    Prints the error of forecasts by lead time, beside holding the present cue and letting it decay, and how
    often the error is within the predictor's own spread.
    """

    predictor: Annotated[str, option("NAME|FILE.safetensors")] = "road"
    """That of the package, or the file of another one."""
    drives: Whole = 40
    """Random drives of the preset `held-out`."""
    duration: float = 60.0
    """Of each, s."""
    random: Annotated[str, option("NAME|FILE.yaml")] = "held-out"
    """Distribution of the random drives."""
    out: OutFolder = Path("prediction")


def run(command: PredictCommand) -> int:
    """Measure."""
    from ..envs.maneuvers import held_out_drives, load_drives
    from ..envs.task.predictor import find_predictor
    from ..evaluation.reporting.figures import png
    from ..evaluation.reporting.text import print_table, save_markdown, table_console
    from ..evaluation.studies.forecasts import forecast_figure, forecast_table, measure_forecasts

    if command.drives < 1:
        raise ConfigurationError(f"--drives must be at least 1, found {command.drives}")
    check_folder("--out", command.out)
    predictor = find_predictor(command.predictor)
    drives = held_out_drives(command.drives, command.duration, load_drives(command.random))
    found = measure_forecasts(predictor, drives)
    table = forecast_table(found)
    save_markdown(command.out / "prediction.md", table)
    write_bytes(command.out / "prediction.png", png(forecast_figure(found)))
    console = table_console()
    print_table(console, table)
    console.print(f"Everything is in {command.out}", highlight=False, markup=False)
    return 0
