"""Results of the robot's tasks."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from llmt._results import Result, axes_of, html_table
from llmt._columns import frame_of, records
from llmt.robotics._robot import Robot


class RobotWarning(UserWarning):
    """What looks wrong with a robot's measurements, or was made up."""


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
        """Distance in mm between model and measurement, a row for each measured point."""
        count = len(next(iter(self._errors.values())))
        return records([{f"{name}_mm": errors[k] for name, errors in self._errors.items()} for k in range(count)])

    def _where(self) -> str:
        raise NotImplementedError

    def plot(self, ax: Any = None) -> Any:
        """Draws the error of every point under each model, the points in the order of the table. Returns the axes of
        matplotlib, ``ax`` if it is given."""
        ax = axes_of(ax)
        for name, errors in self._errors.items():
            mean = sum(errors) / len(errors)
            ax.plot(range(len(errors)), errors, ".", label=f"{name}, mean {mean:.4f} mm")
        ax.set_xlabel("measured point")
        ax.set_ylabel("position error, mm")
        ax.set_title(f"Error {self._where()}")
        ax.set_ylim(bottom=0.0)
        ax.legend()
        return ax


class Calibration(_WithRobot):
    """A calibrated robot. ``print`` shows the page of ``llmt-robot calibrate``."""

    @property
    def summary(self) -> str:
        """How far the error fell, in a sentence."""
        return self._text.split("\n", 2)[1]

    @property
    def parameters(self) -> Any:
        """``name``, ``unit``, ``value`` and ``standard_error`` of the identified parameters."""
        return records(self._data["parameters"])

    @property
    def errors(self) -> Any:
        """Position errors in mm: a row for each model and set of poses, with ``mean``, ``p95``, ``max`` and ``rms``."""
        rows = []
        for model, entry in self._data["errors"].items():
            for poses, figures in entry.items():
                if figures is not None:
                    rows.append({"model": model, "poses": poses, **figures})
        return records(rows)

    def _where(self) -> str:
        return "on poses left out of the fit" if self._data["folds"] else "on the poses fitted"

    def _html_tables(self) -> list[str]:
        rows = []
        for model, entry in self._data["errors"].items():
            for poses, figures in entry.items():
                if figures is not None:
                    rows.append([model, poses, figures["mean"], figures["p95"], figures["max"]])
        return [html_table(["model", "error on", "mean", "95 %", "largest"], rows)]


class Discovery(_WithRobot):
    """What a robot's description lacks. ``print`` shows the page of ``llmt-robot discover``."""

    def __init__(self, made: Mapping[str, Any], has_test: bool) -> None:
        super().__init__(made)
        self._has_test = has_test

    @property
    def verdict(self) -> str:
        """``nothing missing``, ``named``, ``named, indistinguishable`` or ``unknown effect``."""
        verdict: str = self._data["verdict"]
        return verdict

    @property
    def effects(self) -> Any:
        """What was found: a row for each value of an effect, with its standard error."""
        rows = []
        for effect in self._data["effects"]:
            for value in effect["parameters"]:
                rows.append(
                    {
                        "name": effect["name"],
                        "location": effect["location"],
                        "confirmed": effect["confirmed"],
                        "parameter": value["name"],
                        "value": value["value"],
                        "standard_error": value["std_error"],
                        "unit": value["unit"],
                        "rms_mm": effect["rms_mm"],
                        "share": effect["share"],
                        "rivals": ", ".join(effect["rivals"]),
                    }
                )
        return records(rows)

    @property
    def gap(self) -> dict[str, Any]:
        """Mean position errors before and after on poses that took no part, and where the error was."""
        gap: dict[str, Any] = self._data["gap"]
        return gap

    def _where(self) -> str:
        return "on the test poses" if self._has_test else "on all poses, those searched and those set aside"

    @property
    def summary(self) -> str:
        """The verdict and what was found."""
        blocks = self._text.split("\nDetails\n", 1)[0].split("\n\n")
        return blocks[1] if len(blocks) > 1 else blocks[0]

    def _html_tables(self) -> list[str]:
        effects = [
            [effect["name"], effect["location"], value["name"], value["value"], value["std_error"], value["unit"]]
            for effect in self._data["effects"]
            for value in effect["parameters"]
        ]
        gap = self._data["gap"]
        errors = [[gap["before_mm"], gap["after_mm"], gap["noise_floor_mm"], gap["heldout_poses"]]]
        return [
            html_table(["effect", "at", "parameter", "value", "standard error", "unit"], effects),
            html_table(["mean error before, mm", "after, mm", "noise, mm", "poses set aside"], errors),
        ]


class Check(_RobotResult):
    """Whether a calibrated robot is still good. ``print`` shows the page of ``llmt-robot check``."""

    def __init__(self, made: Mapping[str, Any]) -> None:
        super().__init__(made)
        self._errors: list[float] = made["errors"]

    @property
    def still_good(self) -> bool:
        """Whether the mean error is within the limit."""
        return bool(self._data["still_good"])

    def __bool__(self) -> bool:
        return self.still_good

    @property
    def summary(self) -> str:
        """Still good or not, with the error and the limit."""
        return self._text.split("\n\n")[1].split("\n", 1)[0]

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
        return records(rows)

    @property
    def poses(self) -> Any:
        """Distance in mm between model and measurement, a row for each measured point."""
        return records([{"error_mm": error} for error in self._errors])

    def plot(self, ax: Any = None) -> Any:
        """Draws the error of every point and the limit of their mean. Returns the axes of matplotlib."""
        ax = axes_of(ax)
        ax.plot(range(len(self._errors)), self._errors, ".", label=f"mean {self._data['error_mm']['mean']:.4f} mm")
        ax.axhline(self._data["limit_mm"], linestyle="--", label=f"limit of the mean {self._data['limit_mm']:.4f} mm")
        ax.set_xlabel("measured point")
        ax.set_ylabel("position error, mm")
        ax.set_title("Still good" if self.still_good else "No longer good")
        ax.set_ylim(bottom=0.0)
        ax.legend()
        return ax


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
        return records(
            [{**entry, "random_standard_error": random[entry["name"]]} for entry in self._data["chosen"]["parameters"]]
        )

    def _html_tables(self) -> list[str]:
        chosen, random = self._data["chosen"], self._data["random"]
        row = [chosen["position_error_mm"], random["position_error_mm"], self._data["bound_mm"]]
        header = ["expected error, mm", "of as many random poses", "no choice is below"]
        return [html_table(header, [row]), _html_of_csv(self._csv)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the poses as CSV."""
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self._csv)


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
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self._csv)

    def plot(self, ax: Any = None) -> Any:
        """Draws the distance of every target from the tool, with the start joints and with the commands, as the model
        has it. Returns the axes of matplotlib."""
        ax = axes_of(ax)
        ax.semilogy(self._before, ".", label="with the start joints")
        ax.semilogy(self.commands["error_mm"], ".", label="with the commands")
        ax.set_xlabel("target")
        ax.set_ylabel("distance by the model, mm")
        ax.legend()
        return ax
