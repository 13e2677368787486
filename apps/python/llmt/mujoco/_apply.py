"""What was found, put into a model."""

from __future__ import annotations

import copy
import json
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from llmt._results import Findings

from ._models import _BODY_KINDS, _compiled, _places, _positions, _set, _value

Force = Callable[[float], float]
Law = Callable[[np.ndarray, np.ndarray], float]  # of all positions and velocities


class _Correction:
    """What is added to a model while it runs: forces, and friction that depends on the velocity."""

    def __init__(self) -> None:
        self.forces: list[tuple[int, Law]] = []  # joint it acts on
        self.frictions: list[tuple[int, Force]] = []
        self.friction_base: dict[int, float] = {}

    def __bool__(self) -> bool:
        return bool(self.forces or self.frictions)

    def __call__(self, model: Any, data: Any) -> None:
        """To be called before each step, after ``qfrc_applied`` has been set."""
        for joint, law in self.forces:
            data.qfrc_applied[joint] -= law(data.qpos, data.qvel)
        friction = dict(self.friction_base)
        for joint, function in self.frictions:
            friction[joint] += function(float(data.qvel[joint]))
        for joint, value in friction.items():
            model.dof_frictionloss[joint] = max(0.0, value)


def _first(joint: Any, field: str) -> float:
    return float(np.ravel(getattr(joint, field))[0])


def _add(joint: Any, field: str, change: float) -> None:
    """Fields that are polynomials in newer versions of MuJoCo have the linear coefficient first."""
    value = np.array(getattr(joint, field), dtype=float)
    if value.ndim == 0:
        setattr(joint, field, float(value) + change)
    else:
        value[0] += change
        setattr(joint, field, value)


def apply(found: Findings, spec: Any) -> tuple[Any, Callable[[Any, Any], None] | None]:
    """A copy of the specification with what was found by :func:`llmt.discover` with :func:`inverse_dynamics`, and a
    callback for what has no field in it (None: nothing).

    Parameters are set. A term of the needed torque is a force that the model lacks, with the other sign. Of the joint's
    own motion: ``dq`` goes to ``damping``, ``sign(dq)`` to ``frictionloss``, ``ddq`` to ``armature``, ``q`` to
    ``stiffness``; friction that falls with speed becomes a ``frictionloss`` that the callback sets; other functions of
    positions and velocities become forces. ``callback(model, data)`` is to be called before each ``mj_step``, after
    ``qfrc_applied`` has been set. What MuJoCo cannot take (gains, shapes without a name, other terms of accelerations)
    is left out with a warning that names it, and so is a term that did not shrink the gap on the rows set aside; if
    parameters were fitted beside it, nothing is changed. The specification is copied as it is, too, where the result
    says that it may not be applied (``may_be_applied``), and where the answer is an inner state: what stands beside a
    state was fitted with it.
    """
    answer = found.to_dict()
    positions = _positions(column["name"] for column in answer["inputs"])
    outputs = [column["name"] for column in answer["outputs"]]
    nominal = _compiled(spec)
    if len(positions) != nominal.nv or len(outputs) != nominal.nv:
        raise ValueError(
            f"the model has {nominal.nv} joints, the result has {len(positions)} positions, {len(outputs)} outputs"
        )
    fixed = spec.copy()
    states = [_title(term) for term in answer["effects"] if "inner_state" in term]
    if states:
        warnings.warn(f"nothing is changed: MuJoCo cannot take the inner state {'; '.join(states)}", stacklevel=2)
    if states or not answer["may_be_applied"]:
        return fixed, None
    joints = {joint.name: joint for joint in fixed.joints}
    spec_joints = [
        joints[nominal.joint(k).name] if nominal.joint(k).name in joints else fixed.joints[k] for k in range(nominal.nv)
    ]
    fitted = _fitted(answer, nominal)
    _set_spec(fixed, spec_joints, nominal, fitted)
    correction = _Correction()
    left_out = []
    for term in answer["effects"]:
        values = [parameter["value"] for parameter in term["parameters"]]
        if not term.get("shrinks_gap", True):
            left_out.append(f"{_title(term)}, which did not shrink the gap on the rows set aside")
        elif not _add_term(answer, term, values, positions, outputs.index(term["output"]), spec_joints, correction):
            left_out.append(_title(term))
    if left_out and fitted:
        warnings.warn(
            f"nothing is changed: parameters were fitted beside what cannot be put in, {'; '.join(left_out)}",
            stacklevel=2,
        )
        return spec.copy(), None
    if left_out:
        warnings.warn(f"left out of the model: {'; '.join(left_out)}", stacklevel=2)
    for joint, _ in correction.frictions:
        correction.friction_base[joint] = _first(spec_joints[joint], "frictionloss")
    return fixed, correction if correction else None


