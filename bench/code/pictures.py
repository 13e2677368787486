#!/usr/bin/env python3
"""Draws the pictures of CONTRIBUTING.md from its tables: docs/pictures/{rooms_of_llmt, ...}.svg.

    python3 bench/code/pictures.py [--check] [--page FILE] [CHECKOUT]

The rooms of a library are drawn from the table that the test `include_rules` reads, the ways of a row and of a pose from
their tables. Stages of a way name functions and files: the files must exist and lie in rooms, and one of them must define
each function. `--check` changes nothing and fails where a picture is not the one that the tables make.
"""

import argparse
import html
import pathlib
import re
import sys

LIBRARIES = {"rooms_of_llmt": "llmt/src", "rooms_of_robotics": "robotics/src"}
WAYS = {"way_of_a_row": ("A sample's way", "llmt/src"), "way_of_a_pose": ("A pose's way", "robotics/src")}

# Sizes in pixels.
FONT = 13
LETTER = 7.2  # width of an average letter
MARGIN = 14
BOX_HEIGHT = 26
FLOOR_HEIGHT = 66
STAGE_HEIGHT = 44
STAGE_GAP = 18


class Fault(Exception):
    pass


# --- what the page says ---------------------------------------------------------------------------------------------


def rooms_of(page, library):
    """Of every room the rooms that it may include, in the order of the table."""
    block = re.search(rf"^{library}\n((?:  \S.*\n)+)", page, re.M)
    if not block:
        raise Fault(f"there is no table of rooms of {library}")
    rooms = {}
    for line in block.group(1).splitlines():
        room, _, below = line.split("|")[0].partition("<-")
        rooms[room.strip()] = below.split()
    return rooms


def stages_of(page, title):
    """The table of a way: stage, functions and files of each row."""
    section = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", page, re.M | re.S)
    lines = [line for line in section.group(1).splitlines() if line.startswith("|")] if section else []
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    if not rows or rows[0][:3] != ["stage", "functions", "files"]:
        raise Fault(f"there is no table of stages, functions and files below \"{title}\"")
    return [(row[0], re.findall(r"`([\w:]+)\(\)`", row[1]), re.findall(r"`([\w./]+)`", row[2])) for row in rows[2:]]


def place_of(root, rooms, shelf, name):
    """Path of a file or folder of a way, and the place where it lies in a reader's words."""
    for folder in ("", "llmt", shelf):
        path = root / folder / name
        if not path.exists():
            continue
        place = (path if path.is_dir() else path.parent).relative_to(root).as_posix()
        for library, known in rooms.items():
            if not place.startswith(library + "/"):
                continue
            room = place[len(library) + 1:]
            if room not in known:
                raise Fault(f"{name} lies in no room")
            return path, room if library == shelf else place
        return path, place
    raise Fault(f"there is no file {name}")


def defines(path, function):
    files = [path] if path.is_file() else sorted(path.glob("*.cpp"))
    pattern = rf"^(?:[^\s/#}}][^;=]*\s[&*]?)?{re.escape(function)}\([^;]*$"
    return any(re.search(pattern, file.read_text(), re.M) for file in files)


def way_of(page, root, title, shelf):
    """Stage, functions and places of each row of a way."""
    rooms = {library: rooms_of(page, library) for library in LIBRARIES.values()}
    way = []
    for stage, functions, files in stages_of(page, title):
        places = [place_of(root, rooms, shelf, file) for file in files]
        for function in functions:
            if not any(defines(path, function) for path, _ in places):
                raise Fault(f"\"{title}\", {stage}: none of its files defines {function}()")
        way.append((stage, [function + "()" for function in functions], list(dict.fromkeys(p for _, p in places))))
    return way


# --- drawing --------------------------------------------------------------------------------------------------------


def text(x, y, words, style=""):
    return f'<text x="{x:.0f}" y="{y:.0f}" {style}>{html.escape(words)}</text>'


def box(x, y, width, height):
    return f'<rect x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height}" rx="5" class="box"/>'


def svg(title, width, height, parts):
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" font-family="sans-serif" '
        f'font-size="{FONT}">', f"<title>{html.escape(title)}</title>",
        "<style>.box{fill:#eef3fb;stroke:#5b7db1}.line{fill:none;stroke:#8a99ad}.pale{fill:#667}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#8a99ad"/></marker></defs>',
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>', *parts, "</svg>", ""])


