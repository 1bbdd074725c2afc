"""Perception: semicircular canals and otoliths."""

from .models import Canals, Otoliths, VestibularModel, get_vestibular_model, register, vestibular_model_names

__all__ = [
    "Canals",
    "Otoliths",
    "VestibularModel",
    "get_vestibular_model",
    "register",
    "vestibular_model_names",
]
