"""Policies under several conditions: other machines, lag, noise and other disturbances."""