def draw_rooms(rooms, library):
    """Rooms on floors, the lowest at the bottom. Arrows that follow from others are left out."""
    reached, floor = {}, {}
    for room, below in rooms.items():
        reached[room] = set(below).union(*(reached[other] for other in below))
        floor[room] = 1 + max((floor[other] for other in below), default=0)
    needed = {room: [other for other in below if not any(other in reached[another] for another in below)]
              for room, below in rooms.items()}
    widths = {room: LETTER * len(room) + 18 for room in rooms}
    floors = {number: [room for room in rooms if floor[room] == number] for number in sorted(set(floor.values()))}
    whole = max(sum(widths[room] + MARGIN for room in group) for group in floors.values()) + 2 * MARGIN
    top = len(floors)
    middle, parts, boxes = {}, [], []
    for number, group in floors.items():
        group.sort(key=lambda room: sum(middle[other] for other in needed[room]) / max(1, len(needed[room])))
        gap = (whole - sum(widths[room] for room in group)) / (len(group) + 1)
        x, y = 2 * MARGIN + gap, MARGIN + FLOOR_HEIGHT * (top - number)
        boxes.append(text(MARGIN, y + 18, str(number), 'class="pale"'))
        for room in group:
            middle[room] = x + widths[room] / 2
            boxes += [box(x, y, widths[room], BOX_HEIGHT), text(middle[room], y + 18, room, 'text-anchor="middle"')]
            x += widths[room] + gap
    for room, others in needed.items():
        for other in others:
            low = MARGIN + FLOOR_HEIGHT * (top - floor[other])
            high = MARGIN + FLOOR_HEIGHT * (top - floor[room]) + BOX_HEIGHT
            bend = (low - high) / 2
            parts.append(f'<path class="line" marker-end="url(#tip)" d="M{middle[other]:.0f} {low} C{middle[other]:.0f} '
                         f'{low - bend:.0f} {middle[room]:.0f} {high + bend:.0f} {middle[room]:.0f} {high}"/>')
    height = MARGIN + FLOOR_HEIGHT * (top - 1) + BOX_HEIGHT + MARGIN
    return svg(f"Rooms of {library}", whole + 2 * MARGIN, height, parts + boxes)


def draw_way(way, title):
    """Stages from top to bottom, with the places to the right. Stages that begin with a dash are repeated."""
    inner = max(LETTER * len(", ".join(functions)) for _, functions, _ in way) + 24
    outer = max(LETTER * len(", ".join(places)) for _, _, places in way)
    left = 4 * MARGIN
    step = STAGE_HEIGHT + STAGE_GAP
    parts, repeated = [], []
    for number, (stage, functions, places) in enumerate(way):
        y = MARGIN + number * step
        if number > 0:
            x = left + inner / 2
            parts.append(f'<path class="line" marker-end="url(#tip)" d="M{x:.0f} {y - STAGE_GAP} V{y}"/>')
        parts += [box(left, y, inner, STAGE_HEIGHT),
                  text(left + 12, y + 18, stage.lstrip("– "), 'font-weight="bold"'),
                  text(left + 12, y + 35, ", ".join(functions)),
                  text(left + inner + MARGIN, y + 27, ", ".join(places), 'class="pale"')]
        if stage.startswith("–"):
            repeated.append(y + STAGE_HEIGHT // 2)
    if repeated:
        parts.append(f'<path class="line" marker-end="url(#tip)" d="M{left} {repeated[-1]} H{2 * MARGIN} '
                     f'V{repeated[0]} H{left}"/>')
    return svg(title, left + inner + outer + 2 * MARGIN, MARGIN + len(way) * step, parts)


def pictures(page, root):
    return {**{name: draw_rooms(rooms_of(page, library), library) for name, library in LIBRARIES.items()},
            **{name: draw_way(way_of(page, root, title, shelf), title) for name, (title, shelf) in WAYS.items()}}


def main():
    parser = argparse.ArgumentParser(description="Draws the pictures of CONTRIBUTING.md.")
    parser.add_argument("checkout", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="change nothing; fail if a picture is out of date")
    parser.add_argument("--page", type=pathlib.Path, help="the page, if it is not CHECKOUT/CONTRIBUTING.md")
    arguments = parser.parse_args()
    page = arguments.page or arguments.checkout / "CONTRIBUTING.md"
    try:
        drawn = pictures(page.read_text(), arguments.checkout)
    except Fault as fault:
        sys.exit(f"{page}: {fault}")
    for name, picture in drawn.items():
        path = arguments.checkout / "docs/pictures" / f"{name}.svg"
        if path.is_file() and path.read_text() == picture:
            continue
        if arguments.check:
            sys.exit(f"{path} is not what the tables make; python3 bench/code/pictures.py draws it anew")
        path.write_text(picture)


main()
