"""Run the benchmarks and print their table: ``python -m benchmarks.report``."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
SINGLE_US = 25.0
SINGLE_RATIO = 25.0
BATCH_RATIO = 6.0
PENDULUM_RATIO = 0.5
STATE_BYTES = 4096.0
PPO_SHARE = 10.0
PPO_DEFAULT = "PPO, batch 64, 10 epochs"
"""Stable-Baselines3's own choice."""


@dataclass(frozen=True)
class Row:
    """One line of the table; times in microseconds a call."""

    case: str
    code: str
    median: float
    least: float
    environment_steps: int  # a call
    state_bytes: float | None
    share: float | None  # of the time that passes in the environment

    @classmethod
    def of(cls, entry: dict[str, Any]) -> Row:
        info, stats = entry["extra_info"], entry["stats"]
        return cls(
            case=entry["group"],
            code=info["code"],
            median=1e6 * stats["median"],
            least=1e6 * stats["min"],
            environment_steps=info["environments"] * info["steps"],
            state_bytes=info.get("state_bytes"),
            share=info.get("share"),
        )


def measure() -> list[Row]:
    """Run pytest-benchmark on this folder and read what it measured."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "benchmark.json"
        command = [sys.executable, "-m", "pytest", "benchmarks", "-q", "--benchmark-only"]
        done = subprocess.run(
            [*command, f"--benchmark-json={out}"], cwd=ROOT, capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            sys.exit(done.stdout + done.stderr)
        return [Row.of(entry) for entry in json.loads(out.read_text())["benchmarks"]]


def table(rows: list[Row]) -> list[str]:
    """Markdown: each case, with the reference's time over the kernel's where both were measured."""
    reference = {row.case: row for row in rows if row.code == "NumPy"}
    lines = [
        "| case | code | median us a call | least us a call | us an environment step | faster than NumPy |",
        "|---|---|---|---|---|---|",
    ]
    timed = [row for row in rows if row.share is None]
    for row in sorted(timed, key=lambda r: (order(r), r.code)):
        other = reference.get(row.case)
        ratio = f"{other.median / row.median:.0f} times" if other and row.code == "kernel" else ""
        each = row.median / row.environment_steps
        lines.append(
            f"| {row.case} | {row.code} | {row.median:.1f} | {row.least:.1f} | {each:.3f} | {ratio} |"
        )
    return lines


def shares(rows: list[Row]) -> list[str]:
    """Markdown: learning with 64 environments, and the share of its time that passes in them."""
    lines = ["| 64 environments | actions a second | in the environment |", "|---|---|---|"]
    for row in rows:
        if row.share is not None:
            rate = 1e6 * row.environment_steps / row.median
            lines.append(f"| {row.case} | {rate:,.0f} | {row.share:.1%} |")
    return lines


def order(row: Row) -> tuple[bool, int, str]:
    """Steps by size, then whole washouts."""
    return not row.case.startswith("step"), row.environment_steps, row.case


def targets(rows: list[Row]) -> list[str]:
    """Each goal of the project, and whether this run met it."""
    by = {(row.case, row.code): row for row in rows}

    def ratio(case: str) -> float:
        return by[case, "NumPy"].median / by[case, "kernel"].median

    single = by["step of 1", "kernel"]
    at_most = {"single step, us": (single.median, SINGLE_US)}
    if single.state_bytes is not None:
        at_most["state of an environment, bytes"] = (single.state_bytes, STATE_BYTES)
    (default,) = (row.share for row in rows if row.case == PPO_DEFAULT)
    at_most["PPO's time in 64 environments, %"] = (100.0 * (default or 0.0), PPO_SHARE)
    at_least = {
        "single step, times faster than NumPy": (ratio("step of 1"), SINGLE_RATIO),
        "batch of 1024, times faster than NumPy": (ratio("step of 1024"), BATCH_RATIO),
    }
    single_environment = {code: row for (case, code), row in by.items() if case == "environment, single"}
    pendulum = single_environment["Pendulum-v1"].median / single_environment["environment"].median
    at_least["single environment, times Pendulum-v1's rate"] = (pendulum, PENDULUM_RATIO)
    lines = ["| goal | bound | measured | met |", "|---|---|---|---|"]
    for name, (value, bound) in at_most.items():
        lines.append(f"| {name} | at most {bound:.0f} | {value:.1f} | {yes(value <= bound)} |")
    for name, (value, bound) in at_least.items():
        lines.append(f"| {name} | at least {bound:g} | {value:.1f} | {yes(value >= bound)} |")
    return lines


def yes(met: bool) -> str:
    """For people; a miss stands out."""
    return "yes" if met else "NO"


def machine() -> str:
    """What it was measured on."""
    model = platform.processor() or platform.machine()
    cpu = Path("/proc/cpuinfo")
    if cpu.exists():
        names = [line for line in cpu.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":")[1].strip() if names else model
    load = f", load average {os.getloadavg()[0]:.1f} at the start" if hasattr(os, "getloadavg") else ""
    return f"{model}, {os.cpu_count()} cores{load}, Python {platform.python_version()}"


def main() -> None:
    """Measure and print."""
    where = machine()
    rows = measure()
    print("\n".join([where, "", *table(rows), "", *shares(rows), "", *targets(rows)]))


if __name__ == "__main__":
    main()
