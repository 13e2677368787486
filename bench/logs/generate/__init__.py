"""Machines drawn by a seed, whose truth is known: see ../judge.py, which runs a program on them and scores its answers."""

from .draw import case, kind_of, run

__all__ = ["case", "kind_of", "run"]
