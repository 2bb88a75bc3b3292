"""Small recordings as other programs write them, into foreign/, for tests/host/foreign.rs.

u = 12 sin 5t + 1 V, i = cos 3t A, w = 100 sin 4t rad/s; 40 samples at 1 kHz.
Needs numpy, scipy, h5py, pandas, tables, xarray, netCDF4, pyarrow, asammdf and npTDMS.
"""

import os
import struct
import zlib
from decimal import Decimal

import h5py
import netCDF4
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
import xarray as xr
from asammdf import MDF, Signal
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "foreign")
N = 40
t = np.arange(N) * 1e-3
u = 12 * np.sin(5 * t) + 1
i = np.cos(3 * t)
w = 100 * np.sin(4 * t)


def at(name):
    return os.path.join(HERE, name)


def mdf():
    m = MDF(version="4.10")
    for name, x, unit in (("u", u, "V"), ("i", i, "A"), ("w", w, "rad/s")):
        m.append([Signal(x, t, name=name, unit=unit)])
    m.save(at("mdf_group_per_channel.mf4"), overwrite=True)
    m = MDF(version="4.10")
    m.append([Signal(u.astype("f2"), t, name="u", unit="V"), Signal(i, t, name="i", unit="A"), Signal(w, t, name="w")])
    m.save(at("mdf_half.mf4"), overwrite=True)
    # The length of a record, which follows the number of cycles and eight bytes of flags, is made 288.
    raw = bytearray(open(at("mdf_half.mf4"), "rb").read())
    cg = raw.find(b"##CG")
    links = struct.unpack_from("<Q", raw, cg + 16)[0]
    struct.pack_into("<I", raw, cg + 24 + 8 * links + 24, 288)
    open(at("mdf_wrong_record_length.mf4"), "wb").write(raw)


def parquet():
    def write(name, columns, **options):
        pq.write_table(pa.table(columns), at(name), **options)

    decimal = lambda x, scale: pa.array([Decimal(int(round(v * 10**scale))).scaleb(-scale) for v in x])
    write("decimals.parquet", {"t": t, "u": decimal(u, 3), "i": decimal(i, 4), "w": w}, store_decimal_as_integer=True)
    write("decimals_as_bytes.parquet", {"t": t, "u": decimal(u, 3), "i": i, "w": w})
    us = (t * 1e6).round().astype("i8")
    write("time64.parquet", {"t": pa.array(us, pa.time64("us")), "u": u, "i": i, "w": w})
    write("midnight.parquet", {"t": pa.array((us + 86_399_990_000) % 86_400_000_000, pa.time64("us")), "u": u, "i": i})
    write("duration.parquet", {"t": pa.array(us, pa.duration("us")), "u": u, "i": i, "w": w})
    stamps = pa.array(us * 1000 + 1_700_000_000_000_000_000, pa.timestamp("ns"))
    write("int96.parquet", {"t": stamps, "u": u, "i": i, "w": w}, use_deprecated_int96_timestamps=True)
    write("half.parquet", {"t": t, "u": u.astype("f2"), "i": i})
    write("checksum.parquet", {"t": t, "u": u, "i": i, "w": w}, write_page_checksum=True, compression="none", use_dictionary=False)
    spoil("checksum.parquet", "bad_checksum.parquet", u[7].tobytes())
    packed = dict(write_page_checksum=True, compression="zstd", data_page_version="2.0")
    write("packed_checksum.parquet", {"t": t, "u": u, "i": i, "w": w}, **packed)
    # A byte of the first page of u, behind its header.
    group = pq.ParquetFile(at("packed_checksum.parquet")).metadata.row_group(0).column(1)
    spoil("packed_checksum.parquet", "bad_packed_checksum.parquet", group.data_page_offset + group.total_compressed_size - 3)
    os.remove(at("packed_checksum.parquet"))
    # Field 17 of a column, which is a structure of its own, as a list: a fork of the format had another use for a number.
    raw = open(at("int96.parquet"), "rb").read()
    length = struct.unpack_from("<I", raw, len(raw) - 8)[0]
    footer = bytearray(raw[-8 - length : -8])
    for column in range(4):
        footer = with_field_17(footer, column)
    open(at("fork.parquet"), "wb").write(raw[: -8 - length] + footer + struct.pack("<I", len(footer)) + b"PAR1")


