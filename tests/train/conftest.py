"""Tests of training are collected where the extra `train` is installed."""

from __future__ import annotations

import importlib.util

INSTALLED = all(importlib.util.find_spec(name) for name in ("torch", "stable_baselines3"))

collect_ignore_glob = [] if INSTALLED else ["test_*.py"]
