"""Many trainings: seeds, searches and populations, in processes or on Ray."""
