"""The machine's equations in CasADi's symbols, for controllers that optimise."""

from .machine import SymbolicMachine

__all__ = ["SymbolicMachine"]