def with_field_17(footer, column):
    """The metadata of a column get a list of one structure as field 17 (Thrift, compact protocol)."""
    place, ends = 0, []

    def number():
        nonlocal place
        value = shift = 0
        while True:
            byte = footer[place]
            place += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def value(kind, path):
        nonlocal place
        if kind in (3,):
            place += 1
        elif kind in (4, 5, 6):
            number()
        elif kind == 7:
            place += 8
        elif kind == 8:
            length = number()
            place += length
        elif kind in (9, 10):
            head = footer[place]
            place += 1
            count = head >> 4 if head >> 4 < 15 else number()
            for _ in range(count):
                value(head & 15, path)
        elif kind == 12:
            field = 0
            while footer[place]:
                head = footer[place]
                place += 1
                field += head >> 4
                value(head & 15, path + (field,))
            if path == (4, 1, 3):
                ends.append((place, field))
            place += 1

    value(12, ())
    at, last = ends[column]
    return footer[:at] + bytes([(17 - last) << 4 | 9, 1 << 4 | 12, 0x15, 0, 0]) + footer[at:]


def spoil(name, other, where):
    """One bit of a file turned, at a place or behind some bytes."""
    raw = bytearray(open(at(name), "rb").read())
    raw[where if isinstance(where, int) else raw.find(where) + 3] ^= 1
    open(at(other), "wb").write(raw)



