"""Runs every policy on every maneuver and says which is better, by how much, and why."""

import sys
from pathlib import Path

try:
    from .criteria import Criteria
    from .metrics import Metrics, measure
    from .rollout import rollout
    from .trajectory import LimitTable, Trajectory
    from .verdict import judge
except KeyboardInterrupt:
    # These libraries load before the command line can catch anything: Ctrl-C then ends it without a
    # traceback. In any other program it is not ours to catch.
    if sys.argv[0] == "-m" or Path(sys.argv[0]).stem == "motion-cueing":
        sys.exit(130)
    raise

__all__ = ["Criteria", "LimitTable", "Metrics", "Trajectory", "judge", "measure", "rollout"]
