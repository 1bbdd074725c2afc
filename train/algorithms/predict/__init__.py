"""Prediction: a network that forecasts a car's cues, supervised on random drives."""
