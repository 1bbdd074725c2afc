"""Training of motion cueing agents."""