def hdf5():
    def file(name):
        return h5py.File(at(name), "w", libver="latest")

    with file("scale_factor.h5") as f:
        f["t"] = t
        for name, x, scale, unit in (("u", u, 1e-3, "V"), ("i", i, 1e-4, "A"), ("w", w, 1e-2, "rad/s")):
            f[name] = np.round(x / scale).astype("i4")
            f[name].attrs["scale_factor"] = scale
            f[name].attrs["units"] = unit
    with file("fill_value.h5") as f:
        f["t"] = t
        f["u"] = np.where(np.arange(N) == 5, -999.0, u)
        f["u"].attrs["_FillValue"] = -999.0
        f.create_dataset("i", data=np.where(np.arange(N) == 9, 1e36, i), fillvalue=1e36)
        f["w"] = w
    with file("compound.h5") as f:
        f["log"] = np.rec.fromarrays([t, u, i, w.astype("f4")], names="t,u,i,w")
    with file("not_all_is_known.h5") as f:
        for name, x in (("t", t), ("u", u), ("i", i), ("w", w)):
            f[name] = x
        f["notes"] = i + 1j
        layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
        layout[:] = h5py.VirtualSource("elsewhere.h5", "i", shape=(N,))
        f.create_virtual_dataset("elsewhere", layout)
    with file("lzf.h5") as f:
        for name, x in (("t", t), ("u", u), ("i", i), ("w", w)):
            f.create_dataset(name, data=x, compression="lzf", shuffle=name != "w", chunks=(16,))
    for name, version in (("virtual_1.h5", "v110"), ("virtual_2.h5", "latest")):
        with h5py.File(at(name), "w", libver=("earliest", version)) as f:
            f["t"], f["raw/first"], f["raw/second"], f["raw/both"] = t, u[:15], u[15:], np.column_stack([i, w])
            layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
            layout[:15] = h5py.VirtualSource(".", "raw/first", shape=(15,))
            layout[15:] = h5py.VirtualSource(".", "raw/second", shape=(N - 15,))
            f.create_virtual_dataset("u", layout)
            for k, channel in enumerate("iw"):
                layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
                for half in (0, 1):
                    layout[half::2] = h5py.VirtualSource(".", "raw/both", shape=(N, 2))[half::2, k]
                f.create_virtual_dataset(channel, layout)
    for name, version in (("committed_1.h5", "earliest"), ("committed_2.h5", "latest")):
        with h5py.File(at(name), "w", libver=version, userblock_size=512) as f:
            f["kind"] = np.dtype("f8")
            g = f.create_group("run")
            for channel, x in (("t", t), ("u", u), ("i", i), ("w", w), ("packed", u)):
                g[channel] = x
            for of, attribute in ((f, "rig"), (g, "number"), (g["u"], "gain"), (g["packed"], "scale_factor")):
                of.attrs.create(attribute, 2.0, dtype=f["kind"])
    with file("fletcher.h5") as f:
        f["t"], f["i"], f["w"] = t, i, w
        f.create_dataset("u", data=u, chunks=(N,), fletcher32=True)
    raw = bytearray(open(at("fletcher.h5"), "rb").read())
    raw[raw.find(u[7].tobytes()) + 3] ^= 1
    open(at("bad_fletcher.h5"), "wb").write(raw)
    frame = pd.DataFrame({"t": t, "u": u, "i": i, "w": w})
    for name, layout in (("pandas_table.h5", "table"), ("pandas_fixed.h5", "fixed")):
        if os.path.exists(at(name)):
            os.remove(at(name))
        frame.to_hdf(at(name), key="run", format=layout, index=False, complevel=9, complib="zlib")
    stamps = pd.to_datetime((t * 1e6).round().astype("i8"), unit="us", origin="2026-03-01 08:00")
    for name, of, layout in (
        ("pandas_stamps.h5", frame.assign(t=stamps, w=w.round().astype("i4")), "table"),
        ("pandas_index_table.h5", frame.set_index("t"), "table"),
        ("pandas_index_fixed.h5", frame.assign(w=w.round().astype("i4")).set_index("t"), "fixed"),
        ("pandas_stamps_fixed.h5", frame.drop(columns="t").set_index(stamps.astype("datetime64[ns]")), "fixed"),
    ):
        if os.path.exists(at(name)):
            os.remove(at(name))
        of.to_hdf(at(name), key="run", format=layout, index=False if layout == "table" else None, complevel=9, complib="zlib")
    set_ = xr.Dataset({"u": ("t", u), "i": ("t", i), "w": ("t", w)}, coords={"t": t})
    packed = {"u": {"dtype": "i2", "scale_factor": 1e-3, "_FillValue": -32768}}
    set_.to_netcdf(at("packed.nc"), engine="netcdf4", encoding=packed)
    set_.to_netcdf(at("classic.nc"), engine="scipy", format="NETCDF3_64BIT")
    for name, kind in (("classic_1.nc", "NETCDF3_CLASSIC"), ("classic_5.nc", "NETCDF3_64BIT_DATA")):
        with netCDF4.Dataset(at(name), "w", format=kind) as f:
            f.createDimension("time", None)
            f.rig = "bench 3"
            times = f.createVariable("time", "i4", "time")
            times.units = "milliseconds since 2026-03-01 08:00:00"
            times[:] = np.arange(N) + 5000
            volts = f.createVariable("u", "i2", "time", fill_value=-32768)
            volts.scale_factor, volts.add_offset, volts.units = 1e-3, 1.0, "V"
            volts[:] = np.ma.masked_where(np.arange(N) == 5, u)
            amperes = f.createVariable("i", "f8", "time")
            # The ninth value is never written.
            amperes[:9], amperes[10:] = i[:9], i[10:]
            f.createVariable("w", "f4", "time")[:] = w


