#!/usr/bin/env python3
"""Mutants: one operator, bound, constant or statement of a room of C++ is changed; would its tests notice?

    python3 bench/code/mutants.py llmt/src/explain                 30 mutants of the room
    python3 bench/code/mutants.py --stages 1 llmt/src/explain      by the tests of the room's folder alone
    python3 bench/code/mutants.py --only 3,17 llmt/src/explain     some of them again, by their numbers
    python3 bench/code/mutants.py --list llmt/src/explain          what would be changed; builds nothing

A seed sets the mutants and their order; those that do not compile are not counted. Sources (.cpp) are mutated, no
headers: half of a library would be built for each. A mutant is a file of the build folder, compiled with the flags of
its source and linked in front of the library, so no source is ever written to. Its functions take the place of the
library's, because g++ -fPIC calls no function of another source but by its symbol. It meets tests in stages until one
fails: those of the folder of the room's name, for llmt the bytes of results, those of the library, those of the
programs. A mutant is killed if a test fails, crashes, or takes five times as long as without it (seconds of the
processor).
"""

import argparse
import collections
import json

import pathlib
import random
import re
import resource
import shlex
import signal
import subprocess
import sys
import time

from mutations import mutations

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARY_TESTS = {"llmt": ("llmt_reader_tests", "llmt_tests"), "robotics": ("robotics_tests",)}
BYTES = ("trees", "many_rows", "comparison", "streams")  # parts of the manifest that no program makes
PROGRAM_TESTS = {"llmt": ("app_tests", "llmt_cli"), "robotics": ("robot_app_tests", "llmt_robot_cli")}
MEMORY = 6 << 30  # bytes that a test may take: a mutant may ask for any amount


def run(command, folder, seconds=None):
    """Output and errors of a command, whether it succeeded, and its seconds of the processor, at most `seconds`."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        # A mutant that waits takes no time of the processor.
        done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, preexec_fn=limit if seconds else None, errors="replace",
                              timeout=20 * seconds + 60 if seconds else None)
        text, succeeded = done.stdout, done.returncode == 0
    except subprocess.TimeoutExpired:
        text, succeeded = "", False
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return text, succeeded, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def needed(command, folder):
    text, succeeded, _ = run(command, folder)
    if not succeeded:
        sys.exit(f"{shlex.join(map(str, command))} failed:\n{text[-4000:]}")
    return text


class Build:
    """A build folder, and how a source of the libraries is compiled and a binary linked in it."""

    def __init__(self, folder, libraries):
        self.folder = folder
        binaries = [name for library in libraries for name in (*LIBRARY_TESTS[library], *PROGRAM_TESTS[library])]
        if "llmt" in libraries:
            binaries.append("bytes_witness")
        needed(["cmake", "--preset", "release", "-S", ROOT, "-B", folder], ROOT)
        needed(["ninja", *binaries], folder)
        self.compiles = {}
        for entry in json.loads((folder / "compile_commands.json").read_text()):
            file = pathlib.Path(entry["file"])
            sources = re.findall(r'#include "([^"]+)"', file.read_text()) if "/Unity/" in entry["file"] else [file]
            self.compiles |= {pathlib.Path(source): entry["command"] for source in sources}
        self.links = {name: needed(["ninja", "-t", "commands", name], folder).splitlines()[-1] for name in binaries}
        self.paths = {name: re.search(r" -o (\S+)", link).group(1) for name, link in self.links.items()}
        for program in set(binaries) & {"llmt_cli", "llmt_robot_cli"}:  # a run that was killed put it aside
            path, whole = self.program(program)
            if whole.is_file():
                whole.rename(path)

    def program(self, name):
        """Its path, and where it is while a mutant has its place."""
        path = self.folder / self.paths[name]
        return path, path.with_name(path.name + ".whole")

    def compile(self, source, text):
        """Whether the text compiles in the place of the source."""
        (self.folder / "mutant.cpp").write_text(text)
        command = re.sub(r" -o \S+ -c \S+$", " -o mutant.o -c mutant.cpp", self.compiles[source])
        return run(shlex.split(command), self.folder)[1]

    def link(self, name, path):
        """The binary at another path, with the functions of the mutant in the place of the library's."""
        command = self.links[name].split(" && ")[1]
        command = re.sub(r" -o \S+", f" -Wl,-z,muldefs mutant.o -o {path}", command, count=1)
        needed(shlex.split(command), self.folder)


