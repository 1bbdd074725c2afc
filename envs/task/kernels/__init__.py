"""Warp kernels of the environment: actions, rewards, observations, episodes."""
