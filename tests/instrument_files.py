"""Files of instruments and programs for tests, written with each format's own library, or by hand from its maker's or a
public reader's description where there is none. Nothing here uses the package."""

from __future__ import annotations

import bz2
import datetime as dt
import gzip
import io
import json
import lzma
import struct
import tarfile
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pyuff
import scipy.io
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter
from numpy.typing import NDArray
from pyarrow import feather, ipc

N = 60
STEP = 0.002
T = np.arange(N) * STEP
V = np.round(30.0 * np.sin(0.25 * np.arange(N)), 6)
Y = np.round(0.4 * V - 2.0, 6)

Array = NDArray[np.float64]


def csv_text(names: Sequence[str] = ("t", "v", "y"), columns: Sequence[Any] = (T, V, Y), mark: str = ",") -> str:
    rows = [mark.join(str(x) for x in row) for row in zip(*(list(column) for column in columns), strict=True)]
    return "\n".join([mark.join(names), *rows]) + "\n"


def csv(path: Path) -> None:
    path.write_text(csv_text())


# Packed ---------------------------------------------------------------------------------------------------------------


def packed(pack: Callable[[bytes], bytes]) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(pack(csv_text().encode()))


def zipped(members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data, zipfile.ZIP_STORED if name == "mimetype" else None)
    return file.getvalue()


def tarred(members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w:gz") as archive:
        for name, data in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return file.getvalue()


PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "gzip": gzip.compress,
    "xz": lzma.compress,
    "bzip2": bz2.compress,
    "zip": lambda data: zipped({"__MACOSX/._sweep.csv": b"\0\5", "runs/sweep.csv": data}),
    "tar.gz": lambda data: tarred({"sweep.csv": data}),
}


def saved(write: Callable[[Path], None], name: str, folder: Path) -> bytes:
    path = folder / name
    write(path)
    return path.read_bytes()


# NumPy ----------------------------------------------------------------------------------------------------------------


def npy(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.column_stack([T, V, Y]))


def npy_fields(path: Path) -> None:
    rows = np.array(list(zip(T, V, Y, strict=True)), dtype=[("t", "f8"), ("v", "f8"), ("y", "f8")])
    with path.open("wb") as file:
        np.save(file, rows)


# Excel ----------------------------------------------------------------------------------------------------------------


def xlsx(path: Path) -> None:
    book = openpyxl.Workbook()
    notes = book.active
    assert notes is not None
    notes.title = "Notes"
    notes.append(["operator", "Jane"])
    sheet = book.create_sheet("Run 1")
    for row in (["stage X"], [], ["Time", "Drive", "Position"], ["s", "V", "um"]):
        sheet.append(row)
    for row in zip(T, V, Y, strict=True):
        sheet.append([float(x) for x in row])
    book.save(path)


def xlsx_dated(path: Path) -> None:
    """Times as dates of Excel, which are days in a double."""
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Time", "Drive [V]", "Position [um]"])
    for t, v, y in zip(T, V, Y, strict=True):
        sheet.append([45678.5 + float(t) / 86400.0, float(v), float(y)])
        sheet.cell(sheet.max_row, 1).number_format = "yyyy-mm-dd hh:mm:ss.000"
    book.save(path)


def xlsx_two(path: Path) -> None:
    book = openpyxl.Workbook()
    for name, factor in (("Run 1", 1.0), ("Run 2", 2.0)):
        sheet = book.create_sheet(name)
        sheet.append(["t", "v", "y"])
        for t, v, y in zip(T, V, Y, strict=True):
            sheet.append([float(t), float(v) * factor, float(y)])
    book.save(path)


# Arrow, HDF5 and its relatives ----------------------------------------------------------------------------------------


def table() -> pa.Table:
    return pa.table({"t": T, "v": V, "y": Y})


def feather_2(path: Path) -> None:
    feather.write_feather(table(), path)


def arrow_stream(path: Path) -> None:
    with ipc.new_stream(path, table().schema) as out:
        out.write_table(table())


