#!/usr/bin/env python3
"""Measures of the source code: sizes, circles, options, and ideas that should stand once, for every room.

    python3 bench/code/measure_code.py [CHECKOUT]            prints them
    python3 bench/code/measure_code.py --places MEASURE      and where a measure was counted
    python3 bench/code/measure_code.py --check [CHECKOUT]    fails where a figure is not that of the table
    python3 bench/code/measure_code.py --renew [CHECKOUT]    writes the figures into the table and keeps its remarks

The table is tests/measures/table.md. A room is a folder of sources. All is found by patterns in the text: a
figure is a lower bound, which notices changes. Functions are found by Universal Ctags (Debian:
universal-ctags); without it their measures are left out.
"""

import argparse
import collections
import pathlib
import re
import sys

from measures import circles, ideas, options, sizes, table, thresholds
from measures.sources import LIBRARIES, Checkout


def circle_places(checkout):
    """A place for each circle, at its first module."""
    found = circles.strongly_connected(circles.cpp_modules(checkout))
    places = [checkout.root / (circle[0] + ".cpp") for circle in found]
    for circle in circles.strongly_connected(circles.python_modules(checkout)):
        path = checkout.root / "apps/python" / circle[0].replace(".", "/")
        places.append(path / "__init__.py" if path.is_dir() else path.with_suffix(".py"))
    return [(place, 1) for place in places]


MEASURES = {
    "answers": ("assignments of an answer, a verdict or an outcome", lambda of: ideas.answers(of, ideas.ANSWERS)),
    "confirmed": ("assignments of `confirmed`", lambda of: ideas.answers(of, ("confirmed",))),
    "preparations": ("files that make rows ready by themselves", ideas.preparations),
    "option-lists": ("lists of the options of a fit by hand", options.lists),
    "thresholds": ("named numbers, and numbers in conditions but 0, 1/2, 1 and 2", thresholds.thresholds),
    "sizes": ("conditions that set a number of rows or inputs against 10 or more", thresholds.by_size),
    "circles": ("circles of modules", circle_places),
}


def measured(checkout):
    """(room, measure) -> figure, where that is not 0."""
    return dict(collections.Counter((checkout.room(path), name)
                                    for name, (_, count) in MEASURES.items() for path, _ in count(checkout)))


def lines_with(checkout, files, pattern):
    found = []
    for path in files:
        for number, line in enumerate(checkout.text(path).splitlines(), 1):
            if re.search(pattern, line.split("//")[0]):
                found.append(f"{checkout.name(path)}:{number}")
    return found


def say(name, value):
    print(f"{name:66} {value}")


def report(checkout, shown):
    library = checkout.files(*LIBRARIES)
    say("library: files / lines / p90 / longest file", sizes.files(checkout, library))
    for folder in ("llmt", "robotics", "apps", "tests"):
        say(f"  {folder}", sizes.files(checkout, checkout.files(folder)))
    say("  apps, Python", sizes.files(checkout, checkout.python()))
    lengths = sizes.functions(library)
    if lengths:
        say("library: functions / p90 / longest / above 60 lines",
            f"{len(lengths)} / {sizes.percentile(lengths, 0.9)} / {max(lengths)} / {sum(n > 60 for n in lengths)}")
    for room, files in collections.Counter(map(checkout.room, library)).most_common(4):
        say(f"files in {room}", files)
    for language, modules in (("C++", circles.cpp_modules(checkout)), ("Python", circles.python_modules(checkout))):
        found = circles.strongly_connected(modules)
        say(f"{language}: modules / circles / modules of the largest circle",
            f"{len(modules)} / {len(found)} / {max(map(len, found), default=0)}")
        for circle in found:
            print("   circle: " + " ".join(circle))
    say("leaf fields of FitOptions", options.leaves(checkout))
    catalogue = checkout.root / "robotics/catalogue.yaml"
    entries = checkout.text(catalogue) if catalogue.is_file() else ""
    effects = sorted(set(re.findall(r"(?m)^  - type: ([a-z_0-9]+)", entries)))
    outside = [path for path in checkout.files("robotics/src", "robotics/include", "apps")
               if "robotics/src/effects/" not in path.as_posix()]
    named = lines_with(checkout, outside, r'"(' + "|".join(effects) + r')"') if effects else []
    say("lines outside of effects/ that ask for an effect by name", f"{len(named)} {' '.join(named)}")
    mixers = lines_with(checkout, checkout.files("llmt/src"), r"(?i)0xbf58476d1ce4e5b9")
    say("hash mixers in llmt/src", f"{len(mixers)} {' '.join(mixers)}")
    for name, (words, count) in MEASURES.items():
        places = count(checkout)
        say(f"{name}: {words}", len(places))
        for room, figure in collections.Counter(checkout.room(path) for path, _ in places).most_common():
            print(f"   {figure:4} {room}")
        for path, line in places if name == shown else ():
            print(f"   {checkout.name(path)}:{line}")


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", nargs="?", default=".")
    parser.add_argument("--places", choices=MEASURES)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--renew", action="store_true")
    parser.add_argument("--table", type=pathlib.Path, help="another table")
    given = parser.parse_args(arguments)
    checkout = Checkout(given.checkout)
    if not (given.check or given.renew):
        report(checkout, given.places)
        return 0
    path = given.table or checkout.root / "tests/measures/table.md"
    recorded = table.read(path.read_text()) if path.is_file() else {}
    figures = measured(checkout)
    if given.renew:
        recorded = table.renewed(recorded, figures)
        path.write_text(table.written(recorded))
    objections = table.objections(recorded, figures)
    for objection in objections:
        print(objection, file=sys.stderr)
    if objections:
        print("python3 bench/code/measure_code.py --renew writes the figures; --places MEASURE says where they are.",
              file=sys.stderr)
    return 1 if objections else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except BrokenPipeError:  # `| head`
        sys.exit(0)
