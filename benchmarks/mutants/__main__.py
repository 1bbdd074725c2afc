"""The mutation run: which mutants of the paper's cases no statement notices."""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from rich.console import Console
from rich.table import Table

from motion_cueing.evaluation.paper.cases import drive_cases
from motion_cueing.evaluation.paper.statements import CASES

from . import LARGEST, judge, mutants
from . import __doc__ as about

SHOWN = 0.05


def main() -> int:
    """Drive all mutants; 1 if one that changes a cue by more than a fifth survives, else 0."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--all", action="store_true", help="show every mutant, not the survivors alone")
    options = parser.parse_args()
    drives = drive_cases()
    verdicts = [judge(mutant, drives) for case in options.cases for mutant in mutants(case)]
    table = Table(
        "mutant",
        "change",
        "axis",
        "noticed by",
        title=f"Mutants that no statement notices, with a change above {SHOWN:.0%}",
        title_justify="left",
    )
    for v in verdicts:
        if options.all or (not v.noticed and v.change > SHOWN):
            style = None if v.wanted else "bold red"
            table.add_row(v.mutant.name, f"{v.change:.2f}", v.axis, "; ".join(v.noticed[:3]), style=style)
    console = Console(width=None if Console().is_terminal else 160)
    console.print(table)
    noticed = Counter(name for v in verdicts for name in v.noticed)
    alone = Counter(v.noticed[0] for v in verdicts if len(v.noticed) == 1)
    for name, count in noticed.most_common():
        console.print(f"{count:4d} mutants, {alone[name]:3d} of them alone: {name}", highlight=False)
    unwanted = [v for v in verdicts if not v.wanted]
    console.print(
        f"{len(verdicts)} mutants: {sum(bool(v.noticed) for v in verdicts)} noticed, "
        f"{len(unwanted)} of the others change a cue by more than {LARGEST:.0%}",
        highlight=False,
    )
    return 1 if unwanted else 0


if __name__ == "__main__":
    sys.exit(main())