def parquet(path: Path) -> None:
    pq.write_table(table(), path)


def parquet_zoned(path: Path) -> None:
    """A time index of pandas with a zone, which is the last column and has no telling name."""
    start = dt.datetime(2025, 3, 30, 1, 59, 59, 950000, tzinfo=dt.UTC)
    stamps = pa.array([start + dt.timedelta(seconds=float(t)) for t in T], pa.timestamp("us", "Europe/Berlin"))
    pq.write_table(pa.table({"v": V, "y": Y, "__index_level_0__": stamps}), path)


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, x in (("t", T), ("v", V), ("y", Y)):
            file[name] = x


def netcdf_4(path: Path) -> None:
    """As netCDF4 and xarray write it: dimension scales, CF units, packed integers with a fill value."""
    with h5py.File(path, "w") as file:
        file.attrs["_NCProperties"] = "version=2,netcdf=4.9.2,hdf5=1.14.0"
        time = file.create_dataset("time", data=T)
        time.make_scale("time")
        time.attrs["units"] = "seconds since 2025-03-01 10:00:00"
        for name, x, unit in (("drive", V, "V"), ("displacement", Y, "um")):
            data = np.round(x / 1e-6).astype(np.int32)
            data[7] = -2147483647
            variable = file.create_dataset(name, data=data)
            variable.dims[0].attach_scale(time)
            variable.attrs["units"] = unit
            variable.attrs["scale_factor"] = 1e-6
            variable.attrs["_FillValue"] = np.int32(-2147483647)


def netcdf_3(path: Path) -> None:
    with scipy.io.netcdf_file(path, "w") as file:
        file.createDimension("time", N)
        for name, x, unit in (("time", T, "s"), ("drive", V, "V"), ("displacement", Y, "um")):
            variable = file.createVariable(name, "d", ("time",))
            variable[:] = x
            variable.units = unit
        variable.missing_value = np.float64(Y[7])


def nexus(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["default"] = "entry"
        entry = file.create_group("entry")
        entry.attrs["NX_class"] = "NXentry"
        data = entry.create_group("data")
        data.attrs["NX_class"], data.attrs["signal"], data.attrs["axes"] = "NXdata", "position", "time"
        for name, x, unit in (("time", T, "s"), ("voltage", V, "V"), ("position", Y, "um")):
            data[name] = x
            data[name].attrs["units"] = unit
        other = entry.create_group("log")
        other["time"] = np.arange(5.0)
        other["chamber"] = np.ones(5)


def matrix_with_rate(name: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["scan/data"] = np.column_stack([V, Y])
            file["scan/data"].attrs[name] = 1.0 / STEP

    return write


def rows_of_hdf5(path: Path) -> None:
    """A table of PyTables: one dataset of rows with named fields."""
    rows = np.array(list(zip(T, V, Y, strict=True)), dtype=[("t", "f8"), ("v", "f8"), ("y", "f8")])
    with h5py.File(path, "w") as file:
        file["run/table"] = rows


# MATLAB ---------------------------------------------------------------------------------------------------------------


def mat_element(kind: int, data: bytes) -> bytes:
    if 0 < len(data) <= 4:  # in its own tag, as MATLAB does
        return struct.pack("<HH", kind, len(data)) + data.ljust(4, b"\0")
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def mat_object(name: str, kind: str) -> bytes:
    """A variable with an object, by the layout of MAT-file level 5: flags, name, type system, class, references."""
    text = [mat_element(1, each.encode()) for each in (name, "MCOS", kind)]
    numbers = struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)
    dimensions = mat_element(5, struct.pack("<2i", 6, 1))
    inner = mat_element(6, struct.pack("<2I", 13, 0)) + dimensions + mat_element(1, b"") + mat_element(6, numbers)
    return mat_element(14, mat_element(6, struct.pack("<2I", 17, 0)) + b"".join(text) + mat_element(14, inner))


def mat_with(objects: dict[str, str], **vectors: Array) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        scipy.io.savemat(path, vectors)
        path.write_bytes(path.read_bytes() + b"".join(mat_object(name, kind) for name, kind in objects.items()))

    return write


def mat_73_with(objects: dict[str, str]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, kind in objects.items():
                file[name] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32)
                file[name].attrs["MATLAB_class"] = np.bytes_(kind)
                file[name].attrs["MATLAB_object_decode"] = np.int32(3)
        with path.open("r+b") as out:
            out.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b"\0" * 8 + b"\x00\x02IM")

    return write


