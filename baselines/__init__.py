"""Motion cueing algorithms that need no training."""
