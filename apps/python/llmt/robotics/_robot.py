"""A robot's description, and where it puts its tool."""

from __future__ import annotations

import errno
import html
import json
import os
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from llmt._results import html_table
from llmt.robotics._csv import Source, frame_of, source_of


class RobotWarning(UserWarning):
    """What looks wrong with a robot's measurements, was made up, or is not in a file."""


def _extension() -> Any:
    from llmt import _core

    if not hasattr(_core, "Robot"):
        raise ImportError("llmt.robotics: this package was built without the robot layer")
    return _core


def _reading(columns: Any, orientations: bool = False, decimal_comma: bool = False) -> Any:
    source: Source | None = None
    if isinstance(columns, Mapping):
        whole = columns if isinstance(columns.get("columns"), Mapping) else {"columns": dict(columns)}
        source = ("<columns>", json.dumps(whole))
    elif columns is not None:
        source = (os.fspath(columns), None)
    return _extension().Reading(source, bool(orientations), bool(decimal_comma))


def _warned(made: dict[str, Any]) -> dict[str, Any]:
    for sentence in made["warnings"]:
        warnings.warn(sentence, RobotWarning, stacklevel=3)
    return made


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"the description has {value!r}, a {type(value).__name__}")


def _bound_of(source: Any, base_link: str, tip_link: str) -> Any:
    bound = _extension().Robot
    if isinstance(source, Mapping):
        return bound.parse_yaml(json.dumps(source, default=_plain), "robot")
    if isinstance(source, os.PathLike):
        source = os.fspath(source)
    if not isinstance(source, str):
        raise TypeError(
            f"a robot is a Robot, a path, a text or a dict, not {type(source).__name__}; the robot is the first argument, "
            "the table the second"
        )
    if source.lstrip().startswith("<"):
        return bound.parse_urdf(source, "robot.urdf", base_link, tip_link)
    if "\n" in source or source.lstrip().startswith("{"):
        return bound.parse_yaml(source, "robot")
    if not os.path.exists(source):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), source)
    return bound.read(source, base_link, tip_link)


