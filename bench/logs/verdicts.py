"""What an answer of `llmt discover` is worth, given the truth of a drawn machine: by name, and as a function.

The error as a function is rms(added - missing) / rms(missing) at the true signals of a second run; where nothing is
missing it is taken relative to the noise of the target.
"""

import math
import re

import numpy as np

import way

TWIN = 0.10  # functions within this of each other are one
NAMED = 0.25  # error of a function that has the right name
WORSE = 1.05
STATES = {
    "late": ("delay", "lag"), "sensor": ("lag", "delay"), "ahead": ("delay", "lag", "lead"),
    "actuator": ("lag", "delay", "lead"), "elastic": ("drive_spring", "resonance", "spring"), "swing": ("resonance",),
    "heat": ("memory", "slow_state"), "filling": ("memory", "slow_state"),
}
INNER = {name for names in STATES.values() for name in names}
CLEARED = ("nothing", "parameters only")


def label(name, location):
    parts = location.split(",")
    return f"{name} {','.join(sorted(parts) if name == 'product' else parts)}".strip()


def truth_labels(case):
    return [label(term.family, ",".join(term.place)) for term in case.hidden.terms]


def rivals(effect):
    """Labels of what the answer says explains it as well: single terms of `rivals` and members of a group."""
    found = set()
    for text in [*effect.get("rivals", []), *effect.get("group", []), *effect.get("members", [])]:
        text = text if isinstance(text, str) else f"{text['name']} {text.get('location', '')}"
        parts = re.sub(r"\(.*?\)", "", text).split()
        if "+" not in parts and parts:
            found.add(label(parts[0], "".join(parts[1:])))
    return found


def regime_of(effect):
    """Input and threshold of the regime in which an effect acts, or None: {"input", "threshold"} or "x > c"."""
    regime = effect.get("regime")
    if isinstance(regime, dict):
        return regime["input"], float(regime.get("threshold", regime.get("above", regime.get("below"))))
    match = re.match(r"\s*(\S+)\s*(?:>|<=?|>=)\s*(\S+)", regime or "")
    return (match[1], float(match[2])) if match else None


def is_state(effect):
    return bool(effect.get("inner_state")) or effect["name"] in INNER


def said_inner(answer):
    kind = str((answer.get("unknown") or {}).get("kind", ""))
    return (
        "inner state" in answer["verdict"] or "remembers" in answer["verdict"] or "remembers" in kind
        or any(is_state(e) for e in answer["effects"])
    )


def short(effect):
    values = " ".join(f"{p['value']:.4g}" for p in effect["parameters"])
    mark = "+" if effect["confirmed"] else "?"
    where = f" where {effect['regime']}" if effect.get("regime") else ""
    return f"{label(effect['name'], effect['location'])} {mark} {values}{where}"


def coverage(case, answer):
    """Of parameters with a standard error: how many intervals of 95 % hold the true value, and how many there are."""
    inside, count = 0, 0
    for parameter in answer.get("parameters") or []:
        parts, error = parameter.get("parts") or [parameter["name"]], parameter.get("std_error")
        if error and len(parts) == 1 and parts[0] in case.machine.parameters:
            true = case.hidden.changes.get(parts[0], 0.0)
            inside += abs(parameter["change"] - true) <= 1.96 * error
            count += 1
    return [int(inside), count]


def regime_right(case, answer, rows):
    """Is the effect named together with the input and the threshold of its regime? The threshold is right within 5 % of
    the rows or three standard deviations of the noise of the input: where a machine rests, many rows lie within it. A
    step of one input beyond a threshold of another is the same function with the two exchanged."""
    where, threshold = case.hidden.regime
    term = case.hidden.terms[-1]
    ways = [(label(term.family, ",".join(term.place)), where, threshold)]
    if term.family == "step":
        ways.append((label("step", where), term.place[0], dict(term.constants)["c"]))

    def is_near(said, name, true):
        x, noise = rows.run.signals[name], rows.noise.get(name, 0.0)
        between = np.mean((x > min(said, true)) & (x <= max(said, true)))
        return between <= 0.05 or abs(said - true) <= 3.0 * noise

    for effect in answer["effects"]:
        said, name = regime_of(effect), label(effect["name"], effect["location"])
        if said and any((name, said[0]) == way[:2] and is_near(said[1], *way[1:]) for way in ways):
            return True
    return False


