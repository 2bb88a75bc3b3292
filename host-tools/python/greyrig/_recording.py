"""Recordings: from files, and from memory."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _native
from ._progress import Progress, watching
from ._table import Table

Map: TypeAlias = "Mapping[str, str | float] | Sequence[str]"
"""``{"u_v": "VoltageCh1*0.01"}``, or pieces as the command line has them: ``["u_v=VoltageCh1*0.01"]``."""


def _pieces(map: Map | None) -> list[str]:
    if map is None:
        return []
    if isinstance(map, str):
        return [map]
    if isinstance(map, Mapping):
        return [f"{target}={source}" for target, source in map.items()]
    return list(map)


class Recording:
    """One run of one motor, uniformly sampled, in SI units.

    ``recording["i_a"]`` is a read-only view, NaN where nothing was measured. The columns are copied once, when one of
    them is first asked for; after that numpy, polars and pyarrow read that memory.
    """

    def __init__(self, native: _native.Recording) -> None:
        self._native = native

    @property
    def name(self) -> str:
        """Its name; of a file, as it was given."""
        return self._native.name

    @property
    def path(self) -> str | None:
        """The file that it comes from."""
        path = self._native.path
        return None if path is None else os.fspath(path)

    @property
    def sample_time_s(self) -> float:
        """Sampling interval, s."""
        return self._native.sample_time_s

    @property
    def start_s(self) -> float:
        """Time of the first sample, s."""
        return self._native.start_s

    @property
    def duration_s(self) -> float:
        """Length, s."""
        return self._native.duration_s

    @property
    def metadata(self) -> dict[str, str]:
        """What it says of itself."""
        return self._native.metadata

    @property
    def warnings(self) -> list[str]:
        """What its reader had to leave out or assume."""
        return self._native.warnings

    @property
    def table(self) -> Table:
        """Its columns, as ``greyrig convert`` writes them."""
        return Table(self._native.table)

    @property
    def columns(self) -> list[str]:
        """Names of its columns."""
        return self.table.columns

    @property
    def units(self) -> dict[str, str]:
        """SI units of its columns."""
        return self.table.units

    def __len__(self) -> int:
        return len(self._native)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        return self.table[name]

    def to_numpy(self) -> dict[str, npt.NDArray[np.float64]]:
        """Its columns, without a further copy."""
        return self.table.to_numpy()

    def to_arrow(self) -> Any:
        """A table of pyarrow, without a further copy."""
        return self.table.to_arrow()

    def to_polars(self) -> Any:
        """A frame of polars, without a further copy."""
        return self.table.to_polars()

    def to_pandas(self) -> Any:
        """A frame of pandas, which copies."""
        return self.table.to_pandas()

    def __arrow_c_schema__(self) -> object:
        return self.table.__arrow_c_schema__()

    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]:
        return self.table.__arrow_c_array__(requested_schema)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes it as ``.csv`` or ``.parquet``; an existing file is replaced with ``force`` alone."""
        with watching(False, None) as watch:
            self._native.save(os.fspath(path), force, watch)

    def __repr__(self) -> str:
        return f"<greyrig.Recording {self.name}: {len(self)} samples, {self.duration_s:.6g} s, {', '.join(self.columns)}>"


def load(
    path: str | os.PathLike[str],
    *,
    map: Map | None = None,
    progress: bool | Progress | None = None,
) -> Recording:
    """Reads a recording from a file of any supported format."""
    with watching(progress, None) as watch:
        return Recording(_native.Recording.load(os.fspath(path), _pieces(map), watch))


def recording(
    data: Any,
    *,
    name: str = "recording",
    map: Map | None = None,
    metadata: Mapping[str, str] | None = None,
    sample_time_s: float | None = None,
) -> Recording:
    """A recording from columns in memory.

    ``data`` is a frame of polars or pandas, a table or batch of pyarrow, whatever else has ``__arrow_c_stream__``, or a
    mapping of names to arrays. Names and units are recognised or mapped as those of a file. Arrow's memory is read
    where it is; the numbers are copied once, into the recording. Arrays of numpy are copied twice.
    """
    pieces = _pieces(map)
    if sample_time_s is not None:
        pieces.append(f"sample_time_s={sample_time_s!r}")
    said = {str(key): str(value) for key, value in (metadata or {}).items()}
    if hasattr(data, "__arrow_c_stream__") and not _is_pandas_without_arrow(data):
        return Recording(_native.Recording.from_stream(data.__arrow_c_stream__(), name, pieces, said))
    columns: list[tuple[str, bytes]] = []
    for column in data.keys():
        values: Any = np.asarray(data[column])
        if values.ndim != 1:
            raise ValueError(f"{column} has {values.ndim} dimensions; give one value for each sample")
        columns.append((str(column), np.ascontiguousarray(values, dtype=np.float64).tobytes()))
    return Recording(_native.Recording.from_columns(columns, name, pieces, said))


def _is_pandas_without_arrow(data: Any) -> bool:
    if not type(data).__module__.startswith("pandas"):
        return False
    if "pyarrow" in sys.modules:
        return False
    try:
        import pyarrow  # noqa: F401  # pyright: ignore[reportUnusedImport]
    except ImportError:
        return True
    return False


Recordings: TypeAlias = "Recording | str | os.PathLike[str] | Iterable[Recording | str | os.PathLike[str]] | Any"
"""A recording, a file, a frame, or several of them."""


def natives(recordings: Recordings, map: Map | None, watch: dict[str, Any]) -> list[_native.Recording]:
    """Recordings for the native side; files are read, and frames taken in."""
    anything: Any = recordings
    if _is_one(anything):
        return [_native_of(anything, "recording", map, watch)]
    return [_native_of(given, f"recording {k}", map, watch) for k, given in enumerate(_several(anything), 1)]


def _several(given: Any) -> list[Any]:
    return list(given)


def _native_of(given: Any, name: str, map: Map | None, watch: dict[str, Any]) -> _native.Recording:
    if isinstance(given, Recording):
        return given._native
    if _is_path(given):
        return _native.Recording.load(_text(given), _pieces(map), watch)
    return recording(given, name=name, map=map)._native


def _is_one(given: Any) -> bool:
    return isinstance(given, Recording) or _is_path(given) or _is_data(given)


def _text(path: Any) -> str:
    return os.fsdecode(path)


def _is_path(given: Any) -> bool:
    return isinstance(given, (str, os.PathLike))


def _is_data(given: Any) -> bool:
    return isinstance(given, Mapping) or hasattr(given, "__arrow_c_stream__") or hasattr(given, "to_numpy")
