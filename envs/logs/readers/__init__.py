"""Readers of log files, one a format; each gives a recording of named columns with units and clocks."""

from .registry import FORMATS, read_recording

__all__ = ["FORMATS", "read_recording"]
