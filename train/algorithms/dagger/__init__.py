"""Imitation of a controller by dataset aggregation (DAgger)."""
