"""How well a program answers the cases of cases.py, without a look at the formulas that it prints.

    python bench/logs/score.py --program build/release/bin/llmt --seeds 3 --cases c1_all5,d_exact_all5
    python bench/logs/score.py --program build/release/bin/llmt --seeds 20 --time --results after.jsonl

An effect of the answer is right if its family and place are those of the truth, and every coefficient lies within a
quarter of the true one. What the program adds to the simulation is also compared, row by row, with the true gap at the
true signals. A line is a case, over its seeds:

    alone    every missing term is named rightly, and nothing else is named
    listed   every missing term is named rightly, among others, or stands among the rivals of a named one
    wrong    runs with at least one other effect that is called confirmed, and whose rivals are not right either
    tent.    runs that name only other effects, none of them confirmed
    nothing  the answer is that nothing is missing (or that parameters alone differ)
    alarm    another answer, where nothing is missing
    inner    the answer speaks of an inner state
    param.   every parameter that differs is right within a quarter
    cover    coefficients within 1.96 of their standard errors from the truth, of all that have the right name
    error    rms of (what is added - true gap) / rms of the true gap; where nothing is missing, / spread of the output
    gap      held-out gap after / before; the larger of two seeds in the middle
    CPU s    of the program

The results file keeps every run, and what is in there is not run again.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

import numpy as np

import logs

TOLERANCE = 0.25
# Derivatives that equal an input or a term of it.
SAME_INPUT = {"J_b": "dq", "J_b1": "dq1", "J_m": "ddq", "J_J": "ddq"}
SAME_TERM = {"f1": "sign dq1"}
INNER = ("delay", "lag", "drive_spring", "resonance")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", type=int, default=3, metavar="COUNT")
    parser.add_argument("--first", type=int, default=1, metavar="SEED", help="the first of the seeds; default: %(default)s")
    parser.add_argument("--cases", metavar="NAME,...", help="default: all")
    parser.add_argument("--time", action="store_true", help="name the columns of time and runs to the program")
    parser.add_argument("--parameters", action="store_true", help="give derivatives by --parameters, not as inputs")
    parser.add_argument("--options", default="", help="further options of the program, separated by blanks")
    parser.add_argument("--jobs", type=int, default=1, metavar="COUNT")
    parser.add_argument("--seconds", type=int, default=300, help="CPU time of a run; default: %(default)s")
    parser.add_argument("--results", type=pathlib.Path, metavar="FILE", help="JSON lines; default: none are kept")
    return parser.parse_args()


def near(values, truth):
    scale = max(abs(x) for x in truth)
    return len(values) >= len(truth) and all(
        abs(v - x) <= TOLERANCE * (abs(x) if x else scale) for v, x in zip(values, truth)
    )


def near_change(value, change):
    """Of a parameter; one that is as it should be may seem a little off."""
    return abs(value - change) <= (TOLERANCE * abs(change) if change else 0.1)


def place(effect):
    return ",".join(SAME_INPUT.get(name, name) for name in effect["location"].split(","))


def label(effect):
    """Family and place, with one name for columns that are equal."""
    return f"{effect['name']} {place(effect)}".strip()


def rivals(effect):
    """What the answer says explains it as well: labels of the terms, a tuple for each explanation."""
    explanations = []
    for text in effect.get("rivals", []):
        terms = [part.partition(" ") for part in text.split(" + ")]
        explanations.append(tuple(label({"name": family, "location": location}) for family, _, location in terms))
    return explanations


def values_of(effect):
    return [p["value"] for p in effect["parameters"]]


def covered(effect, truth):
    """Of each coefficient that has a standard error: does the interval of 95 % hold the truth?"""
    errors = [p.get("std_error") for p in effect["parameters"]]
    return [abs(v - x) <= 1.96 * e for v, x, e in zip(values_of(effect), truth, errors) if e]


def said_inner(document):
    if document.get("inner_state") or "inner state" in document["verdict"]:
        return True
    return any(effect.get("inner_state") or effect["name"] in INNER for effect in document["effects"])


def parameter_effects(document, case):
    """Estimated parameters as (true change, effect), whether the program calls them parameters or terms."""
    found = []
    for name, change in case.parameters:
        column = SAME_INPUT.get(f"J_{name}", f"J_{name}")
        for effect in document["effects"]:
            if label(effect) in (f"linear {column}", SAME_TERM.get(name)):
                found.append((name, change, effect))
        for parameter in document.get("parameters") or []:
            if parameter["name"] == name:
                single = {"value": parameter["change"], "std_error": parameter["std_error"]}
                found.append((name, change, {"name": "parameter", "location": name, "parameters": [single]}))
    return found


def described(effect):
    """For people who look into the results file: + confirmed, ? tentative, coefficients, (rivals)."""
    numbers = " ".join(f"{v:.4g}" for v in values_of(effect))
    others = f" ({', '.join(' + '.join(terms) for terms in rivals(effect))})" if rivals(effect) else ""
    return f"{label(effect)} {'+' if effect['confirmed'] else '?'} {numbers}{others}"


def is_complete(case):
    return not (case.truth or case.inner or case.refused or any(change for _, change in case.parameters))


def judge(document, case):
    """What the answer (JSON) of the program is worth, given the truth of the case."""
    effects, verdict = document["effects"], document["verdict"]
    named = [(term, [e for e in effects if label(e) in term.accepted]) for term in case.truth]
    right = [[e for e in found if near(values_of(e), term.values)] for term, found in named]
    parameters = parameter_effects(document, case)
    estimates = {name: values_of(effect)[0] for name, _, effect in parameters}  # what is not named is as it should be
    off = [name for name, change in case.parameters if not near_change(estimates.get(name, 0.0), change)]
    allowed = [id(e) for found in right for e in found] + [id(effect) for _, _, effect in parameters]
    if case.inner:
        allowed += [id(e) for e in effects if e["name"] in INNER or e.get("inner_state")]
    others = [e for e in effects if id(e) not in allowed and label(e) not in case.tolerated]
    accepted = {name for term in case.truth for name in term.accepted}
    undecided = [e for e in others if any(accepted.issuperset(terms) for terms in rivals(e))]
    beside = {name for e in undecided for terms in rivals(e) for name in terms}
    listed = bool(right) and all(found or beside & set(term.accepted) for term, found in zip(case.truth, right))
    wrong = [e for e in others if e["confirmed"] and e not in undecided]
    nothing = verdict.startswith("nothing") or verdict.startswith("parameters only")
    complete = is_complete(case)
    cover = [inside for term, found in named for e in found for inside in covered(e, term.values)]
    cover += [inside for _, change, e in parameters for inside in covered(e, (change,))]
    return {
        "verdict": verdict,
        "names": [described(e) for e in effects],
        "alone": bool(right) and all(right) and not others and not document.get("unknown") and not said_inner(document),
        "listed": listed,
        "wrong": bool(wrong),
        "tentative": bool(others) and not any(right) and not any(e["confirmed"] for e in others),
        "nothing": nothing and not others,
        "alarm": complete and not (nothing and not effects),
        "inner": said_inner(document),
        "parameters": not off if case.parameters else None,
        "cover": [sum(cover), len(cover)],
        "gap": [document["gap"]["before"], document["gap"]["after"]],
    }


def command(options, case, stem):
    derivatives = [f"J_{name}" for name, _ in case.parameters]
    inputs = list(case.inputs) + ([] if options.parameters else derivatives)
    words = [options.program, "discover", f"{stem}_sim.csv", f"{stem}_meas.csv", "--inputs", ",".join(inputs)]
    words += ["-t", case.target, "--json", "-o", f"{stem}_corrected.csv", *options.options.split()]
    if options.time:
        words += ["--time", "t", *(["--group", "run"] if case.runs > 1 else [])]
    if options.parameters and derivatives:
        words += ["--parameters", parameters_file(case, stem)]
    return words


def parameters_file(case, stem):
    """The derivatives, in a file of their own."""
    table = np.genfromtxt(f"{stem}_sim.csv", delimiter=",", names=True)
    columns = {name: np.atleast_1d(table[f"J_{name}"]) for name, _ in case.parameters}
    logs.write_csv(f"{stem}_parameters.csv", columns)
    return f"{stem}_parameters.csv"


def run(options, case, seed):
    with tempfile.TemporaryDirectory() as folder:
        log, stem = logs.write(folder, case, seed)
        words = command(options, case, stem)
        limit = ["prlimit", f"--cpu={options.seconds}"]
        output, errors = pathlib.Path(f"{stem}.json"), pathlib.Path(f"{stem}.txt")
        with output.open("wb") as out, errors.open("wb") as err:
            child = subprocess.Popen(limit + words, stdout=out, stderr=err)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        result = {"case": case.name, "seed": seed, "seconds": usage.ru_utime + usage.ru_stime}
        if child.returncode:
            message = errors.read_text()[-300:]
            return result | {"failed": f"{child.returncode}: {message}", "refused": child.returncode in (1, 2)}
        result |= judge(json.loads(output.read_text()), case)
        corrected = pathlib.Path(f"{stem}_corrected.csv")
        added = np.zeros(len(log.missing))
        if corrected.exists():
            table = np.genfromtxt(corrected, delimiter=",", names=True)
            added = table[f"{case.target}_corrected"] - table[f"{case.target}_simulated"]
        scale = np.std(log.measured) if is_complete(case) else np.sqrt(np.mean(log.missing**2))
        return result | {"error": float(np.sqrt(np.mean((added - log.missing) ** 2)) / scale)}


def share(results, key):
    values = [r[key] for r in results if r.get(key) is not None]
    return f"{sum(values)}/{len(values)}" if values else "-"


def middle(values):
    return f"{statistics.median_high(values):.3g}" if values else "-"


COLUMNS = ("alone", "listed", "wrong", "tentative", "nothing", "alarm", "inner", "parameters")


def line(name, results):
    """A line of the table: counts of the runs that gave an answer."""
    answered = [r for r in results if "verdict" in r]
    cells = [share(answered, key) for key in COLUMNS]
    inside = [sum(r["cover"][k] for r in answered) for k in (0, 1)]
    cells.append(f"{inside[0]}/{inside[1]}" if inside[1] else "-")
    cells.append(middle([r["error"] for r in answered]))
    cells.append(middle([r["gap"][1] / r["gap"][0] for r in answered if r["gap"][0]]))
    cells.append(middle([r["seconds"] for r in results]))
    none = len(results) - len(answered)
    refused = sum(bool(r.get("refused")) for r in results)
    note = f"  no answer {none}, of these refused {refused}" if none else ""
    return f"{name:34}" + "".join(f"{cell:>9}" for cell in cells) + note


def groups(cases):
    """Sums over cases that share a goal."""
    yield "complete models", [c for c in cases if is_complete(c)]
    yield "effects hidden", [c for c in cases if c.truth and not c.parameters]
    yield "effects of a and c, 5 % on all", [c for c in cases if c.name in ("a_all5", "c1_all5", "c2_all5")]
    yield "parameters off, effect hidden", [c for c in cases if c.parameters and c.truth]
    yield "parameters off alone", [c for c in cases if c.parameters and not c.truth and not is_complete(c)]
    yield "inner state", [c for c in cases if c.inner]
    yield "all", [c for c in cases if not c.refused]


def table(cases, results):
    heads = ("alone", "listed", "wrong", "tent.", "nothing", "alarm", "inner", "param.", "cover", "error", "gap", "CPU s")
    yield f"{'case':34}" + "".join(f"{head:>9}" for head in heads)
    for case in cases:
        of_case = [r for r in results if r["case"] == case.name]
        if of_case:
            yield line(case.name, of_case)
    yield ""
    for name, members in groups(cases):
        of_group = [r for r in results if r["case"] in {c.name for c in members}]
        if of_group:
            yield line(name, of_group)


def main():
    options = arguments()
    cases = logs.chosen(options.cases)
    seeds = range(options.first, options.first + options.seeds)
    kept = []
    if options.results and options.results.exists():
        kept = [json.loads(text) for text in options.results.read_text().splitlines()]
    wanted = {(case.name, seed) for case in cases for seed in seeds}
    results = [r for r in kept if (r["case"], r["seed"]) in wanted]
    done = {(r["case"], r["seed"]) for r in results}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        work = [(case, seed) for seed in seeds for case in cases if (case.name, seed) not in done]
        for result in pool.map(lambda job: run(options, *job), work):
            results.append(result)
            if options.results:
                with options.results.open("a") as file:
                    file.write(json.dumps(result) + "\n")
    for text in table(cases, sorted(results, key=lambda r: (r["case"], r["seed"]))):
        print(text)


if __name__ == "__main__":
    main()
