"""Warp kernels of the car and its driver."""
