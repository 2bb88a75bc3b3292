"""The JSON of the interface as dataclasses: names that a class does not have stay in ``to_dict()`` alone."""

from __future__ import annotations

import dataclasses
import functools
import types
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


@functools.cache
def _hints(cls: type[Any]) -> dict[str, Any]:
    return get_type_hints(cls)


def decode(cls: type[T], value: dict[str, Any]) -> T:
    """An instance of a dataclass from an object."""
    hints = _hints(cls)
    given: dict[str, Any] = {}
    for field in dataclasses.fields(cls):  # pyright: ignore[reportArgumentType]
        if not field.init:
            continue
        name = field.metadata.get("json", field.name)
        if name in value:
            given[field.name] = _as(hints[field.name], value[name])
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            given[field.name] = None
    return cls(**given)


def _as(kind: Any, value: Any) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        (inner,) = (a for a in arguments if a is not type(None))
        return _as(inner, value)
    if origin is tuple:
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return tuple(_as(arguments[0], v) for v in value or ())
        return tuple(_as(a, v) for a, v in zip(arguments, value))
    if dataclasses.is_dataclass(kind):
        return decode(kind, value)  # pyright: ignore[reportUnknownVariableType, reportArgumentType]
    return value
