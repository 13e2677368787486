"""python3 bench/distributed/faults.py LLMT [LLMT_MPI] [--kills K] [--rows N]: what `llmt fit` and `llmt-mpi` do when
they are killed at K random moments, when a process of a job stops, when files are cut off, missing or changed, and when
a disk is full (docs/algorithms/distributed.md, "Faults"). A claim is that a model has the bytes of an undisturbed fit,
or that the program ends soon, says what is wrong, and leaves no file. Exits with 1 if a claim does not hold.

Full disks are file systems in memory, which only root may make. dask_faults.py is the same for Dask."""

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

PATIENCE = 120  # seconds after which a command counts as one that hangs
FIT = ["-t", "y", "--validity", "crisp", "--max-leaves", "6", "--cv", "2", "--threads", "1"]


class Study:
    """Commands in a folder of their own, and the claims that did not hold."""

    def __init__(self, folder: Path, llmt: str, llmt_mpi: str | None, rows: int) -> None:
        self.folder, self.llmt, self.llmt_mpi = folder, llmt, llmt_mpi
        self.failed: list[str] = []
        self.claims = 0
        write_csv(folder / "all.csv", rows)
        self.done([llmt, "table", "all.csv", "-o", "d.arrow"])
        self.memory = f"{rows * 5 * 8 * 5 // 3 // 1024}K"  # branches of a quarter of the rows
        begin = time.monotonic()
        self.done(self.fit("d.arrow", "-o", "one.json"))
        self.seconds = time.monotonic() - begin
        self.expected = (folder / "one.json").read_bytes()

    def fit(self, *words: str) -> list[str]:
        return [self.llmt, "fit", *words, *FIT, "--memory", self.memory]

    def mpi(self, processes: int, *words: str) -> list[str]:
        job = ["mpirun", "--oversubscribe", "-n", str(processes), str(self.llmt_mpi)]
        return [*job, *words, *FIT, "--memory", self.memory]

    def start(self, command: list[str]) -> subprocess.Popen:
        # OMPI_*: root in containers.
        allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        return subprocess.Popen(
            command,
            cwd=self.folder,
            env=os.environ | allowed | {"TMPDIR": str(self.folder)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def end(self, process: subprocess.Popen) -> tuple[int, str]:
        """Exit code and messages of a process; one that does not end is ended, and a claim that failed."""
        try:
            out, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, err = process.communicate()
            self.claim(False, f"ended within {PATIENCE} s: {process.args}")
        return process.returncode, err or out

    def run(self, command: list[str]) -> tuple[int, str]:
        return self.end(self.start(command))

    def wait_for_pass(self) -> None:
        """Until there is a checkpoint."""
        begin = time.monotonic()
        while not (self.folder / "state").exists() and time.monotonic() < begin + PATIENCE:
            time.sleep(0.01)

    def done(self, command: list[str]) -> None:
        code, said = self.run(command)
        if code != 0:
            sys.exit(f"{' '.join(command)}: {said}")

    def claim(self, holds: bool, what: str) -> bool:
        self.claims += 1
        if not holds:
            self.failed.append(what)
            print(f"  FAILED: {what}", flush=True)
        return holds

    def is_same(self, model: str, what: str) -> bool:
        path = self.folder / model
        return self.claim(
            path.exists() and path.read_bytes() == self.expected, f"{what}: the bytes of an undisturbed fit"
        )

    def is_absent_or_same(self, what: str) -> None:
        """The last process may die when the model is written."""
        path = self.folder / "m.json"
        self.claim(not path.exists() or path.read_bytes() == self.expected, f"{what} leaves no half model")

    def is_refused(self, command: list[str], named: str, output: str, what: str) -> str:
        """The first line of the refusal."""
        code, said = self.run(command)
        self.claim(code not in (0, -signal.SIGSEGV, -signal.SIGBUS, -signal.SIGABRT), f"{what}: ends with an error")
        self.claim(named in said, f"{what}: names {named}: {said}")
        self.claim(not (self.folder / output).exists(), f"{what}: leaves no {output}")
        return next((line for line in said.splitlines() if named in line), "")

    def remove(self, *names: str) -> None:
        for name in names:
            (self.folder / name).unlink(missing_ok=True)


def write_csv(path: Path, rows: int) -> None:
    """A function of four uniform inputs with a jump, and noise of standard deviation 0.1."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-1.0, 1.0, (rows, 4))
    y = np.where(x[:, 0] > 0.0, np.sin(3.0 * x[:, 1]), x[:, 2] * x[:, 3]) + 0.1 * rng.normal(size=rows)
    np.savetxt(path, np.column_stack([x, y]), fmt="%.6f", delimiter=",", header="a,b,c,d,y", comments="")


def processes_below(pid: int) -> list[int]:
    """The processes that `pid` has started, and those that they have."""
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            if entry.name.isdigit() and int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) == pid:
                found += [int(entry.name), *processes_below(int(entry.name))]
    return found


def is_running(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return (Path("/proc") / str(pid) / "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False


def kill_one_process(study: Study, kills: int) -> None:
    killed = 0
    fits = 0
    held = 0
    while killed < kills:
        study.remove("state", "m.json")
        job = study.start(study.fit("d.arrow", "--checkpoint", "state", "--resume", "-o", "m.json"))
        time.sleep(random.uniform(0.0, study.seconds))
        job.kill()
        code, _ = study.end(job)
        fits += 1
        if code == 0:
            study.is_same("m.json", "llmt fit that had ended before")
            continue
        killed += 1
        held += (study.folder / "state").exists()
        study.is_absent_or_same("a program that was killed")
        study.done(study.fit("d.arrow", "--checkpoint", "state", "--resume", "-o", "m.json"))
        study.is_same("m.json", "llmt fit --resume after kill -9")
    print(f"llmt fit: {killed} of {fits} fits killed at random moments, {held} times with a checkpoint", flush=True)


def kill_processes_of_jobs(study: Study, kills: int) -> None:
    killed = 0
    fits = 0
    begin = time.monotonic()
    study.done(study.mpi(3, "d.arrow", "-o", "m.json"))
    seconds = time.monotonic() - begin
    study.is_same("m.json", "3 processes")
    longest = 0.0
    while killed < kills:
        study.remove("state", "m.json")
        job = study.start(study.mpi(3, "d.arrow", "--checkpoint", "state", "--resume", "-o", "m.json"))
        time.sleep(random.uniform(0.0, seconds))
        below = processes_below(job.pid)
        victim = random.choice([job.pid, *below])  # mpirun among them
        with contextlib.suppress(ProcessLookupError):
            os.kill(victim, signal.SIGKILL)
        begin = time.monotonic()
        code, _ = study.end(job)
        while any(map(is_running, below)) and time.monotonic() < begin + PATIENCE:
            time.sleep(0.05)
        study.claim(not any(map(is_running, below)), "no process of a job that was killed goes on")
        longest = max(longest, time.monotonic() - begin)
        fits += 1
        if code != 0:
            killed += 1
            study.is_absent_or_same("a job that was killed")
            study.done(study.mpi(1 + killed % 4, "d.arrow", "--checkpoint", "state", "--resume", "-o", "m.json"))
        study.is_same("m.json", "llmt-mpi --resume after kill -9")
    print(
        f"llmt-mpi: {killed} of {fits} jobs killed at random moments, ended after {longest:.1f} s at most", flush=True
    )
    study.remove("m.json")
    job = study.start(study.mpi(3, "d.arrow", "--patience", "5", "-o", "m.json"))
    time.sleep(0.5 * seconds)
    os.kill(max(processes_below(job.pid)), signal.SIGSTOP)
    begin = time.monotonic()
    code, said = study.end(job)
    study.claim(code != 0 and "has waited 5 s" in said, f"a process that stops is waited for as long as asked: {said}")
    line = next((line for line in said.splitlines() if "has waited" in line), "")
    print(f"llmt-mpi: a process stopped, ended after {time.monotonic() - begin:.1f} s: {line}", flush=True)


def cut_files(study: Study, cuts: int) -> None:
    whole = (study.folder / "d.arrow").read_bytes()
    for length in [0, len(whole) - 1, *(random.randrange(len(whole)) for _ in range(cuts - 2))]:
        (study.folder / "cut.arrow").write_bytes(whole[:length])
        said = study.is_refused(study.fit("cut.arrow", "-o", "cut.json"), "cut.arrow", "cut.json", f"{length} bytes")
    print(f"Arrow: {cuts} files that were cut off: {said}", flush=True)
    rows = (study.folder / "all.csv").read_bytes().splitlines(keepends=True)
    (study.folder / "one.csv").write_bytes(b"".join(rows[:2001]))
    refused = 0
    for _ in range(cuts):
        text = b"".join(rows[2001:4001])
        text = rows[0] + text[: random.randrange(len(text))]
        (study.folder / "cut.csv").write_bytes(text)
        command = study.fit("one.csv", "cut.csv", "-o", "cut.json")
        if text.splitlines()[-1].count(b",") == 4 and not text.endswith(b","):
            code, said = study.run([*command, "--json"])
            study.claim(
                code == 0 and json.loads(said)["rows"] == 2000 + len(text.splitlines()) - 1, f"a shorter table: {said}"
            )
            study.remove("cut.json")
            continue
        refused += 1
        message = study.is_refused(
            command, f"cut.csv:{len(text.splitlines())}", "cut.json", f"CSV of {len(text)} bytes"
        )
    print(f"CSV: {refused} of {cuts} files were cut off inside of a row: {message}", flush=True)
    study.remove("state")
    study.remove("m.json")
    job = study.start(study.fit("d.arrow", "--checkpoint", "state", "-o", "m.json"))
    study.wait_for_pass()
    os.truncate(study.folder / "d.arrow", len(whole) // 3)
    code, said = study.end(job)
    study.claim(code > 0 and "d.arrow" in said and not (study.folder / "m.json").exists(), f"cut off under way: {said}")
    print(f"Arrow: cut off under way: {said.strip()}", flush=True)
    (study.folder / "d.arrow").write_bytes(whole)
    study.done(study.fit("d.arrow", "--checkpoint", "state", "--resume", "-o", "m.json"))
    study.is_same("m.json", "a file that is whole again")


def lose_shards(study: Study) -> None:
    rows = (study.folder / "all.csv").read_text().splitlines(keepends=True)
    shards = [f"shard{k}.arrow" for k in range(4)]
    bounds = [1 + (len(rows) - 1) * k // 4 for k in range(5)]
    for k, shard in enumerate(shards):
        (study.folder / "s.csv").write_text("".join([rows[0], *rows[bounds[k] : bounds[k + 1]]]))
        study.done([study.llmt, "table", "s.csv", "-o", shard])
    study.remove("state", "m.json")
    study.done(study.fit(*shards, "-o", "m.json"))
    study.is_same("m.json", "four shards")
    study.remove("m.json")
    resumed = study.fit(*shards, "--checkpoint", "state", "--resume", "-o", "m.json")
    job = study.start(resumed)
    study.wait_for_pass()
    job.kill()
    study.end(job)
    (study.folder / shards[2]).rename(study.folder / "away")
    print("missing shard:", study.is_refused(resumed, shards[2], "m.json", "a missing shard"))
    for name, lines in {
        "shorter": rows[bounds[2] : bounds[3] - 9],
        "other": rows[1 : 1 + bounds[3] - bounds[2]],
    }.items():
        (study.folder / "s.csv").write_text("".join([rows[0], *lines]))
        study.done([study.llmt, "table", "s.csv", "-o", shards[2]])
        print(f"{name} shard:", study.is_refused(resumed, "table", "m.json", f"a shard with {name} rows"))
        study.remove(shards[2])
    (study.folder / "away").rename(study.folder / shards[2])
    study.done(resumed)
    study.is_same("m.json", "a shard that is back")


@contextlib.contextmanager
def full_disk(study: Study, size: int) -> Iterator[Path]:
    disk = study.folder / "disk"
    disk.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", disk], check=True)
    try:
        yield disk
    finally:
        subprocess.run(["umount", disk], check=True)
        disk.rmdir()


def fill_disks(study: Study) -> None:
    if os.geteuid() != 0:
        print("full disks: left out, only root can make one")
        return
    with full_disk(study, 1 << 20) as disk:
        filler = disk / "filler"

        def leave(room: int) -> None:
            filler.write_bytes(bytes((1 << 20) - room))

        leave(4096)
        print(
            "full disk, model:",
            study.is_refused(study.fit("d.arrow", "-o", "disk/m.json"), "disk/m.json", "disk/m.json", "model"),
        )
        table = [study.llmt, "table", "all.csv", "-o", "disk/t.arrow"]
        print("full disk, table:", study.is_refused(table, "disk/t.arrow", "disk/t.arrow", "table"))
        spilled = ["env", f"TMPDIR={disk}", *study.fit("one.csv", "all.csv", "-o", "m.json")]
        study.remove("m.json")
        print("full disk, CSV:", study.is_refused(spilled, str(disk), "m.json", "rows of CSV files"))
        leave(16384)
        kept = study.fit("d.arrow", "--checkpoint", "disk/state", "--resume", "-o", "m.json")
        print("full disk, checkpoint:", study.is_refused(kept, "disk/state", "m.json", "checkpoint"))
        left = {path.name for path in disk.iterdir()} - {"filler", "state"}
        study.claim(not left, f"a full disk has no other files: {left}")
        print(f"the checkpoint before has {(disk / 'state').stat().st_size if (disk / 'state').exists() else 0} bytes")
        filler.unlink()
        study.done(kept)
        study.is_same("m.json", "a disk with room again")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("llmt")
    parser.add_argument("llmt_mpi", nargs="?")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--rows", type=int, default=200_000)
    given = parser.parse_args()
    random.seed(1)
    with tempfile.TemporaryDirectory() as name:
        llmt_mpi = given.llmt_mpi and os.path.abspath(given.llmt_mpi)
        study = Study(Path(name), os.path.abspath(given.llmt), llmt_mpi, given.rows)
        print(f"{given.rows} rows, an undisturbed fit takes {study.seconds:.1f} s", flush=True)
        kill_one_process(study, given.kills)
        if llmt_mpi:
            kill_processes_of_jobs(study, given.kills)
        cut_files(study, given.kills)
        lose_shards(study)
        fill_disks(study)
    print(f"{study.claims - len(study.failed)} of {study.claims} claims hold")
    return 1 if study.failed else 0


if __name__ == "__main__":
    sys.exit(main())
