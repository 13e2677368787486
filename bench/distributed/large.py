"""python3 bench/distributed/large.py LLMT ROWS FOLDER [--memory 4G] [--inputs D] [OPTIONS of llmt fit]: time, peak
of resident memory and error of `llmt fit` of an Arrow file, which is written into FOLDER in pieces and deleted
afterwards (docs/algorithms/distributed.md, "What it costs"). Needs 8 (D + 1) ROWS bytes of disk. `--lightgbm` fits
LightGBM to the same rows instead, read into memory as 32-bit numbers."""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa

PIECE = 1 << 20


def friedman(rng: np.random.Generator, rows: int, inputs: int) -> tuple[np.ndarray, np.ndarray]:
    """Uniform inputs, and the function of Friedman (1991) of the first five."""
    x = rng.uniform(size=(rows, inputs))
    return x, 10 * np.sin(np.pi * x[:, 0] * x[:, 1]) + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]


def batch(rng: np.random.Generator, rows: int, inputs: int) -> pa.RecordBatch:
    x, truth = friedman(rng, rows, inputs)
    columns = [*x.T, truth + rng.normal(size=rows)]
    return pa.RecordBatch.from_arrays(
        [pa.array(np.ascontiguousarray(column)) for column in columns], [*(f"x{j + 1}" for j in range(inputs)), "y"]
    )


def write_table(path: Path, rows: int, inputs: int) -> None:
    rng = np.random.default_rng(1)
    first = batch(np.random.default_rng(0), 1, inputs)
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, first.schema) as writer:
        for begin in range(0, rows, PIECE):
            writer.write_batch(batch(rng, min(PIECE, rows - begin), inputs))


def fit_llmt(given: argparse.Namespace, table: Path, asked: np.ndarray) -> np.ndarray:
    model = given.folder / "model.json"
    command = [
        given.llmt,
        "fit",
        table,
        "-t",
        "y",
        "--memory",
        given.memory,
        "--no-intervals",
        "-o",
        model,
        *given.options,
    ]
    begin = time.monotonic()
    process = subprocess.Popen(command)
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"llmt fit ended with {os.waitstatus_to_exitcode(status)}")
    print(
        f"llmt fit: {time.monotonic() - begin:.0f} s, {used.ru_utime + used.ru_stime:.0f} CPU s, "
        f"{used.ru_maxrss / 2**20:.2f} GiB resident at most",
        flush=True,
    )
    rows = given.folder / "asked.csv"
    names = [f"x{j + 1}" for j in range(given.inputs)]
    np.savetxt(rows, asked, delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    predicted = given.folder / "predicted.csv"
    subprocess.run([given.llmt, "predict", model, rows, "-o", predicted], check=True)
    place = predicted.open().readline().strip().split(",").index("y_pred")
    values = np.loadtxt(predicted, delimiter=",", skiprows=1, usecols=place)
    for path in (model, rows, predicted):
        path.unlink()
    return values


def fit_lightgbm(given: argparse.Namespace, table: Path, asked: np.ndarray) -> np.ndarray:
    import resource

    import lightgbm

    begin = time.monotonic()
    x = np.empty((given.rows, given.inputs), np.float32)
    y = np.empty(given.rows, np.float32)
    with pa.memory_map(str(table)) as source, pa.ipc.open_file(source) as reader:
        at = 0
        for number in range(reader.num_record_batches):
            piece = reader.get_batch(number)
            for column in range(given.inputs):
                x[at : at + len(piece), column] = piece.column(column)
            y[at : at + len(piece)] = piece.column(given.inputs)
            at += len(piece)
    model = lightgbm.LGBMRegressor(n_jobs=given.threads, verbose=-1).fit(x, y)
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(
        f"LightGBM: {time.monotonic() - begin:.0f} s, {used.ru_utime + used.ru_stime:.0f} CPU s, "
        f"{used.ru_maxrss / 2**20:.2f} GiB resident at most, pages of the mapped file included",
        flush=True,
    )
    return model.predict(asked)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("llmt")
    parser.add_argument("rows", type=lambda text: int(float(text)))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--memory", default="4G")
    parser.add_argument("--inputs", type=int, default=10)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--lightgbm", action="store_true")
    given, options = parser.parse_known_args()
    given.options = [*options, "--threads", str(given.threads)]
    table = given.folder / "large.arrow"
    try:
        begin = time.monotonic()
        write_table(table, given.rows, given.inputs)
        print(
            f"{given.rows} rows, {table.stat().st_size / 1e9:.2f} GB written in {time.monotonic() - begin:.0f} s",
            flush=True,
        )
        asked, truth = friedman(np.random.default_rng(2), 50000, given.inputs)
        predicted = (fit_lightgbm if given.lightgbm else fit_llmt)(given, table, asked)
    finally:
        table.unlink(missing_ok=True)
    print(f"RMSE to the function {np.sqrt(np.mean((predicted - truth) ** 2)):.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
