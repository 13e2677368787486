"""Results of the robot's tasks."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from llmt._files import write_text
from llmt._frames import table_of
from llmt._results import Findings, Result, axes_of, document_tables, draw_points, html_table
from llmt.robotics._csv import frame_of
from llmt.robotics._robot import Robot, RobotWarning

__all__ = ["Calibration", "Check", "Commands", "Discovery", "PoseChoice", "RobotWarning"]


def _draw_errors(ax: Any, errors: Mapping[str, Any], title: str, lines: Mapping[str, float] = {}) -> Any:
    count = len(next(iter(errors.values())))
    ax = draw_points(ax, range(count), errors, x="measured point", y="position error, mm", title=title, lines=lines)
    return _with_legend_above(ax, [*(error for of in errors.values() for error in of), *lines.values()])


def _with_legend_above(ax: Any, values: Iterable[float], lines: int = 2) -> Any:
    ax.set_ylim(0.0, (1.1 + 0.12 * lines) * max(values) or None)
    ax.legend(loc="upper right")
    return ax


class _RobotResult(Result):
    def __init__(self, made: Mapping[str, Any]) -> None:
        data = json.loads(made["json"])
        for key in ("robot", "data"):  # a table in memory has the name of its argument
            if isinstance(data.get(key), str):
                data[key] = data[key].strip("<>")
        super().__init__(made["text"], data)
        self.warnings: list[str] = made["warnings"]


class _WithRobot(_RobotResult):
    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self.robot = Robot._of(made["robot"])
        self._errors: dict[str, list[float]] = made["errors"]

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """``robot.save(path)``."""
        return self.robot.save(path)

    @property
    def poses(self) -> Any:
        """Distance in mm between model and measurement under each model, a row for each measured point."""
        count = len(next(iter(self._errors.values())))
        return table_of([{f"{name}_mm": errors[k] for name, errors in self._errors.items()} for k in range(count)])

    def _where(self) -> str:
        raise NotImplementedError

    def plot(self, ax: Any = None) -> Any:
        """Draws the errors of ``poses`` in the order of the table. Returns the axes of matplotlib, ``ax`` if it is
        given."""
        count = len(next(iter(self._errors.values())))
        errors = {f"{name}, mean {sum(of) / count:.4f} mm": of for name, of in self._errors.items()}
        return _draw_errors(ax, errors, f"Error {self._where()}")


class Calibration(_WithRobot):
    """A calibrated robot. ``print`` shows the page of ``llmt-robot calibrate``."""

    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self._document = json.loads(made["document"])

    @property
    def summary(self) -> str:
        """How far the error fell, in a sentence."""
        answer: str = self._document["answer"]
        return answer

    @property
    def verdict(self) -> str | None:
        """Of the limit that was asked about: "pass", "fail" or "not evaluated"; None without ``limit_mm``."""
        limit = self._data.get("limit")
        return None if limit is None else str(limit["verdict"])

    @property
    def parameters(self) -> Any:
        """``name``, ``unit``, ``value`` and ``standard_error`` of the identified parameters."""
        return table_of(self._data["parameters"])

    @property
    def errors(self) -> Any:
        """Position errors in mm: a row for each model and set of poses, with ``mean``, ``p95``, ``max`` and ``rms``."""
        rows = []
        for model, entry in self._data["errors"].items():
            for poses, figures in entry.items():
                if figures is not None:
                    rows.append({"model": model, "poses": poses, **figures})
        return table_of(rows)

    def _where(self) -> str:
        return "on poses left out of the fit" if self._data["folds"] else "on the poses fitted"

    def _html_tables(self) -> list[str]:
        return document_tables(self._document)


class Discovery(_WithRobot, Findings):
    """What a robot's description lacks. ``print`` shows the page of ``llmt-robot discover``."""

    _of_effect = ("name", "location", "confirmed")
    _sizes = ("rms_mm", "share")
    _titles = {"name": "effect", "location": "at"}

    def __init__(self, made: Mapping[str, Any], has_test: bool) -> None:
        super().__init__(made)
        self._has_test = has_test
        self._set_aside: list[bool] = made["set_aside"]

    @property
    def poses(self) -> Any:
        """Distance in mm between the measurement and the model ``before`` and ``after``, a row for each measured point.
        ``set_aside``: the errors are those of the models that were made without this point. With test poses the rows
        are theirs, and all are set aside."""
        count = len(self._errors["before"])
        aside = self._set_aside or [True] * count
        rows = zip(self._errors["before"], self._errors["after"], aside, strict=True)
        return table_of([{"before_mm": before, "after_mm": after, "set_aside": of} for before, after, of in rows])

    def plot(self, ax: Any = None) -> Any:
        """Draws the errors of ``poses`` in the order of the table: points searched pale, those set aside in full
        colour, with the means that the page gives. Returns the axes of matplotlib, ``ax`` if it is given."""
        if not any(self._set_aside):
            return super().plot(ax)
        ax = axes_of(ax)
        rows = np.arange(len(self._set_aside))
        aside = np.array(self._set_aside)
        for place, (name, of) in enumerate(self._errors.items()):
            errors = np.array(of)
            colour = f"C{place}"
            label = f"{name}, set aside, mean {errors[aside].mean():.4f} mm"
            ax.plot(rows[~aside], errors[~aside], ".", color=colour, alpha=0.25, label=f"{name}, searched")
            ax.plot(rows[aside], errors[aside], "o", markersize=4, color=colour, label=label)
        ax.set(xlabel="measured point", ylabel="position error, mm", title="Points searched, and set aside")
        return _with_legend_above(ax, [error for of in self._errors.values() for error in of], lines=4)

    def _where(self) -> str:
        return "on the test poses" if self._has_test else "on all poses; none were set aside"

    @property
    def summary(self) -> str:
        """The verdict and what was found."""
        blocks = self._text.split("\nDetails\n", 1)[0].split("\n\n")
        return blocks[1] if len(blocks) > 1 else blocks[0]

    def _html_tables(self) -> list[str]:
        gap = self._data["gap"]
        errors = [[gap["before_mm"], gap["after_mm"], gap["noise_floor_mm"], gap["heldout_poses"]]]
        return [
            self._effects_html(),
            html_table(["mean error before, mm", "after, mm", "noise, mm", "poses set aside"], errors),
        ]


