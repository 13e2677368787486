"""What can be done with a robot: the commands of ``llmt-robot`` as functions.

Tables are a path or a table of any kind, see :mod:`llmt.robotics`. ``columns`` is a column map, a path or a dict of the
table's names to those here: ``{"elbow_joint": "q3_rad"}``. ``decimal_comma`` says it of files. ``progress`` is called
with (done, total, step). Ctrl-C ends a call within a second; of a million rows, reading and writing take longer and are
not interrupted. All raise ValueError for inputs that make no sense, naming table, row and column or the field of a
description.
"""

from __future__ import annotations

import json
import os
import re
import warnings as _warnings
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from llmt._files import write_text
from llmt._results import names, number
from llmt.robotics._csv import Source, frame_of, source_of
from llmt.robotics._record import record_of, source_of_columns
from llmt.robotics._results import Calibration, Check, Commands, Discovery, PoseChoice
from llmt.robotics._robot import RobotWarning, _extension, _reading, _warned
from llmt.robotics._robot import robot as _robot_of

Progress = Callable[[int, int, str], Any]

_MOST = 2**63 - 1
_LARGEST = 1.7976931348623157e308
_SMALLEST = 5e-324


def _described(arm: Any) -> Source:
    """A description as it was given: the file, or its text."""
    name: str = arm._bound.name
    return (name, None) if os.path.exists(name) else (f"<{name}>", arm.to_yaml())


def _optional(table: Any, what: str) -> Source | None:
    return None if table is None else source_of(table, what)


def _checked(source: Source, columns: Any, arm: Any) -> Source:
    """Measurements whose columns are probably those that the reader will look for. Raises ValueError for a name that is
    wrong in its case alone; warns of a coordinate that is not there."""
    if columns is not None:
        return source
    path, text = source
    if text is None:
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            text = file.readline()
    header = [name.strip().strip('"') for name in re.split(r"[,;\t]", text.split("\n", 1)[0])]
    joints = {joint["name"] for joint in arm.joints}
    for name in header:
        is_ours = re.fullmatch(r"[xyz]_(mm|m|um)|q[0-9]+_(deg|rad|mm|m|um)", name.lower())
        if is_ours and name != name.lower() and name.lower() not in header and name.rsplit("_", 1)[0] not in joints:
            raise ValueError(f'{path.strip("<>")}: column "{name}": did you mean "{name.lower()}"? Rename it')
    there = [axis for axis in "xyz" if any(f"{axis}_{unit}" in header for unit in ("mm", "m", "um"))]
    if there and len(there) < 3:
        absent = " and ".join(f"{axis}_mm" for axis in "xyz" if axis not in there)
        _warnings.warn(
            f"{path.strip('<>')}: there is no {absent}; only {' and '.join(there)} of each point are used",
            RobotWarning,
            stacklevel=3,
        )
    return source


def _common_scale(made: dict[str, Any], arm: Any) -> list[str]:
    """A remark where all identified lengths of 10 mm or more changed by one factor, of more than 0.3 % and beyond three
    standard errors: then a scale error of the instrument looks the same."""
    described = {
        f"{joint['name']}.{key}": joint[f"{key}_mm"]
        for joint in json.loads(arm._bound.json())["joints"]
        for key in ("a", "d")
        if abs(joint.get(f"{key}_mm", 0.0)) >= 10.0
    }
    lengths = [of for of in json.loads(made["json"])["parameters"] if of["name"] in described and of["standard_error"]]
    if len(lengths) < 3:
        return []
    nominal = np.array([described[of["name"]] for of in lengths])
    value = np.array([of["value"] for of in lengths])
    error = np.array([of["standard_error"] for of in lengths])
    factor = float(value @ nominal / (nominal @ nominal))
    change = np.abs((factor - 1.0) * nominal)
    is_common = (np.abs(value - factor * nominal) <= np.maximum(3.0 * error, 0.1 * change)).all()
    if not is_common or abs(factor - 1.0) <= 0.003 or change.max() <= 3.0 * error[change.argmax()]:
        return []
    return [
        f"all identified lengths are {factor:.4f} times those described: if the instrument or the unit of the "
        "measurements has a scale error, it looks the same; check the scale of x_mm, y_mm and z_mm"
    ]


