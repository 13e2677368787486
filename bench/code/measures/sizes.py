"""Sizes of files and functions."""

import json
import shutil
import subprocess


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0


def files(checkout, paths):
    lines = [checkout.text(path).count("\n") for path in paths]
    return f"{len(paths)} / {sum(lines)} / {percentile(lines, 0.9)} / {max(lines, default=0)}"


def functions(paths):
    """Lines of every function, by Universal Ctags; nothing where that is not installed."""
    if shutil.which("ctags") is None or not paths:
        return []
    command = ["ctags", "--output-format=json", "--fields=+ne", "--kinds-C++=f", "-f", "-", *map(str, paths)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    tags = [json.loads(line) for line in out.splitlines()]
    return [tag["end"] - tag["line"] + 1 for tag in tags if tag.get("kind") == "function" and "end" in tag]
