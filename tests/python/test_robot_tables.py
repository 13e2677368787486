"""Long tables of llmt.robotics: Ctrl-C ends a call, and leaves no thread."""

import os
import signal
import threading
from pathlib import Path

import pytest

robotics = pytest.importorskip("llmt.robotics")
pytest.importorskip("pandas")

POINT = ["x_mm", "y_mm", "z_mm"]


@pytest.fixture(scope="module")
def arm():
    return robotics.robot(Path(__file__).parents[2] / "docs" / "samples" / "arm.yaml")


@pytest.fixture(scope="module")
def tables(arm, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    simulated = robotics.simulate(arm, 50_000)
    simulated.to_csv(folder / "all.csv", index=False)
    simulated[POINT].to_csv(folder / "points.csv", index=False)
    return {"all": folder / "all.csv", "points": folder / "points.csv"}


def _threads():
    return len(os.listdir("/proc/self/task"))


@pytest.mark.parametrize("task", ["compensate", "compensate without joints", "predict", "simulate"])
def test_ctrl_c_ends_long_tables(arm, task, tables):
    table = tables["points" if task == "compensate without joints" else "all"]
    call = {"predict": robotics.predict, "simulate": robotics.simulate}.get(task, robotics.compensate)
    before = _threads()
    for after in (0.05, 0.1, 0.3):
        timer = threading.Timer(after, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            for _ in range(1000):
                call(arm, table)
        timer.join()
    assert _threads() - before <= os.cpu_count()  # oneTBB keeps its threads for the next call