def names_right(case, answer, error, in_vain):
    """alone: exactly the truth is named, its size to a quarter unless nothing can be gained; group: each name is the
    truth or has it among its rivals, and the function is within 10 %; listed: every true term is named or a rival."""
    wanted, effects = truth_labels(case), answer["effects"]
    if not wanted or case.hidden.regime:
        return {"alone": False, "group": False, "listed": False}
    said = [label(e["name"], e["location"]) for e in effects]
    quiet = not answer.get("unknown") and not said_inner(answer)
    alone = sorted(said) == sorted(wanted) and quiet and (error <= NAMED or in_vain)
    left, covered = list(wanted), 0
    for effect, name in zip(effects, said):
        match = next((w for w in left if w == name), None) or next((w for w in left if w in rivals(effect)), None)
        if match:
            left.remove(match)
            covered += 1
    group = not left and covered == len(effects) and quiet and error <= TWIN
    return {"alone": alone, "group": group, "listed": not left}


def allowed(case, rests):
    """Which all-clears are right although something is hidden: those that cost the second run at most 5 %."""
    nominal, alone, true = rests
    return {"nothing": true > nominal / WORSE, "parameters only": true > alone / WORSE}


def is_right(case, result):
    """One word for the whole answer, by the kind of what is hidden."""
    verdict, kind = result["verdict"], case.kind
    cleared = "nothing" if verdict.startswith("nothing") else "parameters only" if result["cleared"] else ""
    quiet = cleared and result["allowed"][cleared] or result["undecided"] and any(result["allowed"].values())
    if kind == "complete":
        return cleared == "nothing"
    if kind == "parameters":
        return cleared == "parameters only" or bool(quiet)
    if kind in ("effect", "both", "two"):
        return result["alone"] or result["group"] or bool(quiet)
    if kind == "regime":
        return result["regime_named"] or bool(quiet)
    if kind == "inner":
        return result["inner"] or bool(quiet)
    close = result["function_error"] is not None and result["function_error"] <= TWIN
    history = way.by_past(case) and result["inner"]
    return result["unknown"] or result["undecided"] or close or history or bool(quiet)


def judge(case, walk):
    """Everything that is counted of a run with an answer."""
    answer, (first, second) = walk.answer, walk.rows
    noise = max(second.noise["u"], 1e-300)
    scale = way.rms(walk.missing) or noise
    error = way.rms(walk.added - walk.missing) / scale if walk.added is not None else None
    nominal, alone, true = rests = way.rests(case, walk)
    after = way.rms(second.table["u"] - walk.corrected) if walk.corrected is not None else None
    known = truth_labels(case) if not case.hidden.regime else []
    past = way.by_past(case)
    confirmed = [e for e in answer["effects"] if e["confirmed"]]
    strange = [e for e in confirmed if label(e["name"], e["location"]) not in known and not (past and is_state(e))]
    if case.hidden.regime and regime_right(case, answer, first):
        strange = []
    verdict, off = answer["verdict"], error is None or error > TWIN
    result = {
        "verdict": verdict,
        "effects": [short(e) for e in answer["effects"]],
        "rivals": [sorted(rivals(e)) for e in answer["effects"]],
        "unknown": "unknown" in verdict or bool(answer.get("unknown")),
        "undecided": verdict.startswith("undecided"),
        "failed": verdict.startswith("failed"),
        "cleared": verdict.startswith(CLEARED) and not answer["effects"],
        "inner": said_inner(answer),
        "state_named": bool(case.hidden.state) and any(e["name"] in STATES[case.hidden.state[0]] for e in answer["effects"]),
        "confirmed": len(confirmed),
        "wrong_name": bool(strange),
        "wrong": bool(strange) and off,
        "off_confirmed": bool(confirmed) and off,
        "function_error": error,
        "allowed": allowed(case, rests),
        "rests": [nominal, alone, true, after],
        "rest_over_noise": (after or nominal) / noise,
        "true_over_noise": true / noise,
        "gain": after / nominal if after is not None else None,
        "true_gain": true / nominal,
        "cover": coverage(case, answer),
        "time": answer.get("time"),
    }
    result |= names_right(case, answer, math.inf if error is None else error, result["allowed"]["nothing"])
    result["regime_named"] = bool(case.hidden.regime) and regime_right(case, answer, first)
    result["right"] = bool(is_right(case, result))
    return result
