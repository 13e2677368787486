"""python3 docs/site/python_api.py FOLDER: the reference of the package llmt from its docstrings, by pdoc."""

import inspect
import sys
from importlib import import_module
from pathlib import Path

import pdoc

MODULES = [
    "llmt",
    "llmt.dask",
    "llmt.distributed",
    "llmt.export",
    "llmt.mujoco",
    "llmt.robotics",
    "llmt.samples",
]


def own_what_is_inherited(cls: type) -> None:
    """Members that a class has from classes of the package nobody sees are documented as its own."""
    for base in cls.__mro__[1:]:
        for name, member in vars(base).items():
            if base.__module__.startswith("llmt.") and not name.startswith("_") and name not in vars(cls):
                setattr(cls, name, member)


for name in MODULES:
    module = import_module(name)
    for public in getattr(module, "__all__", []):
        member = getattr(module, public)
        if inspect.isclass(member):
            own_what_is_inherited(member)
pdoc.render.configure(docformat="numpy")
pdoc.pdoc(*MODULES, output_directory=Path(sys.argv[1]))
