"""Tests of training are collected where the extra `train` is installed."""

from __future__ import annotations

import importlib.util

NEEDED = ("torch", "stable_baselines3", "sb3_contrib", "optuna", "tensorboard")
INSTALLED = all(importlib.util.find_spec(name) for name in NEEDED)

collect_ignore_glob = [] if INSTALLED else ["*test_*.py"]
