"""The store as others read it, and the questions of docs/store.md.

    python store.py GREYRIG [FOLDER]      (needs duckdb, pyarrow and polars; writes into FOLDER, or a temporary one)

Makes two lots of virtual motors, the second with a resistance that drifts from week to week, puts them into a store, reads
them back with DuckDB, pyarrow and polars, holds every sample against the CSV file that went in, bit for bit, and asks what
a plant asks. Fails where a number is not the same.
"""

import csv
import datetime
import pathlib
import struct
import subprocess
import sys
import tempfile

import duckdb
import polars
import pyarrow.dataset

SAMPLES = """
CREATE MACRO samples(c) AS coalesce(
    list_transform(c.int16, lambda x: (x + c.zero) * c.gain / c.divisor + c.offset),
    c.float32::DOUBLE[], c.float64)
"""


def bits(values):
    return [struct.pack("<d", x) for x in values]


def made(greyrig, folder, weeks=6, each=6):
    """Recordings of two lines; the motors of line A3 get 8 % more resistance a week."""
    files = []
    for week in range(weeks):
        for n in range(each):
            run = folder / f"w{week}n{n}.csv"
            line = "A3" if n % 2 else "B1"
            seed = str(100 * week + n)
            command = [greyrig, "simulate", "--seconds", "5", "--seed", seed, "--spread", "0.01", "--out", run]
            subprocess.run(command, check=True, capture_output=True)
            text = run.read_text()
            if line == "A3":
                text = warmer(text, 1 + 0.08 * week)
            day = datetime.date(2026, 1, 5) + datetime.timedelta(weeks=week, days=n // 2)
            head = f"# serial: {line}-{week}{n:02d}\n# line: {line}\n# date: {day}T0{n}:00:00\n"
            run.write_text(head + text)
            files.append(run)
    return files


def warmer(text, factor):
    """The same run of a motor whose resistance is larger by a factor: the voltage that takes."""
    resistance = 2.2
    rows, header = [], None
    for row in text.splitlines():
        if row.startswith("#"):
            rows.append(row)
        elif header is None:
            header = row.split(",")
            rows.append(row)
        else:
            cells = row.split(",")
            u, i = header.index("u_v"), header.index("i_a")
            cells[u] = repr(round(float(cells[u]) + (factor - 1) * resistance * float(cells[i]), 3))
            rows.append(",".join(cells))
    return "\n".join(rows) + "\n"


def put_in(path):
    """Channels of a CSV file."""
    rows = [row for row in csv.reader(line for line in path.open() if not line.startswith("#"))]
    return {name: [float(x) for x in column] for name, column in zip(rows[0], zip(*rows[1:]))}


def main():
    greyrig = str(pathlib.Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else temporary)
        folder.mkdir(exist_ok=True)
        runs = folder / "runs"
        runs.mkdir(exist_ok=True)
        files = made(greyrig, runs)
        store = folder / "motors"
        subprocess.run([greyrig, "store", "add", store, *files], check=True)
        by_name = {str(file): put_in(file) for file in files}

        db = duckdb.connect()
        db.execute(SAMPLES)
        glob = f"{store}/recordings/**/*.parquet"
        compared = 0
        for channel in ["u_v", "i_a", "omega_rad_s"]:
            rows = db.execute(f"SELECT file, samples({channel}) FROM read_parquet('{glob}')").fetchall()
            assert len(rows) == len(files), (len(rows), len(files))
            for name, values in rows:
                assert bits(values) == bits(by_name[name][channel]), (name, channel)
                compared += len(values)
        print(f"DuckDB: {compared} samples of {len(files)} recordings, all as they were put in, bit for bit")

        table = pyarrow.dataset.dataset(store / "recordings", format="parquet", partitioning="hive").to_table()
        frame = polars.read_parquet(glob, hive_partitioning=True)
        assert table.num_rows == frame.height == len(files)
        for row in table.select(["file", "i_a"]).to_pylist():
            c = row["i_a"]
            values = [(x + c["zero"]) * c["gain"] / c["divisor"] + c["offset"] for x in c["int16"]]
            assert bits(values) == bits(by_name[row["file"]]["i_a"]), row["file"]
        assert set(frame["line"].unique()) == set(table.column("line").to_pylist()) == {"A3", "B1"}
        print(f"pyarrow, polars: {table.num_rows} rows, partitions line, type, day")

        for question in questions(greyrig, store, runs):
            print(f"\n{question.strip()}\n")
            print(db.sql(question))


def questions(greyrig, store, runs):
    """SQL of docs/store.md, after the runs that it asks about."""

    def run(*words):
        subprocess.run([greyrig, "store", "run", store, *map(str, words)], check=True)

    run("identify")
    # The old limits are of the first week's motors, the new ones of line A3's in all weeks as well.
    first = sorted(runs.glob("w0n*.csv"))
    base = runs.parent / "base.toml"
    subprocess.run([greyrig, "identify", first[0], "--out", base, "--force"], check=True, capture_output=True)
    for name, learnt in [("old", first), ("new", first + sorted(runs.glob("w[1-5]n[13].csv")))]:
        model = runs.parent / f"{name}.toml"
        words = [greyrig, "calibrate", *learnt, "--model", base, "--out", model, "--force"]
        subprocess.run(words, check=True, capture_output=True)
        run("monitor", "--model", model)
    results = f"read_parquet('{store}/results/**/*.parquet', hive_partitioning = true)"
    yield f"""
SELECT line, date_trunc('week', day) AS week, count(*) AS motors,
       round(avg(p.value), 4) AS "mean R, ohm", round(stddev(p.value), 4) AS "scatter, ohm"
FROM {results}, unnest(parameters) AS t(p)
WHERE job = 'identify' AND p.name = 'R' AND p.identifiable
GROUP BY ALL ORDER BY line, week"""
    yield f"""
SELECT old.serial, old.line, old.day, old.outcome AS "old model", new.outcome AS "new model", old.text AS "why of the old"
FROM {results} AS old JOIN {results} AS new USING (recording, job, code)
WHERE job = 'monitor' AND old.model_name = 'old.toml' AND new.model_name = 'new.toml' AND old.outcome <> new.outcome
ORDER BY old.serial LIMIT 12"""
    yield f"""
SELECT r.serial, r.line, r.day, max(abs(s)) AS "peak current, A"
FROM (SELECT serial, line, day, unnest(samples(i_a)) AS s
      FROM read_parquet('{store}/recordings/**/*.parquet', hive_partitioning = true)) AS r
GROUP BY ALL ORDER BY 4 DESC LIMIT 5"""


if __name__ == "__main__":
    main()
