"""Recordings from memory, and back: numpy, pandas, polars, pyarrow."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import greyrig
import numpy as np
import pandas as pd
import polars as pl
import pyarrow
import pytest

pa: Any = pyarrow
COLUMNS = ["t_s", "u_v", "i_a", "omega_rad_s"]


@pytest.fixture
def run(here: Path) -> greyrig.Recording:
    return greyrig.load("steps.csv")


def of_numpy(run: greyrig.Recording) -> Any:
    return {name: np.array(run[name]) for name in COLUMNS}


def of_pandas(run: greyrig.Recording) -> Any:
    return run.to_pandas()[COLUMNS]


def of_polars(run: greyrig.Recording) -> Any:
    return run.to_polars().select(COLUMNS)


def of_arrow(run: greyrig.Recording) -> Any:
    return run.to_arrow().select(COLUMNS)


@pytest.mark.parametrize("frame", [of_numpy, of_pandas, of_polars, of_arrow])
def test_there_and_back(frame: Any, run: greyrig.Recording) -> None:
    again = greyrig.recording(frame(run), metadata=run.metadata)
    for name in COLUMNS:
        assert (again[name] == run[name]).all(), name
    assert again.units == {"t_s": "s", "u_v": "V", "i_a": "A", "omega_rad_s": "rad/s"}
    assert again.path is None and again.name == "recording"


@pytest.mark.parametrize("frame", [of_numpy, of_pandas, of_polars, of_arrow])
def test_the_answer_is_that_of_the_file(frame: Any, run: greyrig.Recording) -> None:
    """The interval of a file stands in its metadata, so that times are exact; those of a frame are its column."""
    of_file = greyrig.identify("steps.csv", method="least-squares")
    of_frame = greyrig.identify(greyrig.recording(frame(run), metadata=run.metadata), method="least-squares")
    assert of_frame.parameters == of_file.parameters
    assert of_frame.esr == of_file.esr
    assert greyrig.identify(frame(run), kind="pm-dc", method="least-squares").esr is not None


def test_numpy_sees_the_memory(run: greyrig.Recording) -> None:
    one: Any = run["i_a"]
    other = run["i_a"]
    assert np.shares_memory(one, other) and one.dtype == np.float64
    assert not one.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        one[0] = 1.0
    before = one.copy()
    del run, other
    gc.collect()
    assert (one == before).all(), "the view holds what it sees"


def test_arrow_and_polars_see_the_same_memory(run: greyrig.Recording) -> None:
    address = run["u_v"].__array_interface__["data"][0]
    table = pa.table(run)
    assert table.column("u_v").chunk(0).buffers()[1].address == address
    assert run.to_polars()["u_v"].to_numpy(allow_copy=False).__array_interface__["data"][0] == address
    array = pa.record_batch(run)
    assert array.column("u_v").buffers()[1].address == address
    del run
    gc.collect()
    assert table.column("t_s")[1].as_py() == pytest.approx(1e-4)


def test_units_and_metadata_go_along(run: greyrig.Recording) -> None:
    schema = pa.table(run).schema
    assert schema.field("i_a").metadata[b"unit"] == b"A"
    assert schema.metadata[b"motor"] == b"pm-dc"
    assert greyrig.recording(pa.table(run)).metadata["motor"] == "pm-dc"


def test_foreign_names_and_units() -> None:
    time = np.arange(2000) * 1.0
    frame = pd.DataFrame({"Time [ms]": time, "Voltage [mV]": 1000 * np.sin(time), "Ch2": np.cos(time)})
    made = greyrig.recording(frame, map={"i_a": "Ch2*10+0.5"}, name="bench 3")
    assert made.sample_time_s == pytest.approx(1e-3) and made.name == "bench 3"
    assert made["u_v"] == pytest.approx(np.sin(time)) and made["i_a"] == pytest.approx(10 * np.cos(time) + 0.5)


def test_numbers_of_other_kinds() -> None:
    n = 1000
    frame = pl.DataFrame({"u_v": np.arange(n) % 7, "i_a": (np.arange(n) % 5).astype(np.float32)})
    made = greyrig.recording(frame, sample_time_s=1e-3)
    assert (made["u_v"] == np.arange(n) % 7).all() and (made["i_a"] == np.arange(n) % 5).all()
    missing = frame.with_columns(pl.when(pl.col("u_v") == 3).then(None).otherwise(pl.col("u_v")).alias("u_v"))
    assert np.isnan(greyrig.recording(missing, sample_time_s=1e-3)["u_v"][3])
    strided = {"u_v": np.arange(2 * n, dtype=float)[::2], "i_a": list(range(n))}
    assert greyrig.recording(strided, sample_time_s=1e-3)["u_v"][1] == 2.0


def test_what_is_no_recording() -> None:
    with pytest.raises(greyrig.InputError, match="nothing here: "):
        greyrig.recording({"apples": np.arange(10.0)}, name="nothing here")
    with pytest.raises(ValueError, match="2 dimensions"):
        greyrig.recording({"u_v": np.ones((3, 3))})
    with pytest.raises(greyrig.InputError):
        greyrig.recording({"t_s": [0.0, 1.0, 5.0, 2.0], "u_v": [1.0, 2.0, 3.0, 4.0]})
    with pytest.raises(greyrig.InputError):
        greyrig.recording({"t_s": np.arange(10.0), "u_v": np.arange(9.0)})


def test_files_of_both_kinds(run: greyrig.Recording, tmp_path: Path) -> None:
    for name in ["run.csv", "run.parquet"]:
        run.save(tmp_path / name)
        again = greyrig.load(tmp_path / name)
        assert all((again[column] == run[column]).all() for column in COLUMNS)
        with pytest.raises(greyrig.UsageError, match="--force"):
            run.save(tmp_path / name)
    assert (pl.read_parquet(tmp_path / "run.parquet")["i_a"].to_numpy() == run["i_a"]).all()
