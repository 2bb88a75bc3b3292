"""Recordings of a store, asked wherever an engine has room: an Arrow batch in, an Arrow batch out.

:func:`run` holds no state, so that engines call it as it is::

    import functools, greyrig, ray

    ask = functools.partial(greyrig.fleet.run, question="identify", model=greyrig.load_model("model.toml"))
    ray.data.read_parquet("motors/recordings").map_batches(ask, batch_format="pyarrow", batch_size=64)

A row of results is known by its ``recording``, ``model`` and ``code``: what an engine does twice, since a machine was lost
with it, is the same row twice.
"""

from __future__ import annotations

import io
from typing import Any, Literal

from . import _native
from ._model import Model, load_model
from ._progress import Progress, watching

Question = Literal["identify", "diagnose", "monitor", "check"]


def run(
    batch: Any,
    question: Question,
    *,
    model: Model | str | None = None,
    kind: Literal["universal", "pm-dc"] | None = None,
    threads: int | None = 1,
    progress: bool | Progress = False,
) -> Any:
    """Rows of a store's recordings to rows of its results, as ``greyrig store run`` makes them.

    ``batch`` is a table or batch of pyarrow, or whatever else has ``__arrow_c_stream__``, with the columns of
    ``STORE/recordings``; further ones, such as those of the folders' names, are left alone. What comes back is a batch
    for a batch, a table for all else, in the order of the rows. Recordings of another motor type than the model's have
    no row. ``threads`` is one, since engines give each of their workers one processor.
    """
    import pyarrow
    import pyarrow.parquet as pyarrow_parquet

    arrow: Any = pyarrow
    parquet: Any = pyarrow_parquet
    table = arrow.Table.from_batches([batch]) if isinstance(batch, arrow.RecordBatch) else arrow.table(batch)
    columns = parquet.read_schema(io.BytesIO(_native.no_recordings()))
    absent = [name for name in columns.names if name not in table.column_names]
    if absent:
        raise ValueError(f"the batch lacks the columns {', '.join(absent)} of a store's recordings")
    rows = io.BytesIO()
    # As the engine hands them over, columns may have lost what the store says of them, such as which are never empty.
    parquet.write_table(table.select(columns.names).cast(columns), rows, compression="none", use_dictionary=False)
    known = model if isinstance(model, Model) or model is None else load_model(model)
    with watching(progress, threads) as watch:
        asked = known._native if known is not None else None
        results, _ = _native.fleet_run(rows.getvalue(), question, asked, kind, watch)
    answered = parquet.read_table(io.BytesIO(results))
    if not isinstance(batch, arrow.RecordBatch):
        return answered
    batches = answered.combine_chunks().to_batches()
    return batches[0] if batches else arrow.RecordBatch.from_pylist([], schema=answered.schema)
