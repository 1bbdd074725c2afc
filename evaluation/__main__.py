"""``python -m motion_cueing.evaluation``: the command line; without a command it evaluates."""

import sys

from ..cli.__main__ import with_default
from ..cli.main import main

if __name__ == "__main__":
    sys.exit(main(with_default(sys.argv[1:])))
