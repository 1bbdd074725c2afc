"""Provenance: what is written beside a result."""

from __future__ import annotations

import os
from datetime import datetime, timezone

from motion_cueing.envs import provenance


def test_plain_keeps_json_and_drops_what_is_not_finite():
    assert provenance.plain({"a": (1, 2.5, float("inf")), "b": None, "c": "[1, 2]", "d": "{no json"}) == {
        "a": [1, 2.5, None],
        "b": None,
        "c": [1, 2],
        "d": "{no json",
    }


def test_versions_name_the_package_python_and_libraries():
    versions = provenance.versions()
    assert versions["motion-cueing-gym"] == provenance.package_version()
    assert {"python", "system", "numpy", "torch"} <= set(versions)


def test_now_is_a_time_in_utc():
    now = datetime.fromisoformat(provenance.now())
    assert abs((datetime.now(timezone.utc) - now).total_seconds()) < 60.0


def test_hardware_names_the_cores():
    assert provenance.hardware("cpu").endswith(f", {os.cpu_count()} cores")
