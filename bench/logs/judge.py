"""Judges a program on machines that a seed draws, so that it cannot be tuned to a list of machines.

    python bench/logs/judge.py --program build/release/bin/llmt --seeds 0:80 --results runs.jsonl
    python bench/logs/judge.py --results runs.jsonl                 # the tables alone
    python bench/logs/judge.py --results runs.jsonl --list effect   # each run of a kind on a line
    python bench/logs/judge.py --seeds 17:18 --keep FOLDER          # the files of a seed, for a look at a failure

What is hidden goes by seed % 8: complete, parameters, effect, both, inner, outside, regime, two. Rules of the program
are designed on seeds below 1000; rates are stated on seeds that were never run before, each once. The results file has
a line for each seed, and what is in there is not run again.
"""

import argparse
import json
import pathlib
import tempfile

import numpy as np

import generate
import rates
import verdicts
import way


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", help="path of llmt; without it nothing is run")
    parser.add_argument("--seeds", default="", metavar="FIRST:END,...", help="with --kinds: those of these kinds")
    parser.add_argument("--kinds", default="", metavar="KIND,...", help="default: all")
    parser.add_argument("--results", type=pathlib.Path, metavar="FILE", help="JSON lines; default: none are kept")
    parser.add_argument("--keep", metavar="FOLDER", help="write the files of each seed into FOLDER/SEED")
    parser.add_argument("--options", default="", help="further options of discover, separated by blanks")
    parser.add_argument("--tell-noise", action="store_true", help="hand the noise that signals reports to --input-noise")
    parser.add_argument("--through-filter", action="store_true", help="the user filters the simulation as the log was")
    parser.add_argument("--calibrated", action="store_true", help="the user fitted the parameters to the log before")
    parser.add_argument("--limit", type=int, default=300, metavar="SECONDS", help="CPU time of a search; default: %(default)s")
    parser.add_argument("--list", default="", metavar="KIND,...", help="print a line for each run of these kinds, or all")
    options = parser.parse_args()
    options.words = options.options.split()
    return options


def seeds_of(text):
    result = []
    for part in filter(None, text.split(",")):
        first, _, end = part.partition(":")
        result += range(int(first), int(end) if end else int(first) + 1)
    return result


def truth_text(case):
    """What is hidden, in a line."""
    h, parts = case.hidden, []
    for term in h.terms:
        constants = " ".join(f"{name}={value:.4g}" for name, value in term.constants)
        coefficients = " ".join(f"{c:.4g}" for c in term.coefficients)
        parts.append(f"{term.label} {coefficients} {constants}".strip())
    if h.regime:
        parts[-1] += f" where {h.regime[0]} > {h.regime[1]:.4g}"
    parts += [f"{name} {change / case.machine.parameters[name]:+.3f}" for name, change in h.changes.items()]
    if h.state:
        constants = " ".join(f"{name}={value:.4g}" for name, value in h.state[2].items())
        parts.append(f"{h.state[0]} {h.state[1]:.4g} {constants}".strip())
    if h.outside:
        parts.append(f"{h.outside[0]} of {','.join(h.outside[1])}")
    return "; ".join(parts) or "nothing"


def structure_of(case, rows):
    """The drawn structure, short enough for a line of the results."""
    chain, machine, run = case.chain, case.machine, rows.run
    hidden = way.rms(way.true_gap(case, rows))
    return {
        "family": machine.family, "axes": len(machine.coordinates), "friction": [axis.friction for axis in machine.axes],
        "rate": case.rate, "samples": case.samples, "cutoff": round(case.cutoff, 4), "references": case.kinds,
        "loop": run.in_loop, "sticks": case.holds or run.in_loop, "free": case.free,
        "noise_share": chain.noise / float(np.std(run.target)), "coloured": round(chain.coloured, 2),
        "memory": chain.memory, "late": chain.late, "drift": chain.drift,
        "size": hidden / chain.noise, "share": hidden / float(np.std(run.target)),
    }


def run(options, seed, folder):
    case = generate.case(seed)
    walked = way.walk(options.program, case, folder, options)
    case = walked.case
    result = {"seed": seed, "kind": case.kind, "truth": truth_text(case), "seconds": walked.seconds}
    result["rows"] = [len(rows.at) if rows else 0 for rows in walked.rows]
    first = walked.rows[0] or way.whole(case, 1)
    result["structure"] = structure_of(case, first)
    if case.kind in ("outside", "regime"):
        result["imitated"] = way.imitation(case, first)
    if walked.answer is None:
        return result | {"no_answer": walked.message}
    if walked.added is None:
        result["not_applied"] = walked.message
    return result | verdicts.judge(case, walked)


def main():
    options = arguments()
    kinds = set(filter(None, options.kinds.split(",")))
    results = []
    if options.results and options.results.exists():
        results = [json.loads(text) for text in options.results.read_text().splitlines()]
    done = {result["seed"] for result in results}
    wanted = [s for s in seeds_of(options.seeds) if not kinds or generate.kind_of(s) in kinds]
    for seed in wanted if options.program else []:
        if seed in done:
            continue
        with tempfile.TemporaryDirectory() as folder:
            if options.keep:
                folder = pathlib.Path(options.keep, str(seed))
                folder.mkdir(parents=True, exist_ok=True)
            results.append(run(options, seed, str(folder)))
        print(rates.line(results[-1]), flush=True)
        if options.results:
            with options.results.open("a") as file:
                file.write(json.dumps(results[-1]) + "\n")
    if wanted:
        results = [result for result in results if result["seed"] in set(wanted)]
    for result in sorted(results, key=lambda r: r["seed"]):
        if options.list and (options.list == "all" or result["kind"] in options.list.split(",")):
            print(rates.line(result))
    for text in rates.tables(results):
        print(text)


if __name__ == "__main__":
    main()
