"""How often a name that `llmt-robot discover` confirms depends on which poses were set aside.

    build/release/bin/blind_strangers --cases 100 --seed 9403 -o cases
    python3 bench/robots/names_by_seed.py --program build/release/bin/llmt-robot --cases cases --seeds 10

Each case is searched with every seed. Printed are the names that some seed confirms, how many of them not every seed
confirms, the probability that two seeds differ in one, and how many confirmed names are effects of the arm, by the
truth of the case, which the program does not see.
"""

import argparse
import json
import resource
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def found(program, case, seed):
    """Names, with their families, and whether they are confirmed; nothing where the program refuses the case."""
    words = [program, "discover", case / "robot.yaml", case / "measured.csv", "--seed", seed, "--json"]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        return None
    return {(of["name"], of["family"], of["location"]): of["confirmed"] for of in json.loads(done.stdout)["effects"]}


def true_names(case):
    truth = json.loads((case.parent / "truth" / f"{case.name}.json").read_text())
    return {(of["family"], place) for of in truth["hidden"] for place in of["locations"] or [""]}


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--program", required=True)
    options.add_argument("--cases", required=True, type=Path, help="folder of blind_strangers or blind_generate")
    options.add_argument("--seeds", type=int, default=10)
    options.add_argument("--jobs", type=int, default=1)
    given = options.parse_args()
    cases = sorted(case for case in given.cases.iterdir() if (case / "robot.yaml").exists())
    seeds = range(1, given.seeds + 1)
    with ThreadPoolExecutor(given.jobs) as workers:
        answers = list(workers.map(lambda of: found(given.program, *of), [(case, s) for case in cases for s in seeds]))
    confirmed = flipping = runs = right = of_runs = 0
    differ = 0.0
    for k, case in enumerate(cases):
        own = [answer for answer in answers[k * given.seeds : (k + 1) * given.seeds] if answer is not None]
        truth = true_names(case)
        runs += len(own)
        for answer in own:
            of_runs += sum(answer.values())
            right += sum(yes and name[1:] in truth for name, yes in answer.items())
        for name in {name for answer in own for name in answer}:
            count = sum(answer.get(name, False) for answer in own)
            if count == 0:
                continue
            confirmed += 1
            flipping += count < len(own)
            differ += 2.0 * count * (len(own) - count) / (len(own) * max(1, len(own) - 1))
    print(f"{len(cases)} cases, {runs} runs, {runs - len(answers)} refused")
    print(f"names confirmed by some seed: {confirmed}, not by every seed: {flipping}")
    print(f"two seeds differ in {100.0 * differ / max(1, confirmed):.1f} % of these names")
    print(f"confirmed in all runs: {of_runs}, of which effects of the arm: {right}")
    print(f"CPU s: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime:.0f}")


main()
