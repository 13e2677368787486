#!/usr/bin/env python3
"""docs/options.md, made from what the programs say of themselves by --man and --help-all.

    python3 docs/option_tables.py build/release/bin            writes the page
    python3 docs/option_tables.py --check build/release/bin    fails where the page says something else
"""

import argparse
import collections
import difflib
import pathlib
import re
import subprocess
import sys
import textwrap

HEAD = """# Options

Made by `python3 docs/option_tables.py build/release/bin` from the programs; do not edit. [Commands](commands.md) says
what they do, and what they print. Where an option has several defaults, the first one that applies counts. `--help`,
`--help-all`, and `--json` of most commands are as [there](commands.md).
"""
GENERAL = {"--help", "--help-all", "--version", "--json"}
SHARED_BY = 4  # commands that have an option in the same words: a table of its own
LIKE = {"llmt compare": "llmt fit"}  # whose options are not said again
WIDE = 60  # a longer default has a line for each of its cases
CHOICE = re.compile(r"^(?:TEXT:\{)?([\w-]+(?:[|,][\w-]+)+)(?:\}|,\.\.\.)?$")  # "auto|exact", "TEXT:{auto,exact}"
DEFAULT = re.compile(r" \[([^\]]*)\](?=;|$)| \(default: ([^)]*)\)$| \((required)\)$")


class Option(collections.namedtuple("Option", "names value text default")):
    def row(self):
        choice = CHOICE.search(self.value)
        words = re.split("[|,]", choice.group(1)) if choice else []
        value = "" if words else self.value if self.value.startswith("[") else f" {self.value}".rstrip()
        names = ", ".join(f"`{name}`" for name in self.names[:-1] + (self.names[-1] + value,))
        text = self.text
        marked = [rf"(?<![\w-]){word}(?![\w-])" for word in words]
        if all(re.search(word, text) for word in marked):
            text = re.sub("|".join(marked), r"`\g<0>`", text) if marked else text
        else:
            text += f" ({', '.join(f'`{word}`' for word in words)})"
        default = self.default.replace("; ", "<br>") if len(self.default) > WIDE else self.default
        return f"| {names} | {in_cell(text)} | {in_cell(default)} |".replace("|  |", "| |")


def in_cell(text):
    return re.sub(r"(?<![`\w-])(--?[a-z][a-z-]*(?:=[\w.-]+)?)(?!\w)", r"`\1`", text).replace("|", r"\|")


def plain(roff):
    return roff.replace(r"\-", "-").replace(r"\&", "").replace(r"\e", "\\")


def option_of(name, text):
    text = text.replace(", see docs/commands.md", "")
    names, value = re.fullmatch(r"([^ [{]*)[ ]?(.*)", name).groups()
    default = ""
    if found := DEFAULT.search(text):
        default = next(filter(None, found.groups()))
        text = text[:found.start()] + text[found.end():]
    return Option(tuple(names.split(",")), value, text, default)


Command = collections.namedtuple("Command", "about options experts")


def commands_of(program):
    """Name of the command -> what it does, its options, and the names of those that are for experts."""
    manual = subprocess.run([program, "--man"], capture_output=True, text=True, check=True).stdout
    commands = {}
    for part in manual.split("\n.SH COMMANDS\n")[1].split("\n.SH ")[0].split(".SS ")[1:]:
        name, about = map(plain, part.split("\n")[:2])
        words = [program, *name.split()[1:], "--help-all"]
        whole = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        experts = re.findall(r"^  (?:-\w,)?(--[\w-]+)", whole.partition("\nOptions for experts:")[2], re.M)
        options = [option_of(plain(entry), plain(text)) for entry, text in re.findall(r"\.TP\n\.B (\\-.*)\n(.*)", part)]
        commands[name] = Command(about, [option for option in options if option.names[-1] not in GENERAL], experts)
    return commands


def table(options, *more):
    head = " | ".join(("option", "meaning", "default", *more))
    return f"| {head} |\n|{' --- |' * (3 + len(more))}\n" + "".join(f"{row}\n" for row in options)


def page(programs):
    commands = {name: command for program in programs for name, command in commands_of(program).items()}
    every = [option for command in commands.values() for option in command.options]
    named = collections.Counter(option.names for option in every)
    shared = [option for option, count in collections.Counter(every).items()
              if count >= max(SHARED_BY, named[option.names] / 2)]

    def having(option):
        names = [name.split() for name, command in commands.items() if option in command.options]
        of = {program: ", ".join(name for owner, name in names if owner == program) for program, _ in names}
        return "; ".join(f"`{program}`: {words}" for program, words in of.items())

    text = HEAD + "\n## Of several commands\n\n" + table([f"{option.row()} {having(option)} |" for option in shared],
                                                         "commands")
    for name, (about, options, experts) in commands.items():
        known = commands[LIKE[name]].options if name in LIKE else []
        own = [option for option in options if option not in shared and option not in known]
        text += f"\n## {name}\n\n{in_cell(about).replace('?.', '?')}\n"
        usual = [option.row() for option in own if option.names[-1] not in experts]
        rare = [option.row() for option in own if option.names[-1] in experts]
        text += "\n" + table(usual) if usual else ""
        text += "\nFor experts:\n\n" + table(rare) if rare else ""
        if known:
            same = ", ".join(f"`{option.names[-1]}`" for option in options if option in known and option not in shared)
            text += "\n" + textwrap.fill(f"As those of `{LIKE[name]}`: {same}.", 120, break_on_hyphens=False) + "\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="of the programs")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--page", type=pathlib.Path, default=pathlib.Path(__file__).parent / "options.md")
    given = parser.parse_args()
    text = page([given.folder / "llmt", given.folder / "llmt-robot"])
    if not given.check:
        given.page.write_text(text)
        return
    there = given.page.read_text()
    if there != text:
        lines = difflib.unified_diff(there.splitlines(True), text.splitlines(True), "docs/options.md", "programs", n=0)
        sys.stdout.writelines(lines)
        sys.exit("docs/options.md is not what the programs say: python3 docs/option_tables.py FOLDER writes it")


if __name__ == "__main__":
    main()
