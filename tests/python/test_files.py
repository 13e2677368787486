"""A file that the package writes is the old one or the new one, whole, and a failure is an OSError."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import llmt

X = np.random.default_rng(0).uniform(-1, 1, (300, 2))
ROOT = Path(__file__).parents[2]

# A limit of the size of files is a disk that is full after so many bytes.
CHILD = """
import resource, signal, sys
import numpy as np
import llmt

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
X = np.random.default_rng(0).uniform(-1, 1, (300, 2))
model = llmt.LocalLinearTreeRegressor(max_leaves=6, cv=2).fit(X, np.abs(X[:, 0]))
size = len(model.model_.to_json().encode())
assert size > 5000
for path in sys.argv[1:]:
    for most in (0, 1, 4096, size - 1):
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
        try:
            model.save(path)
            print("written", flush=True)
        except OSError as error:
            print("refused" if path in str(error) else error, flush=True)
input()
resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
for path in sys.argv[1:]:
    model.save(path)
"""


def test_a_full_disk_leaves_the_old_file_or_none(tmp_path):
    old, new = tmp_path / "old" / "model.json", tmp_path / "new" / "model.json"
    for path in (old, new):
        path.parent.mkdir()
    old.write_text("old")
    command = [sys.executable, "-c", CHILD, str(old), str(new)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        assert [child.stdout.readline() for _ in range(8)] == ["refused\n"] * 8
        assert list(old.parent.iterdir()) == [old] and list(new.parent.iterdir()) == []
        assert old.read_text() == "old"
        child.communicate("go on\n")
    assert child.returncode == 0
    for path in (old, new):
        assert llmt.Model.load(path).handle.predict(X).shape == (300, 1)
        assert list(path.parent.iterdir()) == [path]


def test_what_cannot_be_written_is_an_os_error(tmp_path):
    model = llmt.LocalLinearTreeRegressor(cv=2).fit(X, X[:, 0])
    with pytest.raises(OSError, match="no_such_folder"):
        model.save(tmp_path / "no_such_folder" / "model.json")
    with pytest.raises(OSError):
        model.save(tmp_path)
    robotics = pytest.importorskip("llmt.robotics")
    arm = robotics.robot(ROOT / "docs" / "samples" / "arm.yaml")
    with pytest.raises(OSError, match="no_such_folder"):
        arm.save(tmp_path / "no_such_folder" / "arm.yaml")


def test_a_link_stays_a_link_and_names_may_be_any_bytes(tmp_path):
    model = llmt.LocalLinearTreeRegressor().fit(X, X[:, 0])
    target = tmp_path / os.fsdecode(b"m\xff\xc3\xa4.json")
    link = tmp_path / "link.json"
    link.symlink_to(target)
    model.save(link)
    assert link.is_symlink() and target.read_text() == model.model_.to_json()


@pytest.mark.parametrize("text", ["[" * 100_000, "{\"a\": " * 100_000, "[" * 100_000 + "]" * 100_000])
def test_brackets_without_end_are_no_model(tmp_path, text):
    path = tmp_path / "nested.json"
    path.write_text(text)
    for load in (llmt.load, llmt.Model.load, llmt.LocalLinearTreeRegressor.load):
        with pytest.raises(ValueError, match="nested.json"):
            load(path)
    with pytest.raises(ValueError):
        llmt.load_found(path)
