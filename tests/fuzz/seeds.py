"""Seeds of the fuzz targets that read binary files: a dozen rows in each format, as other tools write them.

    python3 -m pip install numpy scipy h5py npTDMS asammdf pyarrow
    python3 tests/fuzz/seeds.py

The seeds are in the tree; this makes them anew, and others where a reader learns a new variant.
"""

import gzip
import io
import pathlib

import asammdf
import h5py
import nptdms
import numpy
import pyarrow
import pyarrow.feather
import pyarrow.parquet
import scipy.io
import scipy.io.wavfile

HERE = pathlib.Path(__file__).parent / "corpus"
N = 12
T = numpy.arange(N) * 1e-3
COLUMNS = {
    "t_s": T,
    "u_v": 12 * numpy.sin(5 * T) + 1,
    "i_a": 3 * numpy.cos(3 * T),
    "omega_rad_s": 100 * numpy.sin(4 * T),
}


def put(target, name, content):
    folder = HERE / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


def file(target, name, write):
    """A file that a library writes by its name."""
    path = HERE / target / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    write(path)


text = ",".join(COLUMNS) + "\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in zip(*COLUMNS.values()))
put("csv", "plain.csv", text.encode())
put("csv", "semicolons.csv", ("# motor: A\n" + text).replace(",", ";").replace(".", ",").encode())
put("csv", "units.csv", ("t [ms]\tU [V]\tI [mA]\tn [rpm]\n" + "".join(f"{k}\t{k}\t{k}\t{k}\n" for k in range(N))).encode())
put("csv", "dates.csv", ("time,u_v,i_a\n" + "".join(f"2026-03-01T12:00:00.{k:03}Z,1,{k}\n" for k in range(N))).encode())
put("csv", "valid.csv", ("t_s,u_v,valid\n" + "".join(f"{k / 10},{k},{k % 2}\n" for k in range(N))).encode())
put("gzip", "plain.csv.gz", gzip.compress(text.encode(), mtime=0))

table = pyarrow.table({**COLUMNS, "n": numpy.arange(N, dtype="int16"), "f": COLUMNS["u_v"].astype("float32")})
for codec in ["none", "snappy", "gzip", "zstd", "lz4", "brotli"]:
    file("parquet", f"{codec}.parquet", lambda p: pyarrow.parquet.write_table(table, p, compression=codec))
    if codec in ["none", "zstd", "lz4"]:
        arrow = {"none": "uncompressed"}.get(codec, codec)
        file("arrow", f"{codec}.feather", lambda p: pyarrow.feather.write_feather(table, p, compression=arrow))
decimal = pyarrow.table({"t_s": T, "u_v": pyarrow.array([None if k == 3 else k for k in range(N)], pyarrow.decimal128(9, 3))})
file("parquet", "decimal.parquet", lambda p: pyarrow.parquet.write_table(decimal, p))

for version in ["4", "5"]:
    for zipped in [False, True] if version == "5" else [False]:
        out = io.BytesIO()
        scipy.io.savemat(out, COLUMNS, format=version, do_compression=zipped)
        put("mat", f"v{version}{'z' if zipped else ''}.mat", out.getvalue())
out = io.BytesIO()
signals = numpy.array([(COLUMNS["u_v"], "u"), (COLUMNS["i_a"], "i")], dtype=[("values", "O"), ("label", "O")])
scipy.io.savemat(out, {"log": {"time": T, "signals": signals}, "name": "motor", "z": COLUMNS["u_v"] * 1j})
put("mat", "structure.mat", out.getvalue())


def hdf5(path):
    with h5py.File(path, "w", libver="latest") as h:
        for name, values in COLUMNS.items():
            h.create_dataset(name, data=values.astype("float32"))
        scaled = h.create_dataset("raw", data=numpy.arange(N, dtype="int16"), chunks=(4,), compression="gzip", fletcher32=True)
        scaled.attrs["scale_factor"] = 0.01
        scaled.attrs["add_offset"] = -1.0


file("hdf5", "plain.h5", hdf5)
file("hdf5", "mat73.h5", lambda p: h5py.File(p, "w", userblock_size=512).create_dataset("u_v", data=COLUMNS["u_v"]).file.close())

for version in ["2.14", "3.30", "4.10"]:
    mdf = asammdf.MDF(version=version)
    names = ["u_v", "i_a", "omega_rad_s"]
    mdf.append([asammdf.Signal(COLUMNS[n], T, name=n, unit="V") for n in names])
    suffix = "mf4" if version == "4.10" else "mdf"
    file("mdf", f"v{version}.{suffix}", lambda p: mdf.save(p, overwrite=True, compression=0))
    if suffix == "mf4":
        file("mdf", "deflate.mf4", lambda p: mdf.save(p, overwrite=True, compression=2))

for version in [4712, 4713]:
    out = io.BytesIO()
    with nptdms.TdmsWriter(out, version=version) as writer:
        properties = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "unit_string": "V"}
        scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.01,
                 "NI_Scale[0]_Linear_Y_Intercept": -1.0}
        channels = [nptdms.ChannelObject("g", n, COLUMNS[n], properties) for n in ["u_v", "i_a"]]
        raw = nptdms.ChannelObject("g", "omega_rad_s", numpy.arange(N, dtype="int16"), {**properties, **scale})
        writer.write_segment([nptdms.RootObject(), nptdms.GroupObject("g"), *channels, raw])
        writer.write_segment([*channels, raw])
    put("tdms", f"v{version}.tdms", out.getvalue())

for name, dtype in [("int16", "int16"), ("int32", "int32"), ("float32", "float32"), ("uint8", "uint8")]:
    out = io.BytesIO()
    scipy.io.wavfile.write(out, 1000, (numpy.arange(3 * N).reshape(N, 3)).astype(dtype))
    put("wav", f"{name}.wav", out.getvalue())

for name, save in [("stored", numpy.savez), ("deflate", numpy.savez_compressed)]:
    out = io.BytesIO()
    save(out, **COLUMNS, n=numpy.arange(N, dtype=">i2"), h=T.astype("float16"))
    put("npz", f"{name}.npz", out.getvalue())

# Variants that the tests of foreign files hold.
FOREIGN = HERE.parent.parent / "data" / "foreign"
for target, names in {
    "hdf5": ["virtual_1.h5", "virtual_2.h5", "committed_1.h5", "committed_2.h5", "lzf.h5", "pandas_index_table.h5"],
    "netcdf": ["classic_1.nc", "classic_5.nc"],
    "parquet": ["fork.parquet", "checksum.parquet"],
    "mat": ["simulink_73.mat", "simulink_blocks.mat"],
    "wav": ["rifx.wav", "int64.wav", "switched_off.wav"],
    "npz": ["structured.npy"],
}.items():
    for name in names:
        put(target, name, (FOREIGN / name).read_bytes())
