"""Columns of samples, read where they are by numpy and by whatever takes Arrow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native

if TYPE_CHECKING:
    import pandas
    import polars


class Table:
    """Columns of the same length.

    ``table["i_a"]`` is a read-only view of its memory, and so are ``to_arrow()`` and ``to_polars()``; ``to_pandas()``
    copies. Whatever takes the Arrow PyCapsule interface takes a table: ``pyarrow.table(table)``,
    ``polars.DataFrame(table)``.
    """

    def __init__(self, native: _native.Table) -> None:
        self._native = native

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return self._native.columns

    @property
    def units(self) -> dict[str, str]:
        """SI units of the columns that have one."""
        return self._native.units

    def __len__(self) -> int:
        return len(self._native)

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        """A column of numbers, without a copy; nobody can write to it."""
        return np.asarray(self._native.numbers(name))

    def words(self, name: str) -> list[str]:
        """A column of words, such as ``recording``."""
        return self._native.words(name)

    def to_numpy(self) -> dict[str, npt.NDArray[np.float64]]:
        """All columns of numbers, without a copy."""
        texts = self._native.texts
        return {name: self[name] for name in self.columns if name not in texts}

    def to_arrow(self) -> Any:
        """A table of pyarrow, without a copy."""
        import pyarrow

        arrow: Any = pyarrow
        return arrow.table(self)

    def to_polars(self) -> polars.DataFrame:
        """A frame of polars, without a copy."""
        import polars

        return polars.DataFrame(self)

    def to_pandas(self) -> pandas.DataFrame:
        """A frame of pandas, which copies the numbers into blocks of its own."""
        import pandas

        texts = self._native.texts
        return pandas.DataFrame({name: self.words(name) if name in texts else self[name] for name in self.columns})

    def __arrow_c_schema__(self) -> object:
        return self._native.__arrow_c_schema__()

    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]:
        return self._native.__arrow_c_array__(requested_schema)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._native.__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        return f"<greyrig.Table: {len(self)} samples of {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        few: Any = self.to_pandas()
        return few.head(10)._repr_html_()
