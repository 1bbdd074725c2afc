"""Analytic policy gradient: truncated backpropagation through time through the simulator."""