def _folds(folds: Any) -> int:
    count: int = number("folds", folds, 0, 2**31 - 1, whole=True)
    if count == 1:
        raise ValueError("folds is 1, must be 0, or 2 or more")
    return count


def _write_page(report: str | os.PathLike[str] | None, made: dict[str, Any]) -> None:
    if report is not None:
        write_text(report, made["page"])


def calibrate(
    robot: Any,
    measured: Any,
    *,
    correct: bool = False,
    boost: bool = False,
    folds: int = 5,
    contiguous: bool = False,
    test: Any = None,
    new_session: bool = False,
    orientations: bool = False,
    columns: Any = None,
    decimal_comma: bool = False,
    robust: bool = False,
    fix: str | Iterable[str] = (),
    only: str | Iterable[str] = (),
    prior: Mapping[str, float] | None = None,
    max_leaves: int = 0,
    min_leaf: int = 0,
    accept_suspicion: str = "",
    limit_mm: float = 0.0,
    seed: int = 1,
    threads: int = 0,
    quality: bool = False,
    instrument: str = "",
    serial_number: str = "",
    report: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Identifies base, tool and geometry of a robot from measured positions: ``llmt-robot calibrate``.

    Parameters
    ----------
    robot, measured
        A robot, see :func:`robot`, and a table of measurements.
    correct
        Learn the residual as a function of the joint values. The correction is kept if it lowers the mean error on
        poses left out by more than two standard errors of the gain.
    boost
        Learn it with a sum of many small trees, more accurate, in place of one.
    folds, contiguous, seed
        Folds of the errors on poses left out, 0: none; blocks of consecutive rows; seed of the random folds.
    test, new_session
        Further measurements that take no part; they are of another session, whose base and tool are fitted first.
    orientations
        Use the measured orientations as well as the positions.
    robust
        Leave out readings that are more than four times as far off as the median.
    fix, only
        Parameters to keep as given; the only ones to free: ``joint2.a``, ``joint3``, ``base``, ``tool``.
    prior
        Standard deviations of what is known beforehand, mm or deg: ``{"joint2.a": 0.1}``.
    max_leaves, min_leaf
        Of a tree of the correction: most leaves, fewest poses in a leaf; 0: no limit, twice the coefficients.
    accept_suspicion
        Take the tables as they stand although they look like this mistake, by the name in the error: ``joint5_sign``.
    limit_mm
        Largest mean error to be accepted, on ``test`` or else on poses left out; 0: none. The result's ``verdict`` is
        "pass", "fail" or "not evaluated".
    threads
        0: all. The result does not depend on it.
    quality
        The result says also how well the poses determine the parameters.
    instrument, serial_number
        For the record in the description: what measured, and the robot's serial number.
    report
        HTML file to write.

    Raises
    ------
    ValueError
        Also where the calibrated robot misses half of the points by more than a fiftieth of its length; and where a
        mistake in the tables would explain them ten times better than the described robot does, such as degrees for
        radians or a joint that counts the other way: it is named, with the error that remains.
    """
    if new_session and test is None:
        raise ValueError("new_session is about test, which is not given")
    if boost and not correct:
        raise ValueError("boost is about correct, which is not asked for")
    if boost and (max_leaves or min_leaf):
        raise ValueError("max_leaves and min_leaf are of one tree, and boost asks for a sum of them")
    arguments = dict(locals())
    arm = _robot_of(robot)
    given = _checked(source_of(measured, "measured"), columns, arm)
    tested = _optional(test, "test")
    priors = {name: number(f"prior {name}", sigma, 1e-9, _LARGEST) for name, sigma in (prior or {}).items()}
    made = _extension().calibrate(
        arm._bound,
        given,
        tested,
        _reading(columns, orientations, decimal_comma),
        made_from=record_of(
            calibrate,
            arguments,
            {
                "description": _described(arm),
                "measurements": given,
                "test": tested,
                "column map": source_of_columns(columns),
            },
        ),
        correct=bool(correct),
        boost=bool(boost),
        folds=_folds(folds),
        contiguous=bool(contiguous),
        new_session=bool(new_session),
        robust=bool(robust),
        fixed=names("fix", fix),
        only=names("only", only),
        priors=priors,
        max_leaves=number("max_leaves", max_leaves, 0, 2**31 - 1, whole=True),
        min_leaf=number("min_leaf", min_leaf, 0, _MOST, whole=True),
        accept_suspicion=str(accept_suspicion),
        limit_mm=number("limit_mm", limit_mm, 0.0, _LARGEST),
        seed=number("seed", seed, 0, 2**64 - 1, whole=True),
        threads=number("threads", threads, 0, 2**31 - 1, whole=True),
        quality=bool(quality),
        page=report is not None,
        report=progress,
    )
    made["warnings"] += _common_scale(made, arm)
    _write_page(report, made)
    return Calibration(_warned(made))


def discover(
    robot: Any,
    measured: Any,
    *,
    test: Any = None,
    held_out: float = 0.2,
    folds: int = 0,
    contiguous: bool = False,
    orientations: bool = False,
    columns: Any = None,
    decimal_comma: bool = False,
    catalogue: Any = None,
    mass_uncertainty: float = 0.05,
    accept_suspicion: str = "",
    seed: int = 1,
    instrument: str = "",
    serial_number: str = "",
    report: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Discovery:
    """Finds, names and adds the physical effects that a description lacks: ``llmt-robot discover``.

    Parameters
    ----------
    robot, measured
        A robot, see :func:`robot`, and a table of measurements.
    test, held_out
        Measurements that take no part until the end. Without them everything is done once more without this share of
        the poses, drawn by ``seed``, to state the error there; names and robot are those of all poses.
    folds, contiguous
        Repeats the whole discovery without each fold and judges it on that fold, 0: does not; blocks of rows.
    orientations
        Use the measured orientations as well as the positions.
    catalogue
        Effects to look for and their plausible sizes: a YAML file, or a dict with its keys.
    mass_uncertainty
        Relative standard deviation of the described masses.
    accept_suspicion, instrument, serial_number
        As in :func:`calibrate`.
    report
        HTML file to write.

    Raises
    ------
    ValueError
        Also where the calibrated robot misses the points by so much that no effect explains it, and where a mistake in
        the tables explains them, as in :func:`calibrate`.
    """
    arguments = dict(locals())
    arm = _robot_of(robot)
    effects = source_of_columns(catalogue)
    given = _checked(source_of(measured, "measured"), columns, arm)
    tested = _optional(test, "test")
    made = _extension().discover(
        arm._bound,
        given,
        tested,
        _reading(columns, orientations, decimal_comma),
        made_from=record_of(
            discover,
            arguments,
            {
                "description": _described(arm),
                "measurements": given,
                "test": tested,
                "catalogue": effects,
                "column map": source_of_columns(columns),
            },
        ),
        held_out=number("held_out", held_out, 0.0, 0.9),
        folds=_folds(folds),
        contiguous=bool(contiguous),
        catalogue=effects,
        mass_uncertainty=number("mass_uncertainty", mass_uncertainty, 0.0, 1.0),
        accept_suspicion=str(accept_suspicion),
        seed=number("seed", seed, 0, 2**64 - 1, whole=True),
        page=report is not None,
        report=progress,
    )
    _write_page(report, made)
    return Discovery(_warned(made), test is not None)


def check(
    robot: Any,
    measured: Any,
    *,
    same_session: bool = False,
    accuracy_mm: float | None = None,
    level: float = 0.05,
    columns: Any = None,
    decimal_comma: bool = False,
) -> Check:
    """Is a calibrated robot still good, and what of it moved? ``llmt-robot check``.

    Parameters
    ----------
    robot, measured
        A robot that was calibrated, and new measurements.
    same_session
        Instrument and target stand where they stood at the calibration; else base and tool are fitted first.
    accuracy_mm
        Mean error up to which the robot is good; by default that of the calibration on poses left out, times 1.1 or
        with 2.33 standard errors added.
    level
        Probability that something is said to have moved although nothing has.
    """
    arm = _robot_of(robot)
    if "identified" not in arm.to_dict():
        raise ValueError("the robot was not calibrated; calibrate it first: check(calibrate(arm, measured).robot, new)")
    made = _extension().check(
        arm._bound,
        _checked(source_of(measured, "measured"), columns, arm),
        _reading(columns, False, decimal_comma),
        same_session=bool(same_session),
        accuracy_mm=None if accuracy_mm is None else number("accuracy_mm", accuracy_mm, _SMALLEST, _LARGEST),
        level=number("level", level, 1e-6, 0.5),
        report=None,
    )
    return Check(_warned(made))


def poses(
    robot: Any,
    *,
    count: int = 40,
    candidates: Any = None,
    measured: Any = None,
    use: Any = None,
    box: Iterable[float] = (),
    tool: Iterable[float] = (),
    spacing: float = 5.0,
    criterion: str = "position",
    noise_um: float = 50.0,
    fix: str | Iterable[str] = (),
    only: str | Iterable[str] = (),
    columns: Any = None,
    decimal_comma: bool = False,
    seed: int = 1,
    progress: Progress | None = None,
) -> PoseChoice:
    """Chooses the poses to measure for a calibration: ``llmt-robot poses``.

    Parameters
    ----------
    count
        Number of poses.
    candidates, measured, use
        Tables of poses: to choose from (by default all within the joint limits and the box), measured already, and at
        which the arm will be used.
    box
        x_low, x_high, y_low, y_high, z_low, z_high of the tool point in the frame of the robot's base, mm.
    tool
        x, y, z of the measured point on the flange, mm; by default the tool of the description.
    spacing
        Degrees by which two poses differ in at least one joint.
    criterion
        What is made best: ``position``, or an observability index, ``O1`` ... ``O5``.
    noise_um
        Standard deviation of each measured coordinate, in micrometres.
    fix, only
        As for :func:`calibrate`.
    """
    arm = _robot_of(robot)
    numbers = {}
    for what, values, size in (("box", box, 6), ("tool", tool, 3)):
        numbers[what] = [number(what, value, -_LARGEST, _LARGEST) for value in values]
        if numbers[what] and len(numbers[what]) != size:
            raise ValueError(f"{what} has {len(numbers[what])} numbers, must have {size}")
    made = _extension().poses(
        arm._bound,
        _reading(columns, False, decimal_comma),
        count=number("count", count, 1, 1000, whole=True),
        candidates=_optional(candidates, "candidates"),
        measured=_optional(measured, "measured"),
        use=_optional(use, "use"),
        **numbers,
        spacing=number("spacing", spacing, 0.0, 179.0),
        criterion=criterion,
        noise_um=number("noise_um", noise_um, _SMALLEST, _LARGEST),
        fixed=names("fix", fix),
        only=names("only", only),
        seed=number("seed", seed, 0, 2**64 - 1, whole=True),
        report=progress,
    )
    return PoseChoice(_warned(made))


def compensate(
    robot: Any,
    targets: Any,
    *,
    nominal: Any = None,
    nominal_frames: bool = False,
    frame: str = "world",
    position_only: bool = False,
    tolerance_um: float = 0.001,
    columns: Any = None,
    decimal_comma: bool = False,
    progress: Progress | None = None,
) -> Commands:
    """Joint commands that bring the real arm where it is asked to be: ``llmt-robot compensate``.

    Parameters
    ----------
    robot
        The arm as it is: what :func:`calibrate` or :func:`discover` made.
    targets
        Tool poses (``x_mm``, ``y_mm``, ``z_mm``, with ``qw`` ... ``qz`` or ``rx_deg`` ... where the orientation
        counts); or joint values alone with ``nominal``: then the poses that the nominal arm has there. Joint values
        beside a pose are the start, whose branch is kept.
    nominal, nominal_frames
        The description that the controller goes by; its base and tool hold as well.
    frame
        What poses refer to: ``world``, the frame of the instrument, or ``base``, that of the robot.
    position_only
        Orientations do not count.
    tolerance_um
        Distance within which a target counts as reached, in micrometres.

    Targets that cannot be reached are named in a warning; their row has the nearest command.
    """
    if frame not in ("world", "base"):
        raise ValueError(f"frame is {frame!r}, must be 'world' or 'base'")
    arm = _robot_of(robot)
    made = _extension().compensate(
        arm._bound,
        source_of(targets, "targets"),
        None if nominal is None else _robot_of(nominal)._bound,
        _reading(columns, False, decimal_comma),
        in_base_frame=frame == "base",
        nominal_frames=bool(nominal_frames),
        position_only=bool(position_only),
        tolerance_um=number("tolerance_um", tolerance_um, _SMALLEST, _LARGEST),
        report=progress,
    )
    return Commands(_warned(made))


def simulate(robot: Any, poses: Any = 200, *, noise_um: float = 0.0, seed: int = 1, decimal_comma: bool = False) -> Any:
    """Measurements of a robot that is not there, as a table: ``llmt-robot simulate``.

    ``poses`` is the number of random poses within the joint limits, or a table with joint values and covariates;
    ``noise_um`` the standard deviation of each coordinate, in micrometres.
    """
    arm = _robot_of(robot)
    is_count = isinstance(poses, int) or hasattr(poses, "item") and not hasattr(poses, "__len__")
    made = _extension().simulate(
        arm._bound,
        number("poses", poses, 1, 1_000_000, whole=True) if is_count else 1,
        None if is_count else source_of(poses, "poses"),
        _reading(None, False, decimal_comma),
        noise_um=number("noise_um", noise_um, 0.0, _LARGEST),
        seed=number("seed", seed, 0, 2**64 - 1, whole=True),
    )
    return frame_of(_warned(made)["csv"])


def export(
    robot: Any,
    form: str,
    *,
    nominal: Any = None,
    origins: Any = None,
    name: str = "robot",
    zeros: bool = False,
    session: str = "",
    target: str = "",
) -> Any:
    """The arm for a controller: ``llmt-robot export``.

    ``form`` is ``"c"``: C99 source and header (two texts), whose names begin with ``name``; ``"kinematics"``: YAML with
    the pose of each joint, with the names and the places on the axes that the joints of the arm ``origins`` have, if
    given; or ``"deltas"``: CSV with the differences of the Denavit-Hartenberg parameters from those of
    ``nominal``, with ``zeros`` of the joints' zeros alone. Where the robot has more than the table holds, that is fitted
    anew to the whole model, and a warning says how far the tool is off without the rest. ``session`` and ``target``:
    whose base and tool, where the robot was calibrated with several.
    """
    arm = _robot_of(robot)
    if form not in ("c", "kinematics", "deltas"):
        raise ValueError(f"form is {form!r}, must be 'c', 'kinematics' or 'deltas'")
    if (nominal is None) != (form != "deltas"):
        raise ValueError(
            "the form 'deltas' needs the described arm: export(robot, 'deltas', nominal=arm)"
            if form == "deltas"
            else f"nominal is for the form 'deltas' alone, and form is {form!r}: leave nominal out"
        )
    if origins is not None and form != "kinematics":
        raise ValueError(f"origins is for the form 'kinematics' alone, and form is {form!r}: leave origins out")
    if zeros and form != "deltas":
        raise ValueError(f"zeros is for the form 'deltas' alone, and form is {form!r}: leave zeros out")
    if form == "c":
        made = _warned(_extension().export_c(arm._bound, name, str(session), str(target)))
        return made["source"], made["header"]
    made = _extension().export_geometry(
        arm._bound,
        None if nominal is None else _robot_of(nominal)._bound,
        None if origins is None else _robot_of(origins)._bound,
        bool(zeros),
        str(session),
        str(target),
    )
    return _warned(made)["text"]
