"""Warp kernels of the simulator: step and simulator cues, observations, gradients."""
