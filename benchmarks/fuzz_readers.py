"""Broken files for every reader: ``python -m benchmarks.fuzz_readers --minutes 10``.

What a reader raises beside the package's own errors, and what takes long, is printed with its seed.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from tests.fuzzing import READERS, attack

SLOW = 2.0
"""Processor time of one file that is too long, s."""


def main() -> None:
    """Break files by counted seeds until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="how long")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument("--reader", choices=list(READERS), help="this one alone")
    options = parser.parse_args()
    end = time.monotonic() + 60.0 * options.minutes
    names = [options.reader] if options.reader else list(READERS)
    counts: Counter[str] = Counter()
    slowest, seed = 0.0, options.seed
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < end:
            for name in names:
                begin = time.process_time()
                try:
                    counts["refused" if attack(name, seed, Path(folder)) else "read"] += 1
                except Exception as error:
                    counts["defects"] += 1
                    where = traceback.extract_tb(error.__traceback__)[-1]
                    print(f"{name}, seed {seed}: {type(error).__name__} in {where.name}: {str(error)[:200]}")
                taken = time.process_time() - begin
                slowest = max(slowest, taken)
                if taken > SLOW:
                    counts["slow"] += 1
                    print(f"{name}, seed {seed}: {taken:.1f} s")
            seed += 1
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"{dict(counts)}, seeds {options.seed} to {seed - 1}, slowest {slowest:.2f} s, {memory:.0f} MiB")
    if counts["defects"] or counts["slow"]:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
