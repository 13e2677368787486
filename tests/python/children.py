"""Cases that run in a child process, so that one that ends the process is a failed test and no more."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from typing import Any


def outcomes(module: str) -> dict[str, list[Any]]:
    """Runs all ``CASES`` of a module, name to function. Of each ["value", value], [name of the exception, text] or
    ["died", return code]."""
    names = list(importlib.import_module(module).CASES)
    found: dict[str, list[Any]] = {}
    while len(found) < len(names):
        child = subprocess.run(
            [sys.executable, __file__, module, str(len(found))],
            cwd=os.path.dirname(__file__),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=300,
        )
        for line in child.stdout.splitlines():
            name, *outcome = json.loads(line)
            found[name] = outcome
        if len(found) < len(names):
            found[names[len(found)]] = ["died", child.returncode, child.stderr[-2000:]]
    return found


def _run(module: str, first: int) -> None:
    for name, case in list(importlib.import_module(module).CASES.items())[first:]:
        try:
            outcome = ["value", case()]
        except Exception as error:
            outcome = [type(error).__name__, str(error)]
        print(json.dumps([name, *outcome]), flush=True)


if __name__ == "__main__":
    _run(sys.argv[1], int(sys.argv[2]))
