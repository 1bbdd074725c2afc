"""Runs every policy on every maneuver and says which is better, by how much, and why."""
