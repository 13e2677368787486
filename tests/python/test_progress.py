"""The progress bar: on a terminal, in a notebook, and nowhere else."""

import os
import pty
import subprocess
import sys
import textwrap
import types

import pytest
from llmt._progress import Bar

PROGRAM = textwrap.dedent("""
    from llmt._progress import Bar
    seconds = iter([0.0, 1.0, 3.0, 4.0, 5.0, 6.0])
    with Bar("fit", clock=lambda: next(seconds)) as bar:
        for done in range(5):
            bar(done, 10, "growing")
    print("done")
""")


def test_a_terminal_sees_a_bar_that_goes_away():
    try:
        parent, child = pty.openpty()
    except OSError as error:  # as in a chroot without /dev/pts
        pytest.skip(f"the system has no pseudo-terminals: {error}")
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stderr=child, stdout=subprocess.PIPE, env={**os.environ, "TERM": "xterm"}
    ) as process:
        os.close(child)
        seen = b""
        while True:
            try:
                part = os.read(parent, 4096)
            except OSError:  # the other side is closed
                break
            if not part:
                break
            seen += part
        assert process.stdout.read() == b"done\n"
    os.close(parent)
    text = seen.decode()
    assert "growing" in text and "left" in text and "40 %" in text
    assert " 0 %" not in text, "in the first two seconds there is no bar"
    assert text.endswith("\r\x1b[K"), "the bar is erased"


def test_others_see_nothing(capsys):
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, check=True)
    assert (run.stdout, run.stderr) == (b"done\n", b"")


def test_a_notebook_updates_one_display(monkeypatch):
    shown = []

    class Display:
        def update(self, what):
            shown.append(("update", what))

    ipython = types.ModuleType("IPython")
    ipython.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    display = types.ModuleType("IPython.display")
    display.HTML = str
    display.display = lambda what, display_id: shown.append(("display", what)) or Display()
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    seconds = iter([0.0, 1.0, 3.0, 4.0])
    with pytest.raises(KeyError), Bar(clock=lambda: next(seconds)) as bar:
        for done in range(3):
            bar(done, 4, "<grow>")
        raise KeyError
    assert [kind for kind, _ in shown] == ["display", "update", "update"]
    assert "25 %" in shown[0][1] and "&lt;grow&gt;" in shown[0][1] and shown[-1][1] == ""


def test_a_bar_never_raises(monkeypatch):
    class Closed:
        def isatty(self):
            return True

        def fileno(self):
            raise OSError("closed")

    monkeypatch.setattr(sys, "stderr", Closed())
    monkeypatch.setenv("TERM", "xterm")
    seconds = iter([0.0, 3.0, 4.0])
    with Bar(clock=lambda: next(seconds)) as bar:
        bar(1, 2)
        bar(1, 2)