def matlab():
    signal = np.zeros((1, 3), dtype=[("values", "O"), ("dimensions", "O"), ("label", "O")])
    for k, (name, x) in enumerate((("u", u), ("i", i), ("w", w))):
        signal[0, k] = (x.reshape(-1, 1), 1.0, name)
    scipy.io.savemat(at("simulink.mat"), {"out": {"time": t.reshape(-1, 1), "signals": signal, "blockName": "rig/scope"}})
    blocks = np.zeros((1, 3), dtype=[*((n, "O") for n in signal.dtype.names), ("blockName", "O")])
    for k, name in enumerate("uiw"):
        blocks[0, k] = (signal[0, k]["values"], 1.0, "", "rig/" + name)
    scipy.io.savemat(at("simulink_blocks.mat"), {"out": {"time": t.reshape(-1, 1), "signals": blocks}})
    scipy.io.savemat(at("complex.mat"), {"t": t, "u": u, "i": i + 1j, "w": w})
    empty = np.zeros((0, 0), dtype=[("a", "O"), ("b", "O")])
    scipy.io.savemat(at("empty_struct.mat"), {"t": t, "u": u, "i": i, "w": w, "notes": empty})
    # An object as MATLAB stores it: class 17, name, type system, class, and a reference to its own storage.
    name = lambda s: struct.pack("<II", 1, len(s)) + s + b"\0" * (-len(s) % 8)
    reference = struct.pack("<IIII", 6, 8, 13, 0) + struct.pack("<IIii", 5, 8, 1, 1) + struct.pack("<II", 1, 0)
    reference += struct.pack("<III", 6, 4, 3707764736) + b"\0" * 4
    reference = struct.pack("<II", 14, len(reference)) + reference
    body = struct.pack("<IIII", 6, 8, 17, 0) + name(b"remark") + name(b"MCOS") + name(b"string") + reference
    raw = open(at("empty_struct.mat"), "rb").read()
    open(at("object.mat"), "wb").write(raw + struct.pack("<II", 14, len(body)) + body)


