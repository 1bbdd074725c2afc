"""Warp kernels of the washouts: filter blocks, and the step from observation to accelerations."""
