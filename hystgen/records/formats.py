"""Which reader reads a file: by its first bytes, and by its suffix only where these do not tell.

To add a format, add a module to this package and an entry to `BY_BYTES`, or to `BY_SUFFIX` if its files have no mark.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import IO

from hystgen.records.analyzer import read_aixacct
from hystgen.records.array_files import read_mat, read_npy, read_npz
from hystgen.records.arrow import read_arrow
from hystgen.records.csv_file import read_csv
from hystgen.records.hdf5 import read_hdf5, read_mat_73
from hystgen.records.igor import is_igor, read_igor
from hystgen.records.json_file import read_json
from hystgen.records.mdf import read_mdf
from hystgen.records.netcdf import read_netcdf
from hystgen.records.parquet import read_parquet
from hystgen.records.reading import Reading, Table
from hystgen.records.spreadsheet import read_xlsx
from hystgen.records.tdms import read_tdms
from hystgen.records.universal import read_universal

Reader = Callable[[Reading, IO[bytes]], Table]

_HDF5 = b"\x89HDF\r\n\x1a\n"

USER_BLOCKS = (0, 512, 1024, 2048)
"""[bytes] Where an HDF5 file may begin, after a header of another program."""


def _any_mat(reading: Reading, stream: IO[bytes]) -> Table:
    """A MATLAB file of either kind: v7.3 is HDF5 after a 512-byte header of MATLAB's own."""
    start = stream.read(520)
    stream.seek(0)
    if start[:10] == b"MATLAB 7.3" or _HDF5 in (start[:8], start[512:]):
        return read_mat_73(reading, stream)
    return read_mat(reading, stream)


BY_SUFFIX: dict[str, Reader] = {
    ".npy": read_npy,
    ".npz": read_npz,
    ".mat": _any_mat,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".hdf": read_hdf5,
    ".nc": read_hdf5,
    ".nxs": read_hdf5,
    ".tdms": read_tdms,
    ".parquet": read_parquet,
    ".pq": read_parquet,
    ".feather": read_arrow,
    ".arrow": read_arrow,
    ".arrows": read_arrow,
    ".xlsx": read_xlsx,
    ".xlsm": read_xlsx,
    ".mf4": read_mdf,
    ".mdf": read_mdf,
    ".ibw": read_igor,
    ".uff": read_universal,
    ".unv": read_universal,
    ".json": read_json,
    ".jsonl": read_json,
    ".ndjson": read_json,
}
"""Readers by suffix in lower case, for files whose first bytes are those of no format; any other file is text."""

BY_BYTES: Mapping[bytes, Reader] = {
    b"\x93NUMPY": read_npy,
    b"MATLAB ": _any_mat,
    b"TDSm": read_tdms,
    b"PAR1": read_parquet,
    b"ARROW1\0\0": read_arrow,
    b"FEA1": read_arrow,
    b"MDF  ": read_mdf,
    b"UnFinMF": read_mdf,
    b"CDF\x01": read_netcdf,
    b"CDF\x02": read_netcdf,
    b"DynamicHysteresisResult": read_aixacct,
    b"PiezoResult": read_aixacct,
    b"PulseResult": read_aixacct,
    b"LeakageResult": read_aixacct,
    b"Fatigue": read_aixacct,
}
"""Readers by the bytes that a file begins with."""

FOREIGN: Mapping[bytes, str] = {
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": "is a pre-2007 Excel workbook (.xls); save it as .xlsx or CSV",
    b"\x28\xb5\x2f\xfd": "is packed with Zstandard; unpack it with zstd -d",
    b"7z\xbc\xaf\x27\x1c": "is a 7-Zip archive; unpack it, or pack it as zip",
    b"Rar!\x1a\x07": "is a RAR archive; unpack it, or pack it as zip",
    b"TDSh": "is the index of a TDMS file; give the .tdms file beside it",
    b"\x0e\x03\x13\x01": "is an HDF4 file; convert it with h4toh5convert, or export CSV",
    b":WFM#": "is a waveform file of a Tektronix oscilloscope; save the waveforms as CSV",
    b"SQLite format 3\0": "is an SQLite database; export the table as CSV",
    b"CDF\x05": "is a netCDF file of 64-bit data; convert it with nccopy -k nc4",
}
"""What to do about files of formats that are not read, by the bytes that they begin with."""

_JSON = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\{\s*[\"}]|\[\s*[\[{])")
_UNIVERSAL = re.compile(rb"\s*-1\s*\r?\n\s*\d{1,4}b?\b")


WITH_PARTS: frozenset[Reader] = frozenset((read_xlsx, read_aixacct))
"""Readers of files with several tables, of which the user may name one."""


def reader(reading: Reading, start: bytes, suffix: str) -> Reader:
    """The reader of a file, from its first bytes and its suffix in lower case. Raises RecordError for a known format
    that is not read."""
    by_suffix = BY_SUFFIX.get(suffix)
    foreign = next((advice for mark, advice in FOREIGN.items() if start.startswith(mark)), "")
    if start[2:7] == b":WFM#" or b"WAVEDESC" in start[:64]:
        foreign = "is a waveform file of an oscilloscope; save the waveforms as CSV"
    if foreign:
        raise reading.refuse(foreign)
    if any(start[place : place + len(_HDF5)] == _HDF5 for place in USER_BLOCKS):
        return _any_mat if suffix == ".mat" or start[:10] == b"MATLAB 7.3" else read_hdf5
    if start.startswith(b"PK\x03\x04"):
        if b"mimetypeapplication/vnd.oasis" in start[:120] or b"xl/workbook.bin" in start:
            raise reading.refuse("is a workbook that is not .xlsx; save it as .xlsx or CSV")
        return read_npz if by_suffix is read_npz or b".npy" in start[:200] else read_xlsx
    found = next((each for mark, each in BY_BYTES.items() if start.startswith(mark)), None)
    if found is not None:
        return found
    if start.startswith(b"\xff\xff\xff\xff") and len(start) > 8:
        return read_arrow
    if 0 in start[:2] and is_igor(start):
        return read_igor
    if _UNIVERSAL.match(start):
        return read_universal
    if _JSON.match(start):
        return read_json
    return by_suffix or read_csv
