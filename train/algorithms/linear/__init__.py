"""The best linear washout for random drives, by CMA-ES."""