class Check(_RobotResult):
    """Whether a calibrated robot is still good. ``print`` shows the page of ``llmt-robot check``."""

    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self._summary: str = made["summary"]
        self._errors: list[float] = made["errors"]

    @property
    def verdict(self) -> str:
        """"still good"; "moved, within limits"; "no longer good"."""
        return str(self._data["verdict"])

    @property
    def still_good(self) -> bool:
        """Whether the mean error is within the limit."""
        return bool(self._data["still_good"])

    @property
    def bad(self) -> Any:
        """Readings that the others contradict, which were left out: line and distance in mm."""
        return table_of(self._data["bad"], ["line", "error_mm"])

    def __bool__(self) -> bool:
        return self.still_good

    @property
    def summary(self) -> str:
        """Still good or not, with the error and the limit."""
        return self._summary

    def _html_tables(self) -> list[str]:
        rows = [
            [moved["name"], change["parameter"], change["by"], change["standard_error"], change["unit"]]
            for moved in self._data["moved"]
            for change in moved["changes"]
        ]
        return [html_table(["moved", "parameter", "by", "standard error", "unit"], rows)]

    @property
    def moved(self) -> Any:
        """What is not where the calibration found it: a row for each change."""
        rows = [
            {"name": moved["name"], **change, "probability": moved["probability"]}
            for moved in self._data["moved"]
            for change in moved["changes"]
        ]
        return table_of(rows, ["name", "parameter", "by", "standard_error", "unit", "probability"])

    @property
    def poses(self) -> Any:
        """Distance in mm between model and measurement, a row for each point that was not left out."""
        return table_of([{"error_mm": error} for error in self._errors])

    def plot(self, ax: Any = None) -> Any:
        """Draws the error of every point and the limit of their mean. Returns the axes of matplotlib."""
        errors = {f"mean {self._data['error_mm']['mean']:.4f} mm": self._errors}
        limit = self._data["limit_mm"]
        title = self.verdict.capitalize()
        return _draw_errors(ax, errors, title, {f"limit of the mean {limit:.4f} mm": limit})


def _html_of_csv(text: str, most: int = 20) -> str:
    """The first rows of a table of numbers and words."""
    header, *rows = [line.split(",") for line in text.splitlines()]
    return html_table(header, [[_rounded(cell) for cell in row] for row in rows[:most]])


def _rounded(cell: str) -> Any:
    try:
        return float(cell)
    except ValueError:
        return cell


class PoseChoice(_RobotResult):
    """Poses to measure. ``print`` shows the page of ``llmt-robot poses``."""

    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self._csv: str = made["csv"]

    @property
    def poses(self) -> Any:
        """The poses in the order to drive, with the columns ``q1_deg``, ... (``q3_mm`` of a prismatic joint)."""
        return frame_of(self._csv)

    @property
    def parameters(self) -> Any:
        """The standard error that a calibration is expected to leave of every parameter, with these poses and with
        random ones."""
        random = {entry["name"]: entry["standard_error"] for entry in self._data["random"]["parameters"]}
        return table_of(
            [{**entry, "random_standard_error": random[entry["name"]]} for entry in self._data["chosen"]["parameters"]]
        )

    def _html_tables(self) -> list[str]:
        chosen, random = self._data["chosen"], self._data["random"]
        row = [chosen["position_error_mm"], random["position_error_mm"], self._data["bound_mm"]]
        header = ["expected error, mm", "of as many random poses", "no choice is below"]
        return [html_table(header, [row]), _html_of_csv(self._csv)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the poses as CSV."""
        write_text(path, self._csv)


class Commands(_RobotResult):
    """Joint commands for targets. ``print`` shows what ``llmt-robot compensate`` says of them."""

    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self._csv: str = made["csv"]
        self._before: list[float] = made["before_mm"]

    @property
    def commands(self) -> Any:
        """The joint values under the names and in the units of the targets, with ``error_mm``, ``outcome`` and
        ``covered``."""
        return frame_of(self._csv)

    def _html_tables(self) -> list[str]:
        return [_html_of_csv(self._csv)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the commands as CSV."""
        write_text(path, self._csv)

    def plot(self, ax: Any = None) -> Any:
        """Draws the distance of every target from the tool, with the start joints and with the commands, as the model
        has it. Returns the axes of matplotlib."""
        distances = {"with the start joints": self._before, "with the commands": self.commands["error_mm"]}
        ax = draw_points(
            ax, range(len(self._before)), distances, x="target", y="distance by the model, mm", title="By the model"
        )
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(ax.get_ylim()[0], 1e-6))  # 1e-6 mm: below is rounding
        return ax
