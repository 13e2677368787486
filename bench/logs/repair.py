"""An answer of the program, put into the model of a machine.

A term is torque that the motion needs beyond the model, so that its negative is applied. Dry friction becomes a level
that opposes the motion and holds a body at rest; a term of the acceleration becomes inertia, one of the velocity damping;
a spring in the drive makes the rigid model elastic. What no simulation can have (a delay, a function of accelerations,
a shape without a name) is left out and listed, and so is a term that did not shrink the gap on the rows set aside. Beside a
state that is left out nothing is put in, for it was fitted with it.
"""

import dataclasses

import numpy as np

import logs
import machines
import score

# Parameters that a table of torques can tell, and nearly no others.
FITTED = {
    "cart": ("m", "b", "f"),
    "arm": ("m1", "m2", "b1", "f1"),
    "elastic": ("m", "armature", "b"),
    "gripper": ("m", "b", "f", "k"),
    "gear": ("J", "b", "f", "g"),
    "belt": ("m", "b", "f", "k"),
}
# Terms that are parameters of the model.
AS_PARAMETER = {
    "cart": {"linear ddq": "m", "linear dq": "b", "sign dq": "f"},
    "arm": {"linear ddq1": "a1", "linear dq1": "b1", "sign dq1": "f1"},
    "elastic": {"linear ddq": "armature", "linear dq": "b"},
    "gripper": {"linear ddq": "m", "linear dq": "b", "sign dq": "f"},
    "gear": {"linear ddq": "J", "linear dq": "b", "sign dq": "f"},
    "belt": {"linear ddq": "m", "linear dq": "b", "sign dq": "f"},
}
FRICTION = ("sign", "stribeck", "coulomb_stribeck", "tanh", "sign_product")
FUNCTIONS = {name: getattr(np, name) for name in ("sign", "exp", "sin", "cos", "tan", "tanh", "arctan", "sqrt", "sinh")}
FUNCTIONS |= {"abs": abs, "min": min, "max": max, "asinh": np.arcsinh, "atan": np.arctan, "ln": np.log, "pi": np.pi}


@dataclasses.dataclass
class Model:
    """Changes of a nominal model: parameters as (name, value), and effects as machines.move() takes them."""

    changes: tuple = ()
    effects: list = dataclasses.field(default_factory=list)
    left_out: list = dataclasses.field(default_factory=list)
    has_spring: bool = False


def is_of_mujoco(case):
    return logs.source(case.machine) is machines


def signals_of(case, q, dq):
    """Positions and velocities under the names of the log."""
    ends = [str(joint + 1) for joint in range(len(q))] if case.machine == "arm" else [""]
    return {name + end: float(x[joint]) for joint, end in enumerate(ends) for name, x in (("q", q), ("dq", dq))}


def effect_of(case, kind, function):
    """`function` of the signals by name, as an effect of the machine; "dry": the level of a friction."""
    if is_of_mujoco(case):
        called = lambda q, dq: function(signals_of(case, q, dq))
        return machines.Effect(0, friction=called) if kind == "dry" else machines.Effect(0, needed=called)

    def of_state(_, x):
        known = {"q": x["q"], "dq": x["v"]}
        if "q_b" in x:
            known |= {"stretch": x["q"] - x["q_b"], "dstretch": x["v"] - x["v_b"]}
        if case.machine == "gripper":
            known |= {"grip": logs.source("gripper").grip(logs.source("gripper").PARAMETERS["gripper"], x)}
        return function(known)

    return kind, of_state


def named_effect(case, effect):
    """The effect of a named term, None where a simulation cannot have it."""
    places = score.place(effect).split(",") if effect["location"] else []
    of_state = [name for name in case.inputs if not name.startswith("dd")]
    if effect["expression"] is None or any(name not in of_state for name in places):
        return None
    code = compile(effect["expression"].replace("^", "**"), "expression", "eval")
    if {*code.co_names} - {*FUNCTIONS, *of_state}:
        return None  # such as a gain, which takes the simulated torque
    speed = "dq1" if case.machine == "arm" else "dq"
    if effect["name"] in FRICTION and places[0] == speed:
        return effect_of(case, "dry", lambda x: float(eval(code, FUNCTIONS, x | {speed: abs(x[speed]) or 1e-12})))
    kind = "needed" if len(places) and all("stretch" in name for name in places) or case.machine != "belt" else "own"
    return effect_of(case, kind, lambda x: float(eval(code, FUNCTIONS, x)))


def is_spring_of(case, effect):
    return effect["name"] == "drive_spring" and case.machine == "elastic" and score.values_of(effect)[0] > 0


def repaired(document, case):
    """The Model that an answer (JSON) of the program makes of the nominal one."""
    if document["verdict"] in ("nothing missing", "failed on held-out rows"):
        return Model()
    nominal = logs.source(case.machine).PARAMETERS[case.machine]
    model, changes = Model(), {}
    of_parameters = score.parameter_effects(document, case)
    for name, _, estimated in of_parameters:
        changes[name] = changes.get(name, 0.0) + score.values_of(estimated)[0]
    known = [id(estimated) for _, _, estimated in of_parameters]
    others = [effect for effect in document["effects"] if id(effect) not in known]
    if any("inner_state" in effect and not is_spring_of(case, effect) for effect in others):
        return Model(left_out=[score.label(effect) for effect in others])
    for effect in others:
        label, values = score.label(effect), score.values_of(effect)
        if not effect.get("shrinks_gap", True):
            model.left_out.append(f"{label} (shrinks no gap)")
        elif label in AS_PARAMETER[case.machine]:
            name = AS_PARAMETER[case.machine][label]
            changes[name] = changes.get(name, 0.0) + values[0]
        elif is_spring_of(case, effect):
            model.has_spring = True
            changes |= {"k": 1 / values[0] - nominal["k"], "d": -nominal["d"]}
        elif (made := named_effect(case, effect)) is not None:
            model.effects.append(made)
        else:
            model.left_out.append(label)
    model.left_out += [f"shape of {','.join(shape['depends_on'])}" for shape in document["unknown_all"]]
    model.changes = tuple((name, max(1e-6, nominal[name] + change)) for name, change in changes.items())
    return model


def fitted_parameters(case, log):
    """Parameters alone, by least squares on the table that the program gets."""
    source = logs.source(case.machine)
    nominal = source.PARAMETERS[case.machine]
    columns = []
    for name in FITTED[case.machine]:
        half = 1e-3 * nominal[name]
        up, down = (source.simulate(case.machine, log.signals, ((name, nominal[name] + h),))[:, 0] for h in (half, -half))
        columns.append((up - down) / (2 * half))
    change = np.linalg.lstsq(np.column_stack(columns), log.measured - log.simulated, rcond=None)[0]
    return Model(tuple((name, max(1e-6, nominal[name] + c)) for name, c in zip(FITTED[case.machine], change)))
