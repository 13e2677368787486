"""python3 bench/distributed/large.py LLMT ROWS FOLDER [--memory 4G] [--inputs D] [OPTIONS of llmt fit]: time, peak
of resident memory and error of `llmt fit` of an Arrow file, which is written into FOLDER in pieces and deleted
afterwards (docs/algorithms/distributed.md, "What it costs"). Needs 8 (D + 1) ROWS bytes of disk. `--rival NAME` fits
another learner instead, to whose process no more than --memory is given."""

import argparse
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
from large_rivals import RIVALS, limit_memory

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


def fit_rival(given: argparse.Namespace, table: Path, asked: np.ndarray) -> np.ndarray:
    limit_memory(bytes_of(given.memory))
    begin = time.monotonic()
    try:
        return RIVALS[given.rival](table, given.rows, asked, given.rounds, given.threads)
    except Exception as error:  # every learner has its own type for what it could not allocate
        sys.exit(f"{given.rival} ended with {type(error).__name__}: {str(error).strip() or 'no message'}")
    finally:
        used = resource.getrusage(resource.RUSAGE_SELF)
        print(
            f"{given.rival}: {time.monotonic() - begin:.0f} s, {used.ru_utime + used.ru_stime:.0f} CPU s, "
            f"{used.ru_maxrss / 2**20:.2f} GiB resident at most, pages of the mapped file included",
            flush=True,
        )


def bytes_of(text: str) -> int:
    return int(float(text[:-1]) * 2 ** {"M": 20, "G": 30}[text[-1]])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("llmt")
    parser.add_argument("rows", type=lambda text: int(float(text)))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--memory", default="4G")
    parser.add_argument("--inputs", type=int, default=10)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rival", choices=RIVALS)
    parser.add_argument("--rounds", type=int, default=100, help="trees of the rival")
    parser.add_argument("--keep", action="store_true", help="keep the table in FOLDER, and take one that is there")
    given, options = parser.parse_known_args()
    given.options = [*options, "--threads", str(given.threads)]
    table = given.folder / "large.arrow"
    try:
        if not (given.keep and table.exists()):
            write_table(table, given.rows, given.inputs)
        print(f"{given.rows} rows, {table.stat().st_size / 1e9:.2f} GB", flush=True)
        asked, truth = friedman(np.random.default_rng(2), 50000, given.inputs)
        predicted = (fit_rival if given.rival else fit_llmt)(given, table, asked)
    finally:
        if not given.keep:
            table.unlink(missing_ok=True)
    print(f"RMSE to the function {np.sqrt(np.mean((predicted - truth) ** 2)):.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
