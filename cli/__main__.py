"""``python -m motion_cueing.cli``: the command line; without a command it evaluates."""

import sys

from .main import main

_OVERVIEW = ("-h", "--help", "--version")


def with_default(arguments: list[str]) -> list[str]:
    """Put ``evaluate`` before options that name no subcommand."""
    bare = not arguments or (arguments[0].startswith("-") and arguments[0] not in _OVERVIEW)
    return ["evaluate", *arguments] if bare else arguments


if __name__ == "__main__":
    sys.exit(main(with_default(sys.argv[1:])))
