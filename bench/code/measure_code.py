#!/usr/bin/env python3
"""Measures of the source code, one line each: sizes, circles of includes, options, and ideas that should stand once.

    python3 bench/code/measure_code.py [CHECKOUT]

Functions are found by Universal Ctags (Debian: universal-ctags); without it their measures are left out. A module is a
header with the source of the same path; a public header llmt/NAME.hpp is one module with the source NAME.cpp whose first
include it is. A circle is a strongly connected component of modules under inclusion.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys

root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
libraries = ["llmt", "robotics"]
if (root / "expressions").is_dir():
    libraries.append("expressions")


def sources(*folders):
    found = []
    for folder in folders:
        for pattern in ("*.cpp", "*.hpp"):
            found += [p for p in (root / folder).rglob(pattern) if "build" not in p.relative_to(root).parts]
    return sorted(found)


def text_of(path):
    return path.read_text(errors="replace")


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0


def say(name, value):
    print(f"{name:58} {value}")


def measure_sizes(name, files):
    lines = [text_of(f).count("\n") for f in files]
    say(f"{name}: files / lines / p90 / longest file",
        f"{len(files)} / {sum(lines)} / {percentile(lines, 0.9)} / {max(lines, default=0)}")


def functions_of(files):
    if shutil.which("ctags") is None or not files:
        return None
    out = subprocess.run(["ctags", "--output-format=json", "--fields=+ne", "--kinds-C++=f", "-f", "-", *map(str, files)],
                         capture_output=True, text=True, check=True).stdout
    tags = [json.loads(line) for line in out.splitlines()]
    return [t["end"] - t["line"] + 1 for t in tags if t.get("kind") == "function" and "end" in t]


# The module of a source or header: its path without folders of headers and without the ending.
def module_of(path, public):
    relative = path.relative_to(root)
    name = relative.with_suffix("").as_posix()
    match = re.fullmatch(r"(llmt|robotics)/include/llmt/(.*)", name)
    return public.get(name, name) if match else name


def circles():
    files = sources(*libraries)
    by_stem = {}
    for f in files:
        if f.suffix == ".cpp":
            by_stem.setdefault((f.relative_to(root).parts[0], f.stem), []).append(f)
    public = {}
    for f in files:
        name = f.relative_to(root).with_suffix("").as_posix()
        if "/include/llmt/" in name:
            include = f.relative_to(root / name.split("/")[0] / "include").as_posix()
            same = [s for s in by_stem.get((f.relative_to(root).parts[0], f.stem), [])
                    if re.search(r'#include "([^"]+)"', text_of(s)) and
                    re.search(r'#include "([^"]+)"', text_of(s)).group(1) == include]
            if len(same) == 1:
                public[name] = same[0].relative_to(root).with_suffix("").as_posix()
    edges = {}
    for f in files:
        here = module_of(f, public)
        reached = edges.setdefault(here, set())
        for include in re.findall(r'^\s*#\s*include\s*"([^"]+)"', text_of(f), re.M):
            library = f.relative_to(root).parts[0]
            for folder in (f"{library}/src", f"{library}/include", "llmt/include", "robotics/include", "expressions/include",
                           "llmt"):
                target = root / folder / include
                if target.is_file():
                    reached.add(module_of(target, public))
                    break
        reached.discard(here)
    # Tarjan (1972), without recursion.
    index, low, stack, on_stack, found = {}, {}, [], set(), []
    for start in edges:
        if start in index:
            continue
        work = [(start, iter(sorted(edges[start])))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, children = work[-1]
            for child in children:
                if child not in edges:
                    continue
                if child not in index:
                    index[child] = low[child] = len(index)
                    stack.append(child)
                    on_stack.add(child)
                    work.append((child, iter(sorted(edges[child]))))
                    break
                if child in on_stack:
                    low[node] = min(low[node], index[child])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    component = []
                    while True:
                        last = stack.pop()
                        on_stack.discard(last)
                        component.append(last)
                        if last == node:
                            break
                    if len(component) > 1:
                        found.append(sorted(component))
    return len(edges), sorted(found, key=len, reverse=True)


# Names and types of the data members of a struct.
def fields_of(struct, header_text):
    match = re.search(r"struct " + struct + r" \{(.*?)\n\};", header_text, re.S)
    if not match:
        return []
    body = re.sub(r"//[^\n]*", "", match.group(1))
    body = re.sub(r"\([^()]*\)", "", body)
    return re.findall(r"([\w:<>]+(?:<[^;]*?>)?)\s+(\w+)(?:\s*=[^;]*|\{[^;]*\})?;", body)


def leaf_options(struct, headers):
    count = 0
    for kind, _ in fields_of(struct, headers):
        count += leaf_options(kind, headers) if kind.endswith("Options") else 1
    return count


def lines_with(files, pattern, ignore=None):
    found = []
    for f in files:
        for number, line in enumerate(text_of(f).splitlines(), 1):
            code = line.split("//")[0]
            if re.search(pattern, code) and not (ignore and re.search(ignore, code)):
                found.append(f"{f.relative_to(root)}:{number}")
    return found


def main():
    library = sources(*libraries)
    measure_sizes("library", library)
    measure_sizes("  llmt", sources("llmt"))
    measure_sizes("  robotics", sources("robotics"))
    measure_sizes("apps", sources("apps"))
    measure_sizes("tests", sources("tests"))
    lengths = functions_of(library)
    if lengths is not None:
        say("library: functions / p90 / longest / above 60 lines",
            f"{len(lengths)} / {percentile(lengths, 0.9)} / {max(lengths)} / {sum(n > 60 for n in lengths)}")
    folders = {}
    for f in library:
        folders.setdefault(f.parent.relative_to(root).as_posix(), []).append(f)
    for name, files in sorted(folders.items(), key=lambda item: -len(item[1]))[:4]:
        say(f"files in {name}", len(files))
    modules, found = circles()
    say("modules / circles / modules of the largest circle",
        f"{modules} / {len(found)} / {max(map(len, found), default=0)}")
    for circle in found:
        print("   circle: " + " ".join(circle))
    headers = "\n".join(text_of(f) for f in sources("llmt/include"))
    say("leaf fields of FitOptions", leaf_options("FitOptions", headers))
    catalogue = root / "robotics/catalogue.yaml"
    effects = sorted(set(re.findall(r"(?m)^  - type: ([a-z_0-9]+)", text_of(catalogue)))) if catalogue.is_file() else []
    outside = [f for f in sources("robotics/src", "robotics/include", "apps")
               if "robotics/src/effects/" not in f.as_posix()]
    if effects:
        named = lines_with(outside, r'"(' + "|".join(effects) + r')"')
        say("lines outside of effects/ that ask for an effect by name", len(named))
        for place in named:
            print("   " + place)
    written = lines_with(sources("robotics/src"), r"(\.|->)answer\s*=[^=]")
    say("lines that write Discovery::answer", f"{len(written)} {' '.join(written)}")
    mixers = lines_with(sources("llmt/src"), r"(?i)0xbf58476d1ce4e5b9", None)
    say("hash mixers in llmt/src", f"{len(mixers)} {' '.join(mixers)}")


main()
