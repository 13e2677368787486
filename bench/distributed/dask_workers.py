"""python3 bench/distributed/dask_workers.py [--rows N]: fits of a folder of Parquet files by worker processes of Dask,
each number of workers beside the first. Prints seconds, bytes of the sums of each pass, seconds of transfers between
workers, and whether the model is the same to the byte (docs/algorithms/distributed.md). dask_faults.py kills them."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import dask
import numpy as np
import pandas as pd

from llmt import LocalLinearTreeRegressor, distributed
from llmt import dask as llmt_dask

INPUTS = [f"x{k}" for k in range(1, 11)]


def write_table(folder: Path, rows: int, files: int) -> None:
    """Friedman's function (1991) of ten uniform inputs, and noise of standard deviation 1."""
    rng = np.random.default_rng(1)
    for number, count in enumerate(np.diff(np.linspace(0, rows, files + 1).astype(int))):
        x = rng.uniform(size=(count, 10))
        truth = 10 * np.sin(np.pi * x[:, 0] * x[:, 1]) + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]
        frame = pd.DataFrame(x, columns=INPUTS).assign(y=truth + rng.normal(size=count))
        frame.to_parquet(folder / f"{number:04}.parquet")


class Passes:
    """Records the sums that passes bring to the calling process."""

    def __init__(self) -> None:
        self.bytes: list[tuple[str, int]] = []
        self._advance = distributed.advance
        distributed.advance = self._record

    def _record(self, state: bytes, sums: bytes) -> bytes:
        self.bytes.append((distributed.status(state)["step"], len(sums)))
        return self._advance(state, sums)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=200_000)
    parser.add_argument("--files", type=int, default=8)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    given = parser.parse_args()
    from distributed import Client, LocalCluster, get_task_stream

    options = {
        "branch_rows": given.rows // 4,
        "sample_rows": given.rows // 8,
        "block_rows": 8192,
        "estimator": LocalLinearTreeRegressor(validity="crisp", max_leaves=8, n_jobs=1),
    }
    # On a busy machine a worker takes longer to start again than the 15 s after which LocalCluster gives it up.
    dask.config.set({"distributed.deploy.lost-worker-timeout": "600 s"})
    of_workers = {"threads_per_worker": 1, "dashboard_address": None, "death_timeout": 600}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_table(folder, given.rows, given.files)
        begin = time.monotonic()
        expected = llmt_dask.fit(folder, "y", **options).to_json()
        print(f"one process: {time.monotonic() - begin:.1f} s, {given.rows} rows in {given.files} files")
        same = True
        for count in given.workers:
            with LocalCluster(n_workers=count, **of_workers) as cluster:
                with Client(cluster) as client, get_task_stream(client) as stream:
                    passes = Passes()
                    begin = time.monotonic()
                    model = llmt_dask.fit(folder, "y", client=client, **options).to_json()
                    seconds = time.monotonic() - begin
                    distributed.advance = passes._advance
                transfers = [
                    part for task in stream.data for part in task["startstops"] if part["action"] == "transfer"
                ]
                moved = sum(part["stop"] - part["start"] for part in transfers)
            print(
                f"{count} workers: {seconds:.1f} s, {moved:.2f} s in {len(transfers)} transfers, "
                f"same bytes: {model == expected}"
            )
            same = same and model == expected
        print("bytes of the sums:", ", ".join(f"{step} {count}" for step, count in passes.bytes))
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
