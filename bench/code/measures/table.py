"""The table of figures: what every room was measured to have, and what a rise is for."""

import re

HEAD = """# What every room has

`python3 bench/code/measure_code.py` counts and says what each measure is. The test `measures` fails where a figure is
not the one in this table. After a change, `python3 bench/code/measure_code.py --renew` writes the figures. Where one
is above the smallest that the room has had, it writes `?`: replace it by what the rise is for and, for a threshold, by
what happens without it. What has no line is 0.

| room | measure | figure | smallest | what the rise is for |
| --- | --- | --- | --- | --- |
"""
_LINE = re.compile(r"^\| (\S+) \| (\S+) \| (\d+) \| (\d+) \|(.*)\|$", re.M)


def read(text):
    """(room, measure) -> (figure, smallest figure, remark)."""
    return {(room, measure): (int(figure), int(smallest), remark.strip())
            for room, measure, figure, smallest, remark in _LINE.findall(text)}


def written(lines):
    rows = [f"| {room} | {measure} | {figure} | {smallest} | {remark} |".replace("|  |", "| |")
            for (room, measure), (figure, smallest, remark) in sorted(lines.items())]
    return HEAD + "\n".join(rows) + "\n"


def renewed(recorded, measured):
    """Lines with the measured figures. A remark stays while the figure is above the smallest; a new rise asks for one.
    A table without lines takes all figures as they are."""
    lines = {}
    for key, figure in measured.items():
        before, smallest, remark = recorded.get(key, (0, 0, "") if recorded else (figure, figure, ""))
        smallest = min(smallest, figure)
        asked = remark if figure <= before else f"{remark} ?".strip()
        lines[key] = (figure, smallest, asked if figure > smallest else "")
    return lines


def objections(recorded, measured):
    """What keeps the table from being that of the sources, in words."""
    found = []
    for key in sorted(recorded.keys() | measured.keys()):
        room, measure = key
        before, smallest, remark = recorded.get(key, (0, 0, ""))
        now = measured.get(key, 0)
        if now > before:
            found.append(f"{room}: {measure} rose from {before} to {now}. Its line must have the new figure and say "
                         "what it is for and, for a threshold, what happens without it")
        elif now < before:
            found.append(f"{room}: {measure} fell from {before} to {now}. Lower the figure")
        elif now > smallest and (not remark or "?" in remark.split()):
            found.append(f"{room}: {measure} rose from {smallest} to {now}, and its line does not say what for")
    return found
