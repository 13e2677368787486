"""MuJoCo models beside logs: the torques that a model needs for a measured motion, its parameters, what was found put
into it, and another log replayed.

Joints are hinges and slides; their order is that of the model. A column ``q`` of positions goes with ``dq`` and ``ddq``,
its velocity and acceleration, as :func:`llmt.signals` names them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from llmt._columns import columns_of
from llmt._discover import Missing, Parameter
from llmt._results import names
from llmt._signals import signals

Force = Callable[[float], float]

_JOINT_KINDS = ("damping", "frictionloss", "armature")
_BODY_KINDS = ("mass", "com", "inertia")
_AXES = {"com": ("x", "y", "z"), "inertia": ("xx", "yy", "zz", "xy", "xz", "yz")}
_HINGE_UNITS = {"damping": "N m s/rad", "frictionloss": "N m", "armature": "kg m^2"}
_SLIDE_UNITS = {"damping": "N s/m", "frictionloss": "N", "armature": "kg"}
_BODY_UNITS = {"mass": "kg", "com": "m", "inertia": "kg m^2"}
_SMALL = {"damping": 0.1, "frictionloss": 0.1, "armature": 0.01, "mass": 0.1, "com": 0.01, "inertia": 0.01}


def _compiled(spec: Any) -> Any:
    """The model of a copy of the specification, or MjModel as it is. Raises ValueError for joints other than hinges and
    slides."""
    import mujoco

    model = spec.copy().compile() if hasattr(spec, "compile") else spec
    plain = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    for joint in range(model.njnt):
        if int(model.jnt_type[joint]) not in plain:
            raise ValueError(f"joint {_joint_name(model, joint)!r} is neither a hinge nor a slide")
    return model


def _joint_name(model: Any, joint: int) -> str:
    return model.joint(joint).name or f"joint{joint}"


def _body_name(model: Any, body: int) -> str:
    return model.body(body).name or f"body{body}"


def _places(model: Any) -> dict[str, tuple[str, int, int]]:
    """Kind, number of joint or body, and component of each parameter that the model has, by name."""
    places: dict[str, tuple[str, int, int]] = {}
    for joint in range(model.njnt):
        for kind in _JOINT_KINDS:
            places[f"{kind} {_joint_name(model, joint)}"] = (kind, joint, 0)
    for body in range(1, model.nbody):
        if model.body_weldid[body] == 0 or model.body_mass[body] <= 0.0:
            continue
        name = _body_name(model, body)
        places[f"mass {name}"] = ("mass", body, 0)
        for kind, axes in _AXES.items():
            for component, axis in enumerate(axes):
                places[f"{kind}_{axis} {name}"] = (kind, body, component)
    return places


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    import mujoco

    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _value(model: Any, place: tuple[str, int, int]) -> float:
    kind, number, component = place
    if kind == "mass":
        return float(model.body_mass[number])
    if kind == "com":
        return float(model.body_ipos[number, component])
    if kind == "inertia":
        return float(model.body_inertia[number, component]) if component < 3 else 0.0
    return float(getattr(model, f"dof_{kind}")[model.jnt_dofadr[number]])


def parameters(spec: Any, kinds: str | Sequence[str] = ("mass", "damping", "frictionloss", "armature")) -> dict[str, Parameter]:
    """Parameters of a model as :func:`llmt.discover` takes them, by name: ``"mass link1"``, ``"damping joint1"``.

    ``kinds``: ``mass`` (centre and inertia stay as they are), ``com`` (in the frame of the body, m), ``inertia`` (about
    the centre of mass, in the axes that are principal now: xx, yy, zz, xy, xz, yz), of every moving body; ``armature``,
    ``damping``, ``frictionloss`` of every joint. Raises ValueError for another kind.
    """
    wanted = names("kinds", kinds)
    for kind in wanted:
        if kind not in _JOINT_KINDS + _BODY_KINDS:
            raise ValueError(f"kinds has {kind!r}, must be of {', '.join(_BODY_KINDS + _JOINT_KINDS)}")
    import mujoco

    model = _compiled(spec)
    result = {}
    places = _places(model)
    for kind in wanted:
        for name, place in places.items():
            if place[0] != kind:
                continue
            value = _value(model, place)
            hinge = kind in _JOINT_KINDS and int(model.jnt_type[place[1]]) == int(mujoco.mjtJoint.mjJNT_HINGE)
            units = _BODY_UNITS if kind in _BODY_KINDS else _HINGE_UNITS if hinge else _SLIDE_UNITS
            scale = 0.1 * float(np.max(model.body_inertia[place[1]])) if kind == "inertia" else 0.1 * abs(value)
            result[name] = Parameter(value, scale=scale or _SMALL[kind], unit=units[kind])
    return result


def _set(model: Any, nominal: Any, values: Mapping[str, float]) -> None:
    """Sets fields of the model: those of ``nominal``, a model that stays as it is, with the values."""
    import mujoco

    places = _places(nominal)
    unknown = [name for name in values if name not in places]
    if unknown:
        raise ValueError(f"{unknown[0]!r} is no parameter of the model; there are {', '.join(places)}")
    inertias: dict[int, np.ndarray] = {}
    for name, value in values.items():
        kind, number, component = places[name]
        if kind == "mass":
            model.body_mass[number] = value
        elif kind == "com":
            model.body_ipos[number, component] = value
        elif kind == "inertia":
            tensor = inertias.setdefault(number, np.diag(nominal.body_inertia[number]))
            a, b = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))[component]
            tensor[a, b] = tensor[b, a] = value
        else:
            getattr(model, f"dof_{kind}")[model.jnt_dofadr[number]] = value
    for body, tensor in inertias.items():
        principal, axes = np.linalg.eigh(tensor)
        axes[:, 2] *= np.linalg.det(axes)  # right-handed
        model.body_inertia[body] = principal
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, (_rotation(nominal.body_iquat[body]) @ axes).ravel())
        model.body_iquat[body] = quaternion
    model.body_sameframe[:] = 0  # no short cuts for bodies whose centre was at their origin
    model.body_simple[:] = 0


def _motion(model: Any, table: Any, position: Sequence[str] | None) -> tuple[np.ndarray, ...]:
    columns = columns_of(table, "inputs")
    chosen = list(position) if position is not None else _positions(columns)
    if len(chosen) != model.nv:
        raise ValueError(f"the model has {model.nv} joints, inputs has the positions {', '.join(chosen) or 'of none'}")
    for name in chosen:
        for column in (name, f"d{name}", f"dd{name}"):
            if column not in columns:
                raise ValueError(f"inputs has no column {column!r}; there are {', '.join(columns)}")
    return tuple(np.array([columns[prefix + name] for name in chosen], dtype=float).T for prefix in ("", "d", "dd"))


def _positions(columns: Iterable[str]) -> list[str]:
    there = list(columns)
    return [name for name in there if f"d{name}" in there and f"dd{name}" in there]


def inverse_dynamics(
    spec: Any, parameters: Mapping[str, Any] | None = None, *, position: Sequence[str] | None = None
) -> Callable[[Mapping[str, float], Any], np.ndarray]:
    """A simulation for :func:`llmt.discover`: the torques (forces of slides), rows x joints, that a motion needs.

    ``simulate(values, inputs)`` computes ``mj_inverse`` of each row, without contacts and limits; ``inputs`` has the
    positions with their velocities and accelerations, in the order of the joints (``position`` names them where it has
    other columns like that). ``simulate.jacobian(values, inputs)`` is rows x joints x parameters; the torques are
    linear in each parameter (quadratic in a centre of mass), so that a difference is exact but for rounding. Raises ValueError for parameters, columns
    or joints that do not fit.
    """
    import mujoco

    nominal = _compiled(spec)
    model = _compiled(spec)
    for unwanted in (mujoco.mjtDisableBit.mjDSBL_CONTACT, mujoco.mjtDisableBit.mjDSBL_LIMIT):
        model.opt.disableflags |= int(unwanted)
    _set(model, nominal, {name: _value(nominal, _places(nominal)[name]) for name in parameters or {} if name in _places(nominal)})
    unknown = [name for name in parameters or {} if name not in _places(nominal)]
    if unknown:
        raise ValueError(f"{unknown[0]!r} is no parameter of the model; there are {', '.join(_places(nominal))}")
    data = mujoco.MjData(model)

    def torques(values: Mapping[str, float], motion: tuple[np.ndarray, ...]) -> np.ndarray:
        _set(model, nominal, values)
        mujoco.mj_setConst(model, data)
        result = np.empty_like(motion[0])
        for row, (q, dq, ddq) in enumerate(zip(*motion)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
            mujoco.mj_inverse(model, data)
            result[row] = data.qfrc_inverse
        return result

    def simulate(values: Mapping[str, float], inputs: Any) -> np.ndarray:
        return torques(values, _motion(model, inputs, position))

    def jacobian(values: Mapping[str, float], inputs: Any) -> np.ndarray:
        motion = _motion(model, inputs, position)
        places = _places(nominal)
        columns = []
        for name, value in values.items():
            step = 0.1 * abs(_value(nominal, places[name])) or _SMALL[places[name][0]]
            back = step if places[name][0] == "com" else 0.0  # the others are linear, and may not fall below 0
            above, below = {**values, name: value + step}, {**values, name: value - back}
            columns.append((torques(above, motion) - torques(below, motion)) / (step + back))
        return np.stack(columns, axis=-1) if columns else np.empty((*motion[0].shape, 0))

    simulate.jacobian = jacobian  # type: ignore[attr-defined]
    simulate.__name__ = "inverse_dynamics"
    return simulate


def _functions() -> dict[str, Callable[..., Any]]:
    """Terms of one input x, and of a constant c, without their coefficient."""
    return {
        "linear": lambda x: x,
        "square": lambda x: x * x,
        "cube": lambda x: x**3,
        "absolute": abs,
        "sign": np.sign,
        "signed_square": lambda x: x * abs(x),
        "step": lambda x, c: float(x > c),
        "hinge": lambda x, c: max(0.0, x - c),
        "hinge_below": lambda x, c: max(0.0, c - x),
        "tanh": lambda x, c: np.tanh(x / c),
        "asinh": lambda x, c: np.arcsinh(x / c),
        "stribeck": lambda x, c: np.sign(x) * np.exp(-((x / c) ** 2)),
    }


class _Correction:
    """What is added to a model while it runs: forces, and friction that depends on the velocity."""

    def __init__(self) -> None:
        self.forces: list[tuple[int, str, int, Force]] = []  # joint it acts on, "q" or "dq", joint it depends on
        self.frictions: list[tuple[int, Force]] = []
        self.friction_base: dict[int, float] = {}

    def __bool__(self) -> bool:
        return bool(self.forces or self.frictions)

    def __call__(self, model: Any, data: Any) -> None:
        """To be called before each step, after ``qfrc_applied`` has been set."""
        for joint, what, other, force in self.forces:
            state = data.qpos if what == "q" else data.qvel
            data.qfrc_applied[joint] -= force(float(state[other]))
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


def apply(found: Missing, spec: Any) -> tuple[Any, Callable[[Any, Any], None] | None]:
    """A copy of the specification with what was found by :func:`llmt.discover` with :func:`inverse_dynamics`, and a
    callback for what has no field in it (None: nothing).

    Parameters are set. A term of the needed torque is a force that the model lacks, with the other sign. Of the joint's
    own motion: ``dq`` goes to ``damping``, ``sign(dq)`` to ``frictionloss``, ``ddq`` to ``armature``, ``q`` to
    ``stiffness``; friction that falls with speed becomes a ``frictionloss`` that the callback sets; other functions of a
    position or velocity become forces. ``callback(model, data)`` is to be called before each ``mj_step``, after
    ``qfrc_applied`` has been set. What MuJoCo cannot take (gains, shapes without a name, other terms of accelerations
    or of several inputs) is left out with a warning that names it.
    """
    question = found._question
    positions = _positions(question["input_names"])
    outputs = list(question["output_names"])
    nominal = _compiled(spec)
    if len(positions) != nominal.nv or len(outputs) != nominal.nv:
        raise ValueError(f"the model has {nominal.nv} joints, the result has {len(positions)} positions, {len(outputs)} outputs")
    fixed = spec.copy()
    joints = {joint.name: joint for joint in fixed.joints}
    spec_joints = [joints[nominal.joint(k).name] if nominal.joint(k).name in joints else fixed.joints[k] for k in range(nominal.nv)]
    _set_spec(fixed, spec_joints, nominal, _fitted(found, nominal))
    correction = _Correction()
    left_out = []
    for term in found.to_dict()["effects"]:
        values = [parameter["value"] for parameter in term["parameters"]]
        if not _add_term(term, values, positions, outputs.index(term["output"]), spec_joints, correction):
            left_out.append(f"{term['name']} of {term['location'] or 'the output'} ({term['formula']}) on {term['output']}")
    if left_out:
        warnings.warn(f"MuJoCo cannot take, left out: {'; '.join(left_out)}", stacklevel=2)
    for joint, _ in correction.frictions:
        correction.friction_base[joint] = _first(spec_joints[joint], "frictionloss")
    return fixed, correction if correction else None


def _fitted(found: Missing, nominal: Any) -> dict[str, float]:
    """Values by parameter. Of parameters that the rows do not tell apart, "a + b", the first one takes the change."""
    data = found.to_dict()
    values: dict[str, float] = {}
    places = _places(nominal)
    for parameter in data.get("parameters", data.get("simulation", [])):
        name = parameter["name"]
        first = name if name in places else name.split(" + ")[0].split(" - ")[0]
        if first not in places:
            raise ValueError(f"{name!r} is no parameter of the model; there are {', '.join(places)}")
        change = parameter.get("change")
        values[first] = parameter["value"] if change is None else _value(nominal, places[first]) + change
    return values


def _set_spec(fixed: Any, joints: Sequence[Any], nominal: Any, values: Mapping[str, float]) -> None:
    import copy

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


def _add_term(
    term: Mapping[str, Any], values: list[float], positions: list[str], joint: int, joints: Sequence[Any], correction: _Correction
) -> bool:
    """Whether MuJoCo can take the term."""
    family, place = term["name"], term["location"]
    if family == "offset":
        correction.forces.append((joint, "q", joint, lambda _: values[0]))
        return True
    function = _functions().get(family)
    own = positions[joint]
    if function is None:
        return False
    field = {
        ("linear", f"d{own}"): "damping",
        ("linear", f"dd{own}"): "armature",
        ("sign", f"d{own}"): "frictionloss",
        ("linear", own): "stiffness",
    }.get((family, place))
    if field is not None:
        is_possible = _first(joints[joint], field) + values[0] >= 0.0
        if field == "stiffness":
            is_possible = is_possible and float(joints[joint].springref) == 0.0
        if is_possible:
            _add(joints[joint], field, values[0])
            return True
    if family == "stribeck" and place == f"d{own}":
        coefficient, speed = values
        correction.frictions.append((joint, lambda v: coefficient * float(np.exp(-((v / speed) ** 2)))))
        return True
    for what, prefix in (("q", ""), ("dq", "d")):
        for other, name in enumerate(positions):
            if place == prefix + name:
                correction.forces.append(
                    (joint, what, other, lambda x: float(values[0] * function(x, *values[1:])))
                )
                return True
    return False


class Replay:
    """How far a model moves away from a log. ``rms``: of each position, in rad or m."""

    def __init__(self, time: np.ndarray, measured: np.ndarray, simulated: np.ndarray, positions: list[str]) -> None:
        self.time = time
        """In s; the rows of all windows."""
        self.measured = measured
        """Rows x positions, low-passed."""
        self.simulated = simulated
        """Rows x positions, from the measured state at the begin of each window."""
        self.rms: dict[str, float] = {
            name: float(np.sqrt(np.mean((simulated[:, k] - measured[:, k]) ** 2))) for k, name in enumerate(positions)
        }
        """Root mean square of simulated - measured."""

    def __repr__(self) -> str:
        return ", ".join(f"{name}: {value:.4g}" for name, value in self.rms.items())

    def plot(self, ax: Any = None) -> Any:
        """Draws simulated - measured of each position. Returns the axes of matplotlib, ``ax`` if it is given."""
        from llmt._results import axes_of

        ax = axes_of(ax)
        for k, name in enumerate(self.rms):
            ax.plot(self.time, self.simulated[:, k] - self.measured[:, k], label=name, linewidth=0.8)
        ax.set_xlabel("time [s]")
        ax.set_ylabel("simulated - measured")
        ax.legend()
        return ax


def replay(
    spec: Any,
    log: Any,
    *,
    position: str | Sequence[str],
    torque: str | Sequence[str],
    cutoff: float,
    time: str = "",
    rate: float | None = None,
    group: str = "",
    windows: float = 1.0,
    callback: Callable[[Any, Any], None] | None = None,
    standstill: Any = None,
) -> Replay:
    """Runs a model open loop with the measured torques, in windows of that many seconds, each from the measured state.

    The torques go to ``qfrc_applied`` as they were recorded, interpolated between samples; actuators of the model are
    off. ``callback`` as :func:`apply` returns it. The other arguments are those of :func:`llmt.signals`, which gives
    the states and the positions to compare with; ``standstill`` is accepted and not used: no row is left out.
    """
    import mujoco

    positions, torques = names("position", position), names("torque", torque)
    made = signals(
        log, position=positions, torque=torques, time=time, rate=rate, group=group, cutoff=cutoff, standstill=0.0, every=1
    )
    model = _compiled(spec)
    if len(positions) != model.nv or len(torques) != model.nv:
        raise ValueError(f"the model has {model.nv} joints, {len(positions)} positions and {len(torques)} torques are named")
    if not windows > 0.0:
        raise ValueError(f"windows is {windows}, must be above 0")
    columns = columns_of(made.table, "table")
    instants = np.array(columns[time or "t"], dtype=float)
    states = [np.array([columns[prefix + name] for name in positions], dtype=float).T for prefix in ("", "d")]
    raw = columns_of(log, "log")
    applied = np.array([np.array(raw[name], dtype=float)[made.rows] for name in torques]).T
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    step = 1.0 / made.to_dict()["rate_hz"]
    substeps = max(1, int(np.ceil(step / model.opt.timestep - 1e-9)))
    model.opt.timestep = step / substeps
    data = mujoco.MjData(model)
    friction = model.dof_frictionloss.copy()
    simulated = np.empty_like(states[0])
    length = max(1, round(windows / step))
    since = 0
    for row in range(len(instants)):
        is_new = row == 0 or since == length or not 0.0 < instants[row] - instants[row - 1] < 1.5 * step
        if is_new:
            mujoco.mj_resetData(model, data)
            model.dof_frictionloss[:] = friction
            data.qpos[:], data.qvel[:] = states[0][row], states[1][row]
            since = 0
        else:
            for k in range(substeps):
                share = (k + 0.5) / substeps
                data.qfrc_applied[:] = (1.0 - share) * applied[row - 1] + share * applied[row]
                if callback is not None:
                    callback(model, data)
                mujoco.mj_step(model, data)
        simulated[row] = data.qpos
        since += 1
    return Replay(instants, states[0], simulated, positions)
