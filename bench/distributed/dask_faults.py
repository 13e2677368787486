"""python3 bench/distributed/dask_faults.py [--rows N] [--kills K]: what `llmt.dask` does when workers are killed at K
random moments, when the calling process is killed, when the scheduler dies, and when a file of the folder is cut off or
disappears (docs/algorithms/distributed.md, "Faults"). faults.py is the same for the programs. Exits with 1 if a model
has other bytes than that of an undisturbed fit, or if a fit neither ends nor says what is wrong."""

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import dask
from dask_workers import write_table

from llmt import LocalLinearTreeRegressor
from llmt import dask as llmt_dask

PATIENCE = 300  # seconds after which a fit counts as one that hangs

# A fit by a process of its own: folder, file of the checkpoint, file of the model, address of a scheduler or "".
CALLER = """
import sys
from dask_faults import options
from llmt import dask as llmt_dask
folder, state, model, address, rows = sys.argv[1:]
client = None
if address:
    from distributed import Client
    client = Client(address, timeout=60)
fitted = llmt_dask.fit(folder, "y", checkpoint=state, resume=True, client=client, timeout=60, **options(int(rows)))
fitted.save(model)
"""


def options(rows: int) -> dict:
    return {
        "branch_rows": rows // 4,
        "sample_rows": rows // 8,
        "block_rows": 4096,
        "estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=4, cv=2, n_jobs=1),
    }


def kill_workers(folder: Path, rows: int, kills: int, expected: str) -> bool:
    from distributed import Client, LocalCluster

    # On a busy machine a worker takes longer to start again than the 15 s after which LocalCluster gives it up.
    dask.config.set({"distributed.deploy.lost-worker-timeout": "600 s"})
    same = True
    killed: list[int] = []
    fits = 0
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, death_timeout=600) as cluster:
        with Client(cluster) as client:
            client.wait_for_workers(2, timeout=PATIENCE)
            begin = time.monotonic()
            same = llmt_dask.fit(folder, "y", client=client, **options(rows)).to_json() == expected
            seconds = time.monotonic() - begin

            def kill_one(moment: float, ended: threading.Event) -> None:
                if ended.wait(moment):
                    return
                pids = [worker.pid for worker in cluster.workers.values() if worker.pid]
                if pids:
                    victim = random.choice(pids)
                    subprocess.run(["kill", "-9", str(victim)], check=False)
                    killed.append(victim)

            while len(killed) < kills:
                client.wait_for_workers(2, timeout=PATIENCE)
                ended = threading.Event()
                killer = threading.Thread(target=kill_one, args=(random.uniform(0.0, seconds), ended))
                killer.start()
                model = llmt_dask.fit(folder, "y", client=client, timeout=PATIENCE, **options(rows)).to_json()
                ended.set()
                killer.join()
                fits += 1
                same = same and model == expected
    print(f"{len(killed)} workers killed in {fits} fits of {seconds:.1f} s: same bytes: {same}", flush=True)
    return same


def start_caller(at: Path, folder: Path, rows: int, address: str = "") -> subprocess.Popen:
    words = [str(folder), str(at / "state"), str(at / "model.json"), address, str(rows)]
    # The folder of this file comes first in the path of modules.
    return subprocess.Popen(
        [sys.executable, "-c", CALLER, *words], cwd=Path(__file__).parent, stderr=subprocess.PIPE, text=True
    )


def kill_callers(at: Path, folder: Path, rows: int, kills: int, expected: str) -> bool:
    begin = time.monotonic()
    if start_caller(at, folder, rows).wait(timeout=PATIENCE) != 0:
        return False
    seconds = time.monotonic() - begin
    killed = 0
    fits = 0
    same = True
    while killed < kills:
        (at / "state").unlink(missing_ok=True)
        (at / "model.json").unlink(missing_ok=True)
        caller = start_caller(at, folder, rows)
        time.sleep(random.uniform(0.0, seconds))
        caller.kill()
        fits += 1
        if caller.wait(timeout=PATIENCE) == -signal.SIGKILL:
            killed += 1
            same = same and not (at / "model.json").exists()
            same = same and start_caller(at, folder, rows).wait(timeout=PATIENCE) == 0
        same = same and (at / "model.json").read_text() == expected
    print(f"the calling process killed in {killed} of {fits} fits, and resumed: same bytes: {same}", flush=True)
    return same


