"""LLMT."""
