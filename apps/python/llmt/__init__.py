"""LLMT."""

from llmt._discover import Missing, Parameter, discover, find_missing

__all__ = ["Missing", "Parameter", "discover", "find_missing"]
