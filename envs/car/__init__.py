"""The car: vehicle model, tires, driver, and the cars of the package."""

from .vehicles import Car, car_names, get_car

__all__ = ["Car", "car_names", "get_car"]
