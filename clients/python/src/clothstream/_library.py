# SPDX-License-Identifier: MIT
"""Loads libclothstream, and converts its structs."""
from __future__ import annotations

import ctypes as c
import ctypes.util
import dataclasses
import os
import pathlib
from typing import Any, Type, TypeVar

import numpy as np

from . import _bindings as b

T = TypeVar("T")


class Error(Exception):
    """Base of the package's errors. The text says what was wrong and what to do."""


def _load() -> c.CDLL:
    """Loads the library that CLOTHSTREAM_LIBRARY names, else that of the wheel, else that of the system."""
    bundled = pathlib.Path(__file__).with_name("libclothstream.so")
    path = os.environ.get("CLOTHSTREAM_LIBRARY") or (str(bundled) if bundled.exists() else ctypes.util.find_library("clothstream"))
    if path is None:
        raise ImportError("libclothstream.so was not found: install the wheel, or set CLOTHSTREAM_LIBRARY to its path")
    library = c.CDLL(path)
    for name, (result, arguments) in b.FUNCTIONS.items():
        function = getattr(library, name, None)
        if function is None:
            raise ImportError(f"{path} has no function {name}: it is of another release than this package")
        function.restype, function.argtypes = result, arguments
    return library


lib = _load()


def text(value: bytes | None) -> str:
    """Text of the library. Names come from other programs, so bytes that are not UTF-8 are replaced."""
    return (value or b"").decode("utf-8", "replace")


def new(struct: Type[T]) -> T:
    """A struct of the library, with its version if it has one."""
    made = struct()
    if hasattr(struct, "VERSION"):
        made.version = struct.VERSION  # type: ignore[attr-defined]
    return made


def vector(values: Any, size: int) -> Any:
    """A C array of floats from `size` numbers; None becomes NULL."""
    if values is None:
        return None
    numbers = [float(value) for value in values]
    if len(numbers) != size:
        raise ValueError(f"{len(numbers)} numbers; {size} are needed")
    return (c.c_float * size)(*numbers)


def _converted(value: Any) -> Any:
    if isinstance(value, bytes) or value is None:
        return text(value)
    return tuple(value) if isinstance(value, c.Array) else value


def to(kind: Type[T], struct: c.Structure, **given: Any) -> T:
    """A dataclass from the members of the same names. `given` are members that need more work."""
    members = {field.name: _converted(getattr(struct, field.name)) for field in dataclasses.fields(kind)  # type: ignore[arg-type]
               if field.name not in given}
    return kind(**members, **given)


def array(pointer: Any, shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """A view of the library's memory that cannot be written through."""
    if not pointer or 0 in shape:
        return np.empty(shape, dtype)
    view = np.ctypeslib.as_array(pointer, shape=shape)
    view.flags.writeable = False
    return view