class Stage:
    """Commands that fail where a mutant is noticed: binaries and their arguments."""

    def __init__(self, build, commands, program=None):
        self.build, self.commands, self.program = build, commands, program
        self.seconds = {}

    def prepare(self):
        for binary, arguments in self.commands:
            text, succeeded, self.seconds[binary] = run([self.build.folder / self.build.paths[binary], *arguments],
                                                        self.build.folder, seconds=3600)
            if not succeeded:
                sys.exit(f"{binary} fails without a mutant:\n{text[-4000:]}")
        print("without a mutant:", *(f"{binary} {time:.1f} s" for binary, time in self.seconds.items()), flush=True)

    def killer(self):
        """The test that fails with the mutant, or None."""
        if not self.seconds:
            self.prepare()
        if not self.program:
            return self.first_failure("mutant")
        # The tests know the program's path, so the mutant stands there for their time.
        path, whole = self.build.program(self.program)
        path.rename(whole)
        try:
            self.build.link(self.program, path)
            return self.first_failure(None)
        finally:
            whole.rename(path)

    def first_failure(self, mutant):
        for binary, arguments in self.commands:
            if mutant:
                self.build.link(binary, mutant)
            text, succeeded, _ = run([self.build.folder / (mutant or self.build.paths[binary]), *arguments],
                                     self.build.folder, seconds=5 * self.seconds[binary] + 5)
            if not succeeded:
                failed = re.findall(r"\[  FAILED  \] ([\w/]+\.[\w/]+)", text)
                return failed[0] if failed else f"{binary}: {' '.join(text[-80:].split()) or 'no end'}"
        return None


def suites(folder):
    names = {name for path in sorted(folder.rglob("*.cpp"))
             for name in re.findall(r"^TEST(?:_F|_P)?\((\w+),", path.read_text(), re.M)}
    return ":".join(f"*{name}.*" for name in sorted(names))


def stages(build, room):
    library = room.parts[0]
    of_room = suites(ROOT / "tests" / library / room.relative_to(f"{library}/src"))

    def tests(binaries, selected, program=None):
        arguments = [f"--gtest_filter={selected}", "--gtest_fail_fast"]
        has_some = [binary for binary in binaries if "\n  " in
                    needed([build.folder / build.paths[binary], *arguments, "--gtest_list_tests"], build.folder)]
        return Stage(build, [(binary, arguments) for binary in has_some], program)

    found = [tests(LIBRARY_TESTS[library], of_room)] if of_room else []
    if library == "llmt":
        manifest = ROOT / "tests/bytes/manifest.txt"
        found.append(Stage(build, [("bytes_witness", ["check", manifest, build.folder / "bytes_of_mutant", *BYTES])]))
    program_tests, program = PROGRAM_TESTS[library]
    return [*found, tests(LIBRARY_TESTS[library], "*-" + of_room), tests([program_tests], "*", program)]


def mutants(room, seed):
    """All mutants of a room, in the order in which they are tried."""
    sources = sorted((ROOT / room).glob("*.cpp"))
    found = [(path, mutation) for path in sources for mutation in mutations(path.read_text())]
    random.Random(seed).shuffle(found)
    return list(enumerate(found, 1))


def described(number, path, mutation):
    place = f"{path.relative_to(ROOT)}:{mutation.line}"
    return f"{number:4} {place} {mutation.kind}: {' '.join(mutation.before.split())} -> {mutation.after}"


def measure(build, room, chosen, count, most_stages):
    killed, total = collections.Counter(), collections.Counter()
    lived = []
    tests = stages(build, room)[:most_stages]
    for number, (path, mutation) in chosen:
        if total.total() == count:
            break
        text = path.read_text()
        start = time.monotonic()
        if not build.compile(path, mutation.applied(text)):
            continue
        total[mutation.kind] += 1
        killer = next((name for name in (stage.killer() for stage in tests) if name), None)
        killed[mutation.kind] += killer is not None
        said = described(number, path, mutation)
        print(f"{said}  {'killed by ' + killer if killer else 'LIVES'} ({time.monotonic() - start:.0f} s)", flush=True)
        if not killer:
            lived.append(f"{said}\n       {text.splitlines()[mutation.line - 1].strip()}")
    print(f"\n{room}: {killed.total()} of {total.total()} killed")
    for kind in sorted(total):
        print(f"  {kind:12} {killed[kind]} of {total[kind]}")
    print(*lived, sep="\n", end="\n\n", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="+", type=pathlib.Path, metavar="ROOM", help="llmt/src/NAME, robotics/src/NAME")
    parser.add_argument("--count", type=int, default=30, help="mutants of each room that compile (30)")
    parser.add_argument("--seed", type=int, default=20261127)
    parser.add_argument("--only", default="", metavar="N,N", help="the mutants with these numbers")
    parser.add_argument("--stages", type=int, metavar="N", help="the first stages of tests alone")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/mutants", help="folder (build/mutants)")
    parser.add_argument("--list", action="store_true")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # not before a program is back in its place
    only = {int(number) for number in given.only.split(",") if number}
    chosen = {room: [one for one in mutants(room, given.seed) if not only or one[0] in only] for room in given.rooms}
    if given.list:
        for number, (path, mutation) in (one for room in given.rooms for one in chosen[room][:given.count]):
            print(described(number, path, mutation))
        return
    build = Build(given.build.resolve(), sorted({room.parts[0] for room in given.rooms}))
    for room in given.rooms:
        measure(build, room, chosen[room], given.count, given.stages)


if __name__ == "__main__":
    main()
