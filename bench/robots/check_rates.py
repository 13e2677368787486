"""How often `llmt-robot check` gives which verdict, over many draws of an arm whose truth is known.

    python3 bench/robots/check_rates.py --program build/release/bin/llmt-robot --robot robotics/robots/tx200_like.yaml
    python3 bench/robots/check_rates.py --program build/release/bin/llmt-robot --robot robotics/robots/ur10.yaml \
        --measured ur10_b.csv

Without a file each draw simulates a calibration of 120 poses and a check of 20 others, with the instrument set up anew:
nothing changed; gross errors in the file of the calibration or in that of the check; each joint but the first knocked
by 0.01 to 0.05 degrees; and an arm that bends although its description does not, checked in a small part of its
workspace. A knock of the first joint is the same as another base. With a measured file of one arm each draw calibrates to 200 of
its rows and checks with 60 others: spread over the file, or one after the other as they stand there.
"""

import argparse
import csv
import json
import random
import subprocess
import tempfile
from collections import Counter
from pathlib import Path

SHORT = {"still good": "good", "moved, within limits": "moved", "no longer good": "bad"}


def run(*words):
    """Standard output; the exit code of `check` is part of its answer."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode not in (0, 1, 3):
        raise SystemExit(done.stderr)
    return done.stdout


def read(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return header, rows


def write(path, header, rows):
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([header, *rows])


def spoilt(path, rows, sizes, seed):
    """Moves the readings of some rows, chosen by the seed, in x and y."""
    header, table = read(path)
    lines = random.Random(seed).sample(range(len(table)), rows)
    x, y = header.index("x_mm"), header.index("y_mm")
    for line, size in zip(lines, sizes):
        table[line][x] = str(float(table[line][x]) + 0.6 * size)
        table[line][y] = str(float(table[line][y]) - 0.8 * size)
    write(path, header, table)
    return {line + 2 for line in lines}


class Judge:
    def __init__(self, program, folder):
        self.program = program
        self.folder = Path(folder)

    def simulate(self, description, poses, seed, name, noise_um=20):
        arm = self.folder / f"{name}.yaml"
        arm.write_text(json.dumps(description))  # JSON is YAML
        out = self.folder / f"{name}.csv"
        run(self.program, "simulate", arm, "--poses", poses, "--noise-um", noise_um, "--seed", seed, "-o", out)
        return out

    def calibrate(self, arm, measured):
        out = self.folder / "calibrated.yaml"
        out.unlink(missing_ok=True)
        run(self.program, "calibrate", arm, measured, "-o", out)
        return out

    def check(self, calibrated, measured):
        answer = json.loads(run(self.program, "check", calibrated, measured, "--json"))
        return answer, SHORT[answer["verdict"]]


def simulated(judge, description, draws):
    arm = judge.folder / "described.yaml"
    arm.write_text(json.dumps(description))
    elsewhere = json.loads(json.dumps(description))
    elsewhere["base"] = {"xyz_mm": [700, -300, 100], "rpy_deg": [3, -2, 80]}
    bending = json.loads(json.dumps(description))
    bending["effects"] = [
        {"type": "joint_compliance", "at": description["joints"][j]["name"], "compliance_rad_per_Nm": 2e-7}
        for j in (1, 2)
    ]
    scenes = {name: Counter() for name in ("nothing", "old gross", "new gross", "bends, corner")}
    named = Counter()
    knocks = [(j, by) for j in range(1, len(description["joints"])) for by in (0.01, 0.02, 0.03, 0.05)]
    scenes |= {f"{description['joints'][j]['name']} {by} deg": Counter() for j, by in knocks}
    for draw in range(1, draws + 1):
        measured = judge.simulate(description, 120, draw, "old")
        calibrated = judge.calibrate(arm, measured)
        today = judge.simulate(elsewhere, 20, 10000 + draw, "new")
        scenes["nothing"][judge.check(calibrated, today)[1]] += 1
        for j, by in knocks:
            knocked = json.loads(json.dumps(elsewhere))
            knocked["joints"][j]["theta_deg"] += by
            answer, verdict = judge.check(calibrated, judge.simulate(knocked, 20, 20000 + draw, "new"))
            name = description["joints"][j]["name"]
            scenes[f"{name} {by} deg"][verdict] += 1
            found = {m["name"] for m in answer["moved"]} | {o for m in answer["moved"] for o in m["or_else"]}
            named[f"{name} {by} deg"] += f"{name}.theta" in found
        today = judge.simulate(elsewhere, 20, 30000 + draw, "new")
        lines = spoilt(today, 1, [5.0], draw)
        answer, verdict = judge.check(calibrated, today)
        scenes["new gross"][verdict] += 1
        named["new gross"] += {bad["line"] for bad in answer["bad"]} == lines
        spoilt(measured, 3, [0.8, 1.0, 12.0], draw)
        today = judge.simulate(elsewhere, 20, 40000 + draw, "new")
        scenes["old gross"][judge.check(judge.calibrate(arm, measured), today)[1]] += 1
        measured = judge.simulate(bending, 300, 50000 + draw, "old")
        corner = json.loads(json.dumps(bending | {"base": elsewhere["base"]}))
        place = random.Random(draw)
        for joint in corner["joints"]:
            low, high = joint["limits_deg"]
            start = place.uniform(low, high - 40.0)
            joint["limits_deg"] = [start, start + 40.0]
        today = judge.simulate(corner, 20, 60000 + draw, "new")
        scenes["bends, corner"][judge.check(judge.calibrate(arm, measured), today)[1]] += 1
    return scenes, named


def measured_rates(judge, arm, path, draws):
    header, rows = read(path)
    scenes = {"spread": Counter(), "one after the other": Counter()}
    for draw in range(1, draws + 1):
        chance = random.Random(draw)
        drawn = chance.sample(rows, 260)
        start = chance.randrange(len(rows) - 60)
        block = rows[start : start + 60]
        others = chance.sample(rows[:start] + rows[start + 60 :], 200)
        for name, old, new in (("spread", drawn[:200], drawn[200:]), ("one after the other", others, block)):
            files = judge.folder / "old.csv", judge.folder / "new.csv"
            write(files[0], header, old)
            write(files[1], header, new)
            scenes[name][judge.check(judge.calibrate(arm, files[0]), files[1])[1]] += 1
    return scenes, Counter()


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--program", required=True)
    options.add_argument("--robot", required=True, help="description, YAML")
    options.add_argument("--measured", help="CSV file of one arm that did not change")
    options.add_argument("--draws", type=int, default=40)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        judge = Judge(given.program, folder)
        if given.measured:
            scenes, named = measured_rates(judge, given.robot, given.measured, given.draws)
        else:
            import yaml  # PyYAML

            scenes, named = simulated(judge, yaml.safe_load(Path(given.robot).read_text()), given.draws)
    print("| change | still good | moved, within limits | no longer good | named |")
    print("| --- | --- | --- | --- | --- |")
    for name, counts in scenes.items():
        found = named.get(name, "")
        print(f"| {name} | {counts['good']} | {counts['moved']} | {counts['bad']} | {found} |")


main()