class Robot:
    """A robot: its geometry, effects and correction.

    Parameters
    ----------
    source : path, str or dict
        A URDF (a file that ends with ``.urdf``, or its text), a description in YAML (a file or its text), or a dict
        with the keys of the YAML. A path is a text without a line break.
    base_link, tip_link : str
        Which part of a URDF is the arm; by default all between the root and the end of the only chain.

    Raises
    ------
    ValueError
        The description makes no sense; the message names file, line and field.
    """

    def __init__(self, source: Any, *, base_link: str = "", tip_link: str = "") -> None:
        self._take(_bound_of(source, base_link, tip_link))

    def _take(self, bound: Any) -> None:
        self._state = (bound.yaml(), bound.name, bound.correction(), bound.urdf)
        self._bound = bound

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, base_link: str = "", tip_link: str = "") -> Robot:
        """Reads a URDF or a description in YAML, with the correction beside it."""
        return cls(os.fspath(path), base_link=base_link, tip_link=tip_link)

    @classmethod
    def _of(cls, bound: Any) -> Robot:
        made = cls.__new__(cls)
        made._take(bound)
        return made

    def __getstate__(self) -> tuple[Any, ...]:
        return self._state

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        yaml, name, correction, urdf = state
        self._state = state
        self._bound = _extension().Robot.parse_yaml(yaml, name, correction, urdf)

    @property
    def name(self) -> str:
        """What the description calls the robot."""
        title: str = self._bound.title()
        return title

    @property
    def joints(self) -> list[dict[str, Any]]:
        """``name``, ``type``, ``unit``, ``limits`` (low, high, or None) and ``driven`` of every joint."""
        joints: list[dict[str, Any]] = self._bound.joints()
        return joints

    def to_yaml(self) -> str:
        """The description as text. A correction is not in it: ``save`` writes it beside the file."""
        return str(self._state[0])

    def to_dict(self) -> dict[str, Any]:
        """The description with the keys of the YAML; numbers are the same to the last bit."""
        description: dict[str, Any] = json.loads(self._bound.json())
        return description

    def to_urdf(self) -> str:
        """The URDF that the robot was read from, with the identified origins of the joints and, where a fixed joint
        holds the tip, the identified tool. Raises ValueError for a robot that was read from no URDF."""
        text: str = self._bound.to_urdf()
        return text

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Writes the description and, beside it, the correction if there is one. For a path that ends with ``.urdf``
        writes the URDF too; the description, which has everything, stands beside it as YAML. Returns the names of the
        files, which are all replaced or none; a RobotWarning says what the URDF itself does not hold. Read the YAML to have
        everything again."""
        target = os.fspath(path)
        stem = os.path.splitext(target)[0]
        yaml = stem + ".yaml" if target.endswith(".urdf") else target
        names: list[str] = self._bound.save(target, yaml, stem + ".correction.json")
        if target.endswith(".urdf"):
            description = self.to_dict()
            left_out = [f"{len(self._effects())} effects"] if self._effects() else []
            left_out += ["the frame of the base"] if any(np.ravel(list(description["base"].values()))) else []
            left_out += ["the correction"] if self._state[2] else []
            if left_out:
                warnings.warn(
                    f"{target} holds the geometry only; {', '.join(left_out)}: in {yaml}, load that",
                    RobotWarning,
                    stacklevel=2,
                )
        return names

    def forward(self, q: Any) -> Any:
        """Where the robot puts its tool: ``predict(self, q)``. ``q`` is a table with a column for every joint, as
        ``q1_deg`` or ``q1_rad``; a dict of numbers is one pose."""
        if isinstance(q, Mapping):
            q = {name: [value] if np.ndim(value) == 0 else value for name, value in q.items()}
        return predict(self, q)

    def _effects(self) -> list[dict[str, Any]]:
        effects: list[dict[str, Any]] = self.to_dict().get("effects", [])
        return effects

    def __repr__(self) -> str:
        joints = self.joints
        lines = [f"{self.name}: {len(joints)} joints, {len(self._effects())} effects"]
        if record := self.to_dict().get("calibration"):
            lines[0] += f", calibrated by {record['poses']} poses"
        if self._state[2] is not None:
            lines[0] += ", with a correction"
        for joint in joints:
            low_high = "no limits" if joint["limits"] is None else "{:g} ... {:g}".format(*joint["limits"])
            lines.append(f"  {joint['name']}: {joint['type']}, {low_high} {joint['unit']}")
        lines += [f"  {effect['type']} at {effect.get('at', 'the whole arm')}" for effect in self._effects()]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        head = html.escape(repr(self).split("\n", 1)[0])
        rows = [[joint["name"], joint["type"], *(joint["limits"] or ("", "")), joint["unit"]] for joint in self.joints]
        effects = [[effect["type"], effect.get("at", "")] for effect in self._effects()]
        tables = html_table(["joint", "type", "low", "high", "unit"], rows) + html_table(["effect", "at"], effects)
        return f"<div><p>{head}</p>{tables}</div>"


def robot(source: Any, *, base_link: str = "", tip_link: str = "") -> Robot:
    """The robot of a URDF or YAML file, of the text of one, or of a dict; see :class:`Robot`. A robot is itself."""
    return source if isinstance(source, Robot) else Robot(source, base_link=base_link, tip_link=tip_link)


def predict(
    robot: Any, poses: Any, *, as_measured: bool = False, columns: Any = None, decimal_comma: bool = False
) -> Any:
    """Where a robot puts its tool, as a table: ``llmt-robot predict``.

    ``poses`` is a table with joint values and the covariates of the effects. The result has the joint values under the
    same names, ``x_mm``, ``y_mm``, ``z_mm`` and the orientation. With ``as_measured`` errors of the instrument and its
    session stay in: what would be read, not where the tool is.
    """
    arm = robot if isinstance(robot, Robot) else Robot(robot)
    made = _extension().predict(
        arm._bound, source_of(poses, "poses"), _reading(columns, False, decimal_comma), as_measured=bool(as_measured)
    )
    return frame_of(_warned(made)["csv"])
