"""Long tables of llmt.robotics: Ctrl-C ends a call, and the time follows the number of rows."""

import os
import signal
import threading
import time
from pathlib import Path

import pytest

robotics = pytest.importorskip("llmt.robotics")
pytest.importorskip("pandas")

POINT = ["x_mm", "y_mm", "z_mm"]


@pytest.fixture(scope="module")
def arm():
    return robotics.robot(Path(__file__).parents[2] / "docs" / "samples" / "arm.yaml")


def _threads():
    return len(os.listdir("/proc/self/task"))


@pytest.mark.parametrize("task", ["compensate", "compensate without joints", "predict", "simulate"])
def test_ctrl_c_ends_long_tables(arm, task, tmp_path):
    table = tmp_path / "table.csv"
    simulated = robotics.simulate(arm, 50_000)
    (simulated[POINT] if task == "compensate without joints" else simulated).to_csv(table, index=False)
    call = {"predict": robotics.predict, "simulate": robotics.simulate}.get(task, robotics.compensate)
    threads = []
    for _ in range(2):
        sent = []

        def interrupt(sent=sent):
            sent.append(time.process_time())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(0.3, interrupt)
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            for _ in range(1000):
                call(arm, table)
        assert time.process_time() - sent[0] < 1.0
        timer.join()
        threads.append(_threads())
    assert threads[1] <= threads[0]  # oneTBB keeps its threads for the next call


def test_time_of_targets_is_proportional_to_their_number(arm):
    targets = robotics.simulate(arm, 40_000)
    started = time.process_time()
    robotics.compensate(arm, targets[:4_000])
    few = time.process_time() - started
    robotics.compensate(arm, targets)
    many = time.process_time() - started - few
    assert many < 40.0 * few  # it was 100 times
