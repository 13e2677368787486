"""Programs that run each in a process and a folder of its own, as by ``python program.py``, but for one thing: the process is
forked from one that has imported what most of them import and nothing of llmt, for that takes longer than most programs."""

from __future__ import annotations

import multiprocessing
import os
import runpy
import sys
from pathlib import Path

SECONDS = 300

_server = multiprocessing.get_context("forkserver")
_server.set_forkserver_preload(["pytest", "pandas", "sklearn.model_selection", "matplotlib.pyplot"])


def _main(program: str, folder: str, printed: str, complained: str) -> None:
    for path, stream in ((printed, 1), (complained, 2)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600), stream)
    os.chdir(folder)
    sys.argv = [program]
    sys.path[:] = [str(Path(program).parent), *(path for path in sys.path if path != str(Path(__file__).parent))]
    runpy.run_path(program, run_name="__main__")


def run(program: Path, folder: Path) -> tuple[int | None, str, str]:
    """Exit code (None: it did not end), what is printed, and what is written to standard error."""
    files = folder / "printed.txt", folder / "complained.txt"
    child = _server.Process(target=_main, args=(str(program), str(folder), *map(str, files)))
    child.start()
    child.join(SECONDS)
    child.kill()
    child.join()
    printed, complained = (file.read_text(encoding="utf-8") for file in files)
    return child.exitcode, printed, complained