# MDF, Igor, universal file, TDMS --------------------------------------------------------------------------------------


def mdf(version: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with MDF(version=version) as file:
            file.append([Signal(V, T, unit="V", name="Drive"), Signal(Y, T, unit="um", name="Position")])
            file.append([Signal(np.arange(9.0), np.arange(9) * 0.1, unit="degC", name="stage_temperature")])
            file.save(path.with_suffix(".mf4" if version[0] == "4" else ".mdf"), overwrite=True)
        path.with_suffix(".mf4" if version[0] == "4" else ".mdf").rename(path)

    return write


def mdf_invalid(path: Path) -> None:
    wrong = np.arange(N) == 7
    with MDF(version="4.10") as file:
        file.append([Signal(V, T, name="v"), Signal(np.where(wrong, 1e3, Y), T, name="y", invalidation_bits=wrong)])
        file.save(path.with_suffix(".mf4"), overwrite=True)
    path.with_suffix(".mf4").rename(path)


def ibw(data: Array, name: str, labels: Sequence[str] = (), order: str = "<", unit: str = "s") -> bytes:
    """An Igor binary wave of version 5, by Technical Note 003 of its maker."""
    rows = (*data.shape, *[0] * (4 - data.ndim))
    body = data.astype(f"{order}f8").tobytes(order="F")
    texts = b"".join(label.encode().ljust(32, b"\0") for label in ["", *labels]) if labels else b""
    head = struct.pack(
        f"{order}IIIihh6xh32siI", 0, 0, 0, data.size, 4, 0, 1, name.encode(), 0, 0
    ) + struct.pack(f"{order}4i4d4d", *rows, STEP, 1, 1, 1, 0, 0, 0, 0)
    head += b"V\0\0\0" + unit.encode().ljust(4, b"\0") + bytes(12) + struct.pack(f"{order}hhdd", 0, 0, 0, 0)
    head = head.ljust(320, b"\0")
    sizes = [*[0] * 8, len(texts), *[0] * 5]  # the ninth is that of the labels of columns

    def first(checksum: int) -> bytes:
        return struct.pack(f"{order}hHi14i", 5, checksum & 0xFFFF, 320 + len(body), *sizes)

    total = sum(struct.unpack(f"{order}192h", first(0) + head))
    return first(-total) + head + body + texts


def ibw_labelled(path: Path) -> None:
    path.write_bytes(ibw(np.column_stack([V, Y]), "scan", ["Drive", "ZSensor"]))


def universal(binary: int) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        target = path.with_suffix(".uff")
        target.unlink(missing_ok=True)
        for node, (x, label, unit) in enumerate(((V, "Drive", "V"), (Y, "Position", "um")), 1):
            made = {
                "type": 58, "binary": binary, "func_type": 1, "rsp_node": node, "rsp_dir": 3, "ref_node": 0,
                "ref_dir": 0, "data": x, "x": T, "id1": "run 3", "rsp_ent_name": "NONE", "ref_ent_name": "NONE",
                "ver_num": 0, "load_case_id": 0, "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": STEP,
                "z_axis_value": 0,
                "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 0,
                "ordinate_axis_lab": label, "ordinate_axis_units_lab": unit, "abscissa_axis_lab": "Time",
                "abscissa_axis_units_lab": "s", "ord_data_type": 4,
            }  # fmt: skip
            pyuff.UFF(str(target)).write_sets(made, "add")
        target.rename(path)

    return write


def tdms(apart: float) -> Callable[[Path], None]:
    start = dt.datetime(2025, 3, 1, 10)

    def properties(later: float) -> dict[str, Any]:
        begins = start + dt.timedelta(seconds=later)
        return {"wf_increment": STEP, "wf_start_time": begins, "wf_start_offset": 0.0, "wf_samples": N}

    def write(path: Path) -> None:
        with TdmsWriter(path) as file:
            drive = ChannelObject("AI", "Drive", V, properties=properties(0.0))
            file.write_segment([drive, ChannelObject("AI", "Position", Y, properties=properties(apart))])

    return write


# JSON -----------------------------------------------------------------------------------------------------------------


def json_of(value: Any) -> Callable[[Path], object]:
    return lambda path: path.write_text(json.dumps(value))


def samples() -> list[dict[str, float]]:
    return [{"t": float(t), "v": float(v), "y": float(y)} for t, v, y in zip(T, V, Y, strict=True)]


COLUMNS: dict[str, list[float]] = {"t": T.tolist(), "v": V.tolist(), "y": Y.tolist()}


def json_by_row(path: Path) -> None:
    """As `DataFrame.to_json` writes a frame."""
    path.write_text(json.dumps({k: {str(i): x for i, x in enumerate(column)} for k, column in COLUMNS.items()}))


def json_with_names(path: Path) -> None:
    path.write_text(json.dumps({"columns": ["t", "v", "y"], "data": np.column_stack([T, V, Y]).tolist()}))


def json_of_signals(path: Path) -> None:
    drive = {"name": "drive", "unit": "V", "values": V.tolist()}
    position = {"name": "position", "unit": "um", "values": Y.tolist()}
    path.write_text(json.dumps({"fs": 1.0 / STEP, "signals": [drive, position]}))


def json_lines(path: Path) -> None:
    path.write_text("".join(json.dumps({**each, "state": "run"}) + "\n" for each in samples()))


# Text of instruments --------------------------------------------------------------------------------------------------


def gw_instek(mode: str) -> Callable[[Path], None]:
    """Both modes of the GDS-2000A and later, as OpenQlab's importer describes them."""

    def write(path: Path) -> None:
        settings = [
            ("Format", "1.0B", ""), ("Memory Length", str(N), str(N)), ("Trigger Level", "0.0", "0.0"),
            ("Source", "CH1", "CH2"), ("Vertical Units", "V", "V"), ("Label", "Drive", "Position"),
            ("Vertical Scale", "1.000E+01", "5.000E+00"), ("Horizontal Units", "S", "S"),
            ("Horizontal Scale", "2.0E-02", "2.0E-02"), ("Sampling Period", f"{STEP:.3E}", f"{STEP:.3E}"),
            ("Mode", mode, mode),
        ]  # fmt: skip
        lines = [f"{key},{a},{f'{key},{b},' if b else ''}" for key, a, b in settings] + ["Waveform Data,"]
        for t, v, y in zip(T, V, Y, strict=True):
            fast = f"{v * 25 / 10:.6f},,{y * 25 / 5:.6f},,"
            lines.append(f"{t:.6e},{v:.6f},{t:.6e},{y:.6f}," if mode == "Detail" else fast)
        path.write_text("\n".join(lines) + "\n")

    return write


def gw_instek_old(path: Path, data: Array = V) -> None:
    """One channel of a GDS-1000: codes, 25 in a division."""
    lines = [
        f"Memory Length,{N}", "Trigger Level,0.0V", "Source,CH1", "Probe,1.000E+00", "Vertical Units,V",
        "Vertical Scale,1.000E+01", "Vertical Position,0.0", "Horizontal Units,S", "Horizontal Scale,2.0E-02",
        "Horizontal Position,0.0", "Horizontal Mode,Main", f"Sampling Period,{STEP:.3E}", "Firmware,V1.09",
        "Time,05-Mar-24 14:21:05", "Waveform Data,", *(f"{x * 2.5:.6f}" for x in data),
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


def twincat(later: float = 0.0, mark: str = "\t", decimal: str = ".") -> Callable[[Path], None]:
    """As TwinCAT 3 Scope exports it: a column of times in ms in front of each group of channels."""

    def write(path: Path) -> None:
        settings = [
            ("SymbolComment", "", ""), ("Data-Type", "REAL64", "REAL64"), ("SampleTime[ms]", "2", "2"),
            ("VariableSize", "8", "8"), ("SymbolName", "MAIN.fDrive", "MAIN.fPosition"), ("Offset", "0", "0"),
            ("Unit", "V (Voltage)", "µm (Length)"), ("Unit ScaleFactor", "1", "1"),
        ]  # fmt: skip
        lines = [
            mark.join(("Name", "scope_1")), mark.join(("File", "C:\\scope_1.csv")),
            mark.join(("Starttime of export", "132959733843760000", "Montag, 2. Mai 2022", "15:56:24.376")),
            mark.join(("Endtime of export", "132959733853750000", "Montag, 2. Mai 2022", "15:56:25.375")), "", "",
        ]
        names = ("Name", "Drive", "Name", "Position")
        lines += [mark.join(names), *(mark.join((key, a, key, b)) for key, a, b in settings), ""]
        for t, v, y in zip(T, V, Y, strict=True):
            cells = (f"{1e3 * t:.3f}", f"{v:.6f}", f"{1e3 * (t + later):.3f}", f"{y:.6f}")
            lines.append(mark.join(cells).replace(".", decimal))
        path.write_text("\r\n".join([*lines, "EOF"]) + "\r\n", encoding="utf-8", newline="")

    return write


def twincat_groups(full: bool) -> Callable[[Path], None]:
    """Groups of channels with sample times of their own, which therefore end in different rows."""

    def write(path: Path) -> None:
        settings = [
            ("Name", "fast", "Drive", "Position", "slow"), ("Data-Type", *["REAL64"] * 4),
            ("SampleTime[ms]", "0,2", "2", "2", "5"), ("Unit", "(None)", "V (Voltage)", "(None)", "(None)"),
        ]  # fmt: skip
        lines = ["Name\tscope_1", "File\tC:\\scope_1.csv", "Starttime of export\t132959733843760000", ""]
        lines += ["\t".join((key, a, key, b, c, key, d)) for key, a, b, c, d in settings] + [""]
        for k in range(10 * N):
            group = f"{2 * k}\t{V[k]}\t{Y[k]}" if k < N else "\t\t"
            last = f"{5 * k}\t{k}" if k < N * 2 // 5 else "\t"
            cells = f"{0.2 * k:.1f}\t{k}\t{group}\t{last}"
            lines.append(cells if full else cells.rstrip("\t"))
        path.write_text("\n".join(lines) + "\n")

    return write


def aixacct(tables: int) -> Callable[[Path], None]:
    """Loops of a piezoelectric sample, as public scripts for the TF Analyzer describe them."""

    def write(path: Path) -> None:
        lines = ["PiezoResult", "Table 1", "Table No [#]\tAmplitude [V]\tDvmax+ [nm/V]"]
        lines += [f"{k + 1}\t{30.0 * (k + 1):.3e}\t1.2e+000" for k in range(tables)]
        lines += ["", "Piezo", "TfaModule: PZM", "TfaVersion: 3.2", ""]
        for k in range(tables):
            lines += [
                f"Table {k + 1}", "Timestamp: 05/03/2024 14:21:05", "Waveform: triangle", "SampleName: X",
                "Area [mm2]: 1.0", "Thickness [nm]: 900000", "Hysteresis Frequency [Hz]: 8.3",
                "Time [s]\tV+ [V]\tV- [V]\tI1 [A]\tP1 [uC/cm2]\tD1 [nm]\tD2 [nm]\t",
            ]  # fmt: skip
            for t, v, y in zip(T, V * (k + 1), Y, strict=True):
                lines.append(f"{t:.6e}\t{v:.9e}\t{-v:.9e}\t1.0e-009\t{v / 10:.6e}\t{y:.9e}\t0.0\t")
            lines.append("")
        path.write_text("\r\n".join(lines) + "\r\n", newline="")

    return write


def channel(data: Array, name: str = "Ampl", start: float = 0.0) -> str:
    """One channel of a LeCroy or Siglent oscilloscope."""
    rows = [f"{t + start:.6f},{x:.6f}" for t, x in zip(T, data, strict=True)]
    head = ["LECROYWS64Xs,6442,Waveform", f"Segments,1,SegmentSize,{len(data)}", "Segment,TrigTime,TimeSinceSegment1"]
    return "\n".join([*head, "#1,05-Mar-2024 14:21:05,0", f"Time,{name}", *rows]) + "\n"


# Times, numbers and names in text -------------------------------------------------------------------------------------


def empty_rows(path: Path) -> None:
    path.write_text(csv_text() + ",,\n" * 40)


def minus_signs(path: Path) -> None:
    path.write_text(csv_text().replace("-", "\N{MINUS SIGN}"), encoding="utf-8")


def control_names(path: Path) -> None:
    path.write_text(csv_text(("t\x1b", "a\x07", "b\x08")))


def days(zero: float, step: float = STEP, name: str = "Time") -> Callable[[Path], object]:
    stamps = [f"{zero + k * step / 86400.0:.14f}" for k in range(N)]
    return lambda path: path.write_text(csv_text((name, "v", "y"), (stamps, V, Y)))


def stamps(style: str) -> Callable[[Path], object]:
    """Local times in Berlin around a change of summer time, from 0.05 s in front of it on."""
    autumn, spring = dt.datetime(2025, 10, 26, 0, 59, 59, 950000), dt.datetime(2025, 3, 30, 0, 59, 59, 950000)
    start, before, behind = (spring, 1, 2) if style == "spring" else (autumn, 2, 1)
    change = start.replace(microsecond=0) + dt.timedelta(seconds=1)
    cells = []
    for t in T:
        utc = start + dt.timedelta(seconds=float(t))
        ahead = before if utc < change else behind
        local = utc + dt.timedelta(hours=ahead)
        offset, name = f"+0{ahead}:00", " CEST" if ahead == 2 else " CET"
        zone = {"offset": offset, "name": name, "java": f"{offset}[Europe/Berlin]"}
        text = local.isoformat("T" if style == "offset" else " ", "microseconds")
        cells.append(text + zone.get(style, ""))
    return lambda path: path.write_text(csv_text(("Time", "v", "y"), (cells, V, Y)))


def matlab_dates(path: Path) -> None:
    """As MATLAB writes datetimes into text."""
    start = dt.datetime(2024, 3, 5, 23, 59, 59, 950000)
    cells = [(start + dt.timedelta(seconds=float(t))).strftime("%d-%b-%Y %H:%M:%S.%f") for t in T]
    path.write_text(csv_text(("Time", "v", "y"), (cells, V, Y)))


# Odd files ------------------------------------------------------------------------------------------------------------


def packed_often(times: int) -> bytes:
    data = csv_text().encode()
    for _ in range(times):
        data = gzip.compress(data)
    return data


def pickled() -> bytes:
    file = io.BytesIO()
    np.save(file, np.array({"t": T}, dtype=object), allow_pickle=True)
    return file.getvalue()


def vector(data: Array) -> bytes:
    file = io.BytesIO()
    np.save(file, data)
    return file.getvalue()


def with_password(archive: bytes) -> bytes:
    """The flag of an encrypted member set in both of its headers."""
    data = bytearray(archive)
    data[6] |= 1
    data[data.index(b"PK\1\2") + 8] |= 1
    return bytes(data)
