"""A bar that shows how far a fit is."""

from __future__ import annotations

import html
import os
import sys
import time
from collections.abc import Callable
from typing import Any

_PATIENCE = 2.0  # seconds of silence: most fits are done by then
_BETWEEN = 0.1  # seconds between two pictures
_BAR = 24  # letters


class Bar:
    """What `_core.fit` is given to report to: a bar with the time left, on a terminal and in notebooks.

    Nothing is shown before two seconds have passed, nor where standard error is neither a terminal nor that of a
    notebook's kernel. At the end, also after an exception, the bar is erased:

        with Bar() as bar:
            _core.fit(..., report=bar)

    No call raises because of the bar, no file is written, no thread is started, and IPython is only used if it runs.
    """

    def __init__(self, title: str = "fit", clock: Callable[[], float] = time.monotonic) -> None:
        self._title = title
        self._clock = clock
        self._begin = self._latest = clock()
        self._show = _on_notebook() or _on_terminal()

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __call__(self, done: int, total: int, step: str = "") -> None:
        """`done` of `total` is done; `step` says what comes now."""
        if self._show is None or total <= 0:
            return
        now = self._clock()
        if now - self._begin < _PATIENCE or now - self._latest < _BETWEEN:
            return
        self._latest = now
        share = min(max(done / total, 0.0), 1.0)
        left = (now - self._begin) * (1.0 - share) / share if share > 0.01 else None
        self._try(share, f"{_duration(left)} left" if left is not None else "", step)

    def close(self) -> None:
        """Erases the bar."""
        self._try(None, "", "")
        self._show = None

    def _try(self, share: float | None, left: str, step: str) -> None:
        if self._show is None:
            return
        try:
            self._show(self._title, share, left, step)
        except Exception:  # a closed terminal, a kernel that has gone: the fit matters, the bar does not
            self._show = None


_Show = Callable[[str, "float | None", str, str], None]


def _on_terminal() -> _Show | None:
    stream = sys.stderr
    try:
        if stream is None or not stream.isatty() or os.environ.get("TERM") == "dumb":
            return None
    except Exception:
        return None
    is_shown = False

    def show(title: str, share: float | None, left: str, step: str) -> None:
        nonlocal is_shown
        if share is None:
            if is_shown:
                stream.write("\r\x1b[K")
                stream.flush()
            is_shown = False
            return
        width = os.get_terminal_size(stream.fileno()).columns or 80  # 0: a terminal that nobody told its size
        full = round(share * _BAR)
        text = f"{title} [{'#' * full}{'.' * (_BAR - full)}] {100 * share:3.0f} %  {left}  {step}".rstrip()
        stream.write(f"\r\x1b[K{text[: max(0, width - 1)]}")
        stream.flush()
        is_shown = True

    return show


def _on_notebook() -> _Show | None:
    ipython = sys.modules.get("IPython")
    try:
        if ipython is None or getattr(ipython.get_ipython(), "kernel", None) is None:
            return None
        from IPython.display import HTML, display
    except Exception:
        return None
    shown_as: Any = None

    def show(title: str, share: float | None, left: str, step: str) -> None:
        nonlocal shown_as
        if share is None:
            if shown_as is not None:
                shown_as.update(HTML(""))
            shown_as = None
            return
        text = html.escape(f"{title} {100 * share:.0f} %  {left}  {step}".rstrip())
        bar = HTML(
            f'<div style="font:13px system-ui,sans-serif"><progress value="{share:.3f}" max="1" '
            f'style="width:240px;vertical-align:middle"></progress> {text}</div>'
        )
        if shown_as is None:
            shown_as = display(bar, display_id=True)
        else:
            shown_as.update(bar)

    return show


def _duration(seconds: float) -> str:
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes / 60.0:.1f} h"
