"""Learning algorithms, a folder each."""