def _title(term: Mapping[str, Any]) -> str:
    return f"{term['name']} of {term['location'] or 'the output'} ({term['formula']}) on {term['output']}"


def _fitted(answer: Mapping[str, Any], nominal: Any) -> dict[str, float]:
    """Values by parameter. Of parameters that the rows do not tell apart, "a + b", the first one takes the change."""
    values: dict[str, float] = {}
    places = _places(nominal)
    for parameter in answer["parameters"]:
        name = parameter["name"]
        first = name if name in places else name.split(" + ")[0].split(" - ")[0]
        if first not in places:
            raise ValueError(f"{name!r} is no parameter of the model; there are {', '.join(places)}")
        change = parameter.get("change")
        values[first] = parameter["value"] if change is None else _value(nominal, places[first]) + change
    return values


def _set_spec(fixed: Any, joints: Sequence[Any], nominal: Any, values: Mapping[str, float]) -> None:
    model = copy.copy(nominal)
    _set(model, nominal, values)
    places = _places(nominal)
    bodies = set()
    for name, value in values.items():
        kind, number, _ = places[name]
        if kind in _BODY_KINDS:
            bodies.add(number)
        else:
            _add(joints[number], kind, value - _first(joints[number], kind))
    for number in bodies:
        body = fixed.body(nominal.body(number).name) if nominal.body(number).name else fixed.bodies[number]
        body.explicitinertial = True
        body.mass = float(model.body_mass[number])
        body.ipos = model.body_ipos[number]
        body.iquat = model.body_iquat[number]
        body.inertia = model.body_inertia[number]
        body.fullinertia = np.full(6, np.nan)


def _law(answer: Mapping[str, Any], term: Mapping[str, Any], positions: list[str]) -> Law | None:
    """The term as a function of positions and velocities; None where it depends on more than these."""
    from llmt import _core

    if term["expression"] is None:
        return None
    used = set(re.findall(r"[A-Za-z_]\w*", term["expression"]))
    if used & {column["word"] for column in answer["outputs"]}:
        return None
    places: list[tuple[str, int] | None] = []
    for column in answer["inputs"]:
        name, place = column["name"], None
        for what, prefix in (("q", ""), ("dq", "d")):
            if name.startswith(prefix) and name[len(prefix) :] in positions:
                place = (what, positions.index(name[len(prefix) :]))
        if place is None and column["word"] in used:
            return None
        places.append(place)
    alone = {**answer, "effects": [term], "unknown": None, "unknown_all": [], "parameters": []}
    names: dict[str, Any] = {}
    exec(_core.code_of_found(json.dumps(alone), True), names)
    output = next(column for column in answer["outputs"] if column["name"] == term["output"])
    function = names["correction" if len(answer["outputs"]) == 1 else f"correction_{output['word']}"]

    def law(q: np.ndarray, dq: np.ndarray) -> float:
        state = {"q": q, "dq": dq}
        return float(function(*[0.0 if place is None else float(state[place[0]][place[1]]) for place in places]))

    return law


def _add_term(
    answer: Mapping[str, Any],
    term: Mapping[str, Any],
    values: list[float],
    positions: list[str],
    joint: int,
    joints: Sequence[Any],
    correction: _Correction,
) -> bool:
    """Whether MuJoCo can take the term."""
    family, place, own = term["name"], term["location"], positions[joint]
    everywhere = term.get("regime") is None
    field = {
        ("linear", f"d{own}"): "damping",
        ("linear", f"dd{own}"): "armature",
        ("sign", f"d{own}"): "frictionloss",
        ("linear", own): "stiffness",
    }.get((family, place))
    if field is not None and everywhere:
        is_possible = _first(joints[joint], field) + values[0] >= 0.0
        if field == "stiffness":
            is_possible = is_possible and float(joints[joint].springref) == 0.0
        if is_possible:
            _add(joints[joint], field, values[0])
            return True
    if family == "stribeck" and place == f"d{own}" and everywhere:
        coefficient, speed = values
        correction.frictions.append((joint, lambda v: coefficient * float(np.exp(-((v / speed) ** 2)))))
        return True
    law = _law(answer, term, positions)
    if law is None:
        return False
    correction.forces.append((joint, law))
    return True
