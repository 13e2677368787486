"""Models and streams as plain objects whose state is JSON text."""

import json
import os
from typing import TYPE_CHECKING, Any, ClassVar

from . import _core
from ._files import write_text

if TYPE_CHECKING:
    from typing_extensions import Self


class TextModel:
    """A fitted model whose whole state is the JSON text that `llmt fit -o` writes and `llmt predict` reads, so that it can
    be pickled, copied and sent to other processes.

    Parameters
    ----------
    text : str
        What `to_json` returned, or the content of a model file.

    Raises
    ------
    ValueError
        If the text is no such model; the message names the place in the text.
    """

    _type: ClassVar[Any]

    def __init__(self, text: str) -> None:
        self._text: str | None = text
        self._handle: Any = self._type(text)

    @classmethod
    def of_handle(cls, handle: Any) -> "Self":
        """A model that is a C++ object already. Its text, which may be long, is written when it is asked for."""
        model = cls.__new__(cls)
        model._text = None
        model._handle = handle
        return model

    def __getstate__(self) -> dict[str, str]:
        return {"text": self._whole_text()}

    def __setstate__(self, state: dict[str, str]) -> None:
        self._text = state["text"]
        self._handle = None

    @property
    def handle(self) -> Any:
        """The C++ object; made from the text when it is asked for."""
        if self._handle is None:
            self._handle = self._type(self._text)
        return self._handle

    def _whole_text(self) -> str:
        if self._text is None:
            self._text = self._handle.to_json()
        return self._text

    def to_json(self) -> str:
        """The model as JSON text."""
        return self._whole_text()

    def to_dict(self) -> dict[str, Any]:
        """The members of the JSON text."""
        parsed: dict[str, Any] = json.loads(self._whole_text())
        return parsed

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes the file that `llmt predict` reads. A failed write leaves an old file as it was."""
        write_text(path, self._whole_text())

    @classmethod
    def load(cls, path: "str | os.PathLike[str]") -> "Self":
        """Reads a model file."""
        with open(path, encoding="utf-8") as file:
            text = file.read()
        try:
            return cls(text)
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}: {error}") from None

    def __repr__(self) -> str:
        inputs = [column["name"] for column in self.handle.inputs()]
        return f"<llmt.{type(self).__name__} {', '.join(self.handle.outputs())} from {', '.join(inputs)}>"


class Model(TextModel):
    """A tree with a linear equation in every leaf, and the intervals that were made with it."""

    _type = _core.Model

    def to_json(self, intervals: bool = True) -> str:
        """The model as JSON text; `intervals`: with what prediction intervals need."""
        text: str = self._whole_text() if intervals else self.handle.without_intervals()
        return text

    def to_dict(self) -> dict[str, Any]:
        """The members of the JSON text, without those of the intervals."""
        parsed: dict[str, Any] = json.loads(self.to_json(intervals=False))
        return parsed


class BoostedModel(TextModel):
    """A sum of many small trees for each target."""

    _type = _core.BoostedModel


class StreamModel:
    """A tree that learns from rows as they come. Its state is JSON text when it is pickled.

    Threads may share it: the C++ object takes one call after the other.
    """

    _text: str = ""  # of a copy() whose C++ object nobody has asked for

    def __init__(self, inputs: int, outputs: int, options: dict[str, Any]) -> None:
        self._handle = _core.Stream(inputs, outputs, options)
        self.options = options

    @property
    def handle(self) -> Any:
        """The C++ object."""
        if "_handle" not in self.__dict__:  # of two threads that make it, both take the one that came first
            self.__dict__.setdefault("_handle", _core.Stream.from_json(self._text))
        return self._handle

    def copy(self) -> "StreamModel":
        """The stream as it is now, which learns nothing of what this one learns later."""
        copy = StreamModel.__new__(StreamModel)
        copy._text = self.handle.to_json()
        copy.options = self.options
        return copy

    def __getstate__(self) -> dict[str, Any]:
        text = self._text if "_handle" not in self.__dict__ else self._handle.to_json()
        return {"text": text, "options": self.options}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._handle = _core.Stream.from_json(state["text"])
        self.options = state.get("options", {})
