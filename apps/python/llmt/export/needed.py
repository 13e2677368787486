"""Packages that an export needs."""

from importlib import import_module
from typing import Any


def needed(package: str, function: str) -> Any:
    """The package, imported when it is needed. Raises ImportError that says what to install."""
    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(f"{function}() needs the package {package}: pip install {package}") from error
