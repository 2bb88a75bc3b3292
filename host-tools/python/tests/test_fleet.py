"""Batches of a store, asked without it: what comes out is what the store itself would hold."""

from __future__ import annotations

import concurrent.futures
import functools
import multiprocessing
from pathlib import Path
from typing import Any

import greyrig
import pyarrow
import pyarrow.dataset as pyarrow_dataset
import pytest
from conftest import Command

pa: Any = pyarrow
dataset: Any = pyarrow_dataset
MOTORS = 6


@pytest.fixture
def store(command: Command, here: Path) -> Path:
    if not Path("store").is_dir():
        for seed in range(MOTORS):
            name = f"lot-{seed}.csv"
            options = ["--kind", "pm-dc", "--profile", "dc-steps", "--seconds", "2", "--spread", "0.03"]
            assert command("simulate", *options, "--seed", str(seed), "--out", name).code == 0
        assert command("store", "add", "store", *(f"lot-{seed}.csv" for seed in range(MOTORS))).code == 0
        ran = command("store", "run", "store", "identify", "--model", "model.toml")
        assert ran.code == 0, ran.err
    return Path("store")


def read(folder: Path) -> Any:
    """All rows; where nobody has told a day, the folders' names are no columns that pyarrow can give a type."""
    return dataset.dataset(folder, format="parquet").to_table()


def rows(table: Any) -> list[dict[str, Any]]:
    return sorted(table.to_pylist(), key=lambda row: row["recording"])


def ask(batch: Any, model: Any) -> Any:
    return greyrig.fleet.run(batch, "identify", model=model)


def test_as_the_store_itself(store: Path) -> None:
    recordings, expected = read(store / "recordings"), read(store / "results")
    answered = greyrig.fleet.run(recordings, "identify", model="model.toml")
    assert answered.num_rows == MOTORS and rows(answered) == rows(expected)
    # The order is that of the rows.
    assert answered.column("recording").to_pylist() == recordings.column("sha256").to_pylist()


def test_batches_in_any_cut(store: Path) -> None:
    recordings = read(store / "recordings")
    model = greyrig.load_model("model.toml")
    parts = [greyrig.fleet.run(batch, "identify", model=model) for batch in recordings.to_batches(max_chunksize=4)]
    assert all(isinstance(part, pa.RecordBatch) for part in parts)
    assert rows(pa.Table.from_batches(parts)) == rows(read(store / "results"))
    nothing = greyrig.fleet.run(recordings.slice(0, 0), "identify", model=model)
    assert nothing.num_rows == 0 and nothing.schema.names == parts[0].schema.names


def test_on_other_processes(store: Path) -> None:
    """The function and the model go there, and batches back and forth."""
    batches = [recordings for recordings in read(store / "recordings").to_batches(max_chunksize=2)]
    work = functools.partial(ask, model=greyrig.load_model("model.toml"))
    spawned = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=spawned) as pool:
        # One of them twice, as an engine does that has lost a machine: the same row twice.
        answered = list(pool.map(work, [*batches, batches[0]]))
    assert answered[-1] == answered[0]
    assert rows(pa.Table.from_batches(answered[:-1])) == rows(read(store / "results"))


def test_what_is_no_batch(store: Path) -> None:
    with pytest.raises(ValueError, match="lacks the columns sha256"):
        greyrig.fleet.run(pa.table({"u_v": [1.0]}), "check")
    with pytest.raises(greyrig.UsageError, match="monitor judges by the limits"):
        greyrig.fleet.run(read(store / "recordings"), "monitor")
    with pytest.raises(greyrig.UsageError, match="choose one of identify, diagnose, monitor, check"):
        greyrig.fleet.run(read(store / "recordings"), "judge")  # pyright: ignore[reportArgumentType]
