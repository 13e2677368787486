"""Writing of files."""

from __future__ import annotations

import os

from . import _core


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Makes the text, in UTF-8, the content of a file, as a whole: if a step fails (no such folder, disk full), OSError is
    raised, an old file stays as it was and nothing is left behind."""
    _core.write_file(os.fsencode(path), text)


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """As `write_text`, of bytes."""
    _core.write_file(os.fsencode(path), content)
