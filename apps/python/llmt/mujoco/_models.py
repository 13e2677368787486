"""Torques that a model needs for a motion, and its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from llmt._given import Parameter
from llmt._results import names
from llmt.tables.named import columns_of

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


def parameters(
    spec: Any, kinds: str | Sequence[str] = ("mass", "damping", "frictionloss", "armature")
) -> dict[str, Parameter]:
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
    _set(
        model,
        nominal,
        {name: _value(nominal, _places(nominal)[name]) for name in parameters or {} if name in _places(nominal)},
    )
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
