"""Where trainings run: in this process, in processes of this machine, or on Ray."""

from .choose import ENGINES, make_engine
from .job import Ending, Engine, Job, Listener, Report, Source, run_jobs

__all__ = ["ENGINES", "Ending", "Engine", "Job", "Listener", "Report", "Source", "make_engine", "run_jobs"]
