"""The car: vehicle model, tires, driver, and the cars of the package."""

from .vehicles import Car, car_names, describe_car, get_car, register

__all__ = ["Car", "car_names", "describe_car", "get_car", "register"]
