"""Searches for the parameters of a motion cueing algorithm: each algorithm at its best."""