def kill_scheduler(at: Path, folder: Path, rows: int, expected: str) -> bool:
    """A scheduler that dies ends the fit with an error; a new one goes on from the checkpoint."""
    (at / "state").unlink(missing_ok=True)
    (at / "model.json").unlink(missing_ok=True)
    file = at / "scheduler.json"

    def start_cluster() -> tuple[list[subprocess.Popen], str]:
        import json

        file.unlink(missing_ok=True)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        dask_ = [sys.executable, "-m", "distributed.cli"]
        scheduler = [
            *dask_[:-1],
            "distributed.cli.dask_scheduler",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(file),
        ]
        worker = [
            *dask_[:-1],
            "distributed.cli.dask_worker",
            "--scheduler-file",
            str(file),
            "--nthreads",
            "1",
            "--no-dashboard",
        ]
        processes = [
            subprocess.Popen(scheduler, **quiet),
            subprocess.Popen([*worker, "--death-timeout", "60"], **quiet),
        ]
        begin = time.monotonic()
        while not file.exists() and time.monotonic() < begin + PATIENCE:
            time.sleep(0.1)
        time.sleep(0.5)
        return processes, json.loads(file.read_text())["address"]

    processes, address = start_cluster()
    caller = start_caller(at, folder, rows, address)
    begin = time.monotonic()
    while not (at / "state").exists() and time.monotonic() < begin + PATIENCE:
        time.sleep(0.05)
    processes[0].kill()
    begin = time.monotonic()
    said = caller.communicate(timeout=PATIENCE)[1]
    last = said.strip().splitlines()[-1] if said.strip() else ""
    print(
        f"scheduler killed: ended after {time.monotonic() - begin:.1f} s with {caller.returncode}: {last}", flush=True
    )
    ended = caller.returncode > 0 and not (at / "model.json").exists()
    for process in processes:
        process.kill()
        process.wait()
    processes, address = start_cluster()
    code = start_caller(at, folder, rows, address).wait(timeout=PATIENCE)
    for process in processes:
        process.kill()
        process.wait()
    same = code == 0 and (at / "model.json").read_text() == expected
    print(f"with another scheduler: same bytes: {same}", flush=True)
    return ended and same


def lose_files(at: Path, folder: Path, rows: int, expected: str) -> bool:
    """A file that is cut off, and one that disappears after the first pass."""
    files = sorted(folder.glob("*.parquet"))
    whole = files[3].read_bytes()
    held = True
    for length in [0, len(whole) - 1, *(random.randrange(len(whole)) for _ in range(8))]:
        files[3].write_bytes(whole[:length])
        try:
            llmt_dask.fit(folder, "y", **options(rows))
            held = False
        except (OSError, ValueError) as error:
            message = str(error)
            held = held and str(files[3]) in message
    print(f"10 files cut off, all named: {held}: {message}", flush=True)
    files[3].write_bytes(whole)
    (at / "state").unlink(missing_ok=True)
    (at / "model.json").unlink(missing_ok=True)
    caller = start_caller(at, folder, rows)
    begin = time.monotonic()
    while not (at / "state").exists() and time.monotonic() < begin + PATIENCE:
        time.sleep(0.01)
    files[3].unlink()
    said = caller.communicate(timeout=PATIENCE)[1].strip().splitlines()
    named = caller.returncode > 0 and any(str(files[3]) in line for line in said)
    print(f"a file disappears under way: named: {named}: {said[-1] if said else ''}", flush=True)
    resumed = start_caller(at, folder, rows)
    said = resumed.communicate(timeout=PATIENCE)[1].strip().splitlines()
    print(f"resumed without it: {said[-1] if said else ''}", flush=True)
    held = held and named and resumed.returncode > 0 and not (at / "model.json").exists()
    files[3].write_bytes(whole)
    same = start_caller(at, folder, rows).wait(timeout=PATIENCE) == 0 and (at / "model.json").read_text() == expected
    print(f"resumed with it: same bytes: {same}", flush=True)
    return held and same


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=60_000)
    parser.add_argument("--kills", type=int, default=20)
    given = parser.parse_args()
    random.seed(1)
    with tempfile.TemporaryDirectory() as name:
        at = Path(name)
        folder = at / "table"
        folder.mkdir()
        write_table(folder, given.rows, 8)
        begin = time.monotonic()
        expected = llmt_dask.fit(folder, "y", **options(given.rows)).to_json()
        print(f"{given.rows} rows, an undisturbed fit takes {time.monotonic() - begin:.1f} s", flush=True)
        held = [
            kill_workers(folder, given.rows, given.kills, expected),
            kill_callers(at, folder, given.rows, given.kills, expected),
            kill_scheduler(at, folder, given.rows, expected),
            lose_files(at, folder, given.rows, expected),
        ]
    print(f"all claims hold: {all(held)}")
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main())