def matlab_73():
    """Structures with time as MATLAB 7.3 keeps them: three signals by reference, and one by itself."""

    def put(group, name, x, kind="double"):
        group[name] = x
        group[name].attrs["MATLAB_class"] = np.bytes_(kind)
        return group[name]

    def letters(text):
        return np.frombuffer(text.encode("utf-16-le"), "<u2").reshape(-1, 1)

    for name, signals in (("simulink_73.mat", "uiw"), ("simulink_73_one.mat", "u")):
        with h5py.File(at(name), "w", userblock_size=512) as f:
            out = f.create_group("out")
            out.attrs["MATLAB_class"] = np.bytes_("struct")
            put(out, "time", t.reshape(1, -1))
            g = out.create_group("signals")
            g.attrs["MATLAB_class"] = np.bytes_("struct")
            if len(signals) == 1:
                put(g, "values", u.reshape(1, -1))
                put(g, "label", letters("u"), "char")
            place = f.create_group("#refs#")
            for field in ("values", "label", "blockName") if len(signals) > 1 else ():
                references = []
                for channel, x in zip(signals, (u, i, w)):
                    if field == "values":
                        to = put(place, f"{field}_{channel}", x.reshape(1, -1))
                    elif field == "blockName" or channel == "i":
                        to = put(place, f"{field}_{channel}", letters("rig/" * (field == "blockName") + channel), "char")
                    else:
                        to = put(place, f"{field}_{channel}", np.zeros(2, "u8"), "char")
                        to.attrs["MATLAB_empty"] = np.uint8(1)
                    references.append([to.ref])
                g.create_dataset(field, data=np.array(references, dtype=object), dtype=h5py.ref_dtype)
        raw = bytearray(open(at(name), "rb").read())
        raw[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b"\0" * 8 + b"\0\2IM"
        open(at(name), "wb").write(raw)


def numpy():
    np.savez(at("half.npz"), t=t, u=u.astype("f2"), i=i, w=w)
    table = np.rec.fromarrays([t, u, i, w], names="t,u,i,w")
    np.savez(at("structured.npz"), log=table)
    np.save(at("structured.npy"), table)
    np.savez(at("checksum.npz"), t=t, u=u, i=i, w=w)
    raw = bytearray(open(at("checksum.npz"), "rb").read())
    raw[raw.find(u[7].tobytes()) + 3] ^= 1
    open(at("bad_checksum.npz"), "wb").write(raw)
    os.remove(at("checksum.npz"))


def tdms():
    wave = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    raw = lambda x: np.round(x * 1000).astype("i2")
    scale = {"NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.001, "NI_Scale[0]_Linear_Y_Intercept": 0.0}
    scale["NI_Scaling_Status"] = "unscaled"
    count = {"NI_Number_Of_Scales": 1}
    with TdmsWriter(at("scale_on_group.tdms")) as f:
        channels = [ChannelObject("g", n, raw(x), wave) for n, x in (("u", u), ("i", i))]
        f.write_segment([RootObject(), GroupObject("g", {**scale, **count}), *channels])
    with TdmsWriter(at("scale_uncounted.tdms")) as f:
        channels = [ChannelObject("g", n, raw(x), {**wave, **scale}) for n, x in (("u", u), ("i", i))]
        f.write_segment([RootObject(), GroupObject("g"), *channels])
    polynomial = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Polynomial", "NI_Scaling_Status": "unscaled"}
    polynomial |= {"NI_Scale[0]_Polynomial_Coefficients_Size": 3}
    polynomial |= {f"NI_Scale[0]_Polynomial_Coefficients[{k}]": c for k, c in enumerate((1.0, 0.0, 2.0))}
    with TdmsWriter(at("polynomial.tdms")) as f:
        f.write_segment([RootObject(), GroupObject("g"), ChannelObject("g", "u", np.arange(N) * 1.0, {**wave, **polynomial})])
    with TdmsWriter(at("later_start.tdms")) as f:
        later = ChannelObject("g", "i", np.cos(3 * (t + 0.01)), {**wave, "wf_start_offset": 0.01})
        f.write_segment([RootObject(), GroupObject("g"), ChannelObject("g", "u", u, wave), later])


def wav():
    floats = np.column_stack([u, i]).astype("<f8").tobytes()
    fmt = struct.pack("<HHIIHH", 3, 2, 1000, 16000, 16, 64)
    chunk = lambda name, body: name + struct.pack("<I", len(body)) + body
    body = b"WAVE" + chunk(b"fmt ", fmt) + chunk(b"data", floats)
    open(at("float64.wav"), "wb").write(chunk(b"RIFF", body))
    open(at("cut_off.wav"), "wb").write(chunk(b"RIFF", body)[:-100])
    codes = np.column_stack([u, i]) / 20 * 32767
    codes = np.round(codes).astype("<i2").tobytes()
    fmt = struct.pack("<HHIIHH", 1, 2, 1000, 4000, 4, 16)
    # Big-endian; integers of 64 bits; a recorder that was switched off before it wrote the lengths.
    turned = lambda name, body: name + struct.pack(">I", len(body)) + body
    body = b"WAVE" + turned(b"fmt ", struct.pack(">HHIIHH", 1, 2, 1000, 4000, 4, 16))
    codes_of_16 = np.frombuffer(codes, "<i2").astype(">i2").tobytes()
    open(at("rifx.wav"), "wb").write(turned(b"RIFX", body + turned(b"data", codes_of_16)))
    wide = np.round(np.column_stack([u, i]) / 20 * 2.0**63).astype("<i8").tobytes()
    body = b"WAVE" + chunk(b"fmt ", struct.pack("<HHIIHH", 1, 2, 1000, 16000, 16, 64)) + chunk(b"data", wide)
    open(at("int64.wav"), "wb").write(chunk(b"RIFF", body))
    body = b"WAVE" + chunk(b"fmt ", fmt) + b"data" + struct.pack("<I", 0) + codes
    open(at("switched_off.wav"), "wb").write(b"RIFF" + struct.pack("<I", 0) + body)
    body = b"WAVE" + chunk(b"fmt ", struct.pack("<HHIIHH", 7, 2, 1000, 2000, 2, 8)) + chunk(b"data", codes[: 2 * N])
    open(at("mu_law.wav"), "wb").write(chunk(b"RIFF", body))
    body = b"WAVE" + chunk(b"fmt ", struct.pack("<HHIIHH", 1, 2, 1000, 8000, 8, 24)) + chunk(b"data", codes)
    open(at("wide_frames.wav"), "wb").write(chunk(b"RIFF", body))
    large = struct.pack("<QQQI", 0, len(codes), N, 0)
    everywhere = struct.pack("<I", 0xFFFFFFFF)
    body = b"WAVE" + chunk(b"ds64", large) + chunk(b"fmt ", fmt) + b"data" + everywhere + codes
    open(at("rf64.wav"), "wb").write(b"RF64" + everywhere + body)


if __name__ == "__main__":
    os.makedirs(HERE, exist_ok=True)
    for make in (mdf, parquet, hdf5, matlab, matlab_73, numpy, tdms, wav):
        make()
