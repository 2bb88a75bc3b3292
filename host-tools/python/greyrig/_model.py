"""Models of motor types."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping
from typing import Any

from . import _native


class Model:
    """A model of a motor type: physical parameters, effects, terms, and what was learnt beside them."""

    def __init__(self, native: _native.Model) -> None:
        self._native = native

    @property
    def path(self) -> str | None:
        """The file that it comes from, or was last written to."""
        path = self._native.path
        return None if path is None else os.fspath(path)

    def to_dict(self) -> dict[str, Any]:
        """The content of its file."""
        return json.loads(self._native.json())

    @property
    def parameters(self) -> Mapping[str, float]:
        """Values in SI units by name, those of effects and terms included."""
        content = self.to_dict()
        groups = [content["parameters"]]
        groups += [part["parameters"] for part in [*content.get("effects", []), *content.get("terms", [])]]
        return {name: entry["value"] for group in groups for name, entry in group.items()}

    @property
    def effects(self) -> list[str]:
        """Its effects, in the order in which they act."""
        return [effect["id"] for effect in self.to_dict().get("effects", [])]

    def to_toml(self) -> str:
        """The text of its file."""
        return self._native.text()

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> Model:
        """Writes the model file, whole or not at all; an existing one is replaced with ``force`` alone.

        Returns the model with its file, which ``next_command`` and ``to_dict()`` of later answers then name.
        """
        return Model(self._native.save(os.fspath(path), force))

    def __reduce__(self) -> tuple[Any, tuple[str, str | None]]:
        return _parsed, (self.to_toml(), self.path)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self._native == other._native

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.4g}" for name, value in self.parameters.items())
        return f"<greyrig.Model: {values}>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.to_toml())}</pre>"


def _parsed(text: str, path: str | None) -> Model:
    return Model(_native.Model.parse(text, path))


def load_model(path: str | os.PathLike[str]) -> Model:
    """Reads a model file."""
    return Model(_native.Model.load(os.fspath(path)))
