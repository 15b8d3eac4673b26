"""Files of instruments, written here from their makers' descriptions of the formats."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from nptdms import ChannelObject, TdmsWriter

from hystgen.basics import extras
from hystgen.records import Record, RecordError, csv_file, parse_columns, read_record

N = 50
T = np.arange(N) * 0.001
V = np.round(30.0 * np.sin(0.25 * np.arange(N)), 6)
Y = np.round(0.4 * V - 2.0, 6)


def put(path: Path, lines: Sequence[str], end: str = "\r\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode("latin-1"))
    return path


def check(record: Record, rest: float = 0.0) -> None:
    assert record.t - record.t[0] == pytest.approx(T, abs=1e-12)
    assert np.array_equal(record.v, V)
    assert record.y is not None
    assert np.array_equal(record.y, Y)
    assert record.t[0] == pytest.approx(rest)


def problem(path: Path, **options: Any) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    (only,) = caught.value.problems
    return only.removeprefix(str(path))


# LabVIEW, by NI's specification of .lvm files -------------------------------------------------------------------------


def lvm(
    kept: str = "One",
    separator: str = "Tab",
    decimal: str = ".",
    comment: bool = True,
    steps: tuple[str, str] = ("1.000000E-3", "1.000000E-3"),
) -> list[str]:
    mark = "\t" if separator == "Tab" else ","
    head = [
        ("LabVIEW Measurement", ""), ("Writer_Version", "2"), ("Reader_Version", "2"), ("Separator", separator),
        ("Decimal_Separator", decimal), ("Multi_Headings", "No"), ("X_Columns", kept), ("Time_Pref", "Relative"),
        ("Operator", "Jane"), ("Date", "2024/03/05"), ("Time", "14:21:05.123"), ("***End_of_Header***", ""), ("", ""),
        ("***Start_Special***", ""), ("Delta_X", "7"), ("***End_Special***", ""),
        ("Channels", "2", ""), ("Samples", str(N), str(N), ""), ("Date", "2024/03/05", "2024/03/05", ""),
        ("Y_Unit_Label", "V", "um", ""), ("X_Dimension", "Time", "Time", ""), ("X0", f"0{decimal}0", "0.0", ""),
        ("Delta_X", *steps, ""), ("***End_of_Header***", "", "", ""),
    ]  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for t, v, y in zip(T, V, Y, strict=True):
        one = {"One": ("{t}", "{v}", "{y}"), "No": ("", "{v}", "{y}"), "Multi": ("{t}", "{v}", "{t}", "{y}")}[kept]
        rows.append(tuple(cell.format(t=f"{t:.6f}", v=f"{v:.6f}", y=f"{y:.6f}") for cell in one))
    names = ("X_Value", "Drive", "X_Value", "Position") if kept == "Multi" else ("X_Value", "Drive", "Position")
    if comment:
        names = (*names, "Comment")
    lines = [mark.join(cells) for cells in (*head, names)]
    return lines + [mark.join(row).replace(".", decimal) for row in rows]


@pytest.mark.parametrize("kept", ["One", "No", "Multi"])
@pytest.mark.parametrize(("separator", "decimal"), [("Tab", "."), ("Tab", ","), ("Comma", ".")])
@pytest.mark.parametrize("comment", [True, False])
def test_labview(tmp_path: Path, kept: str, separator: str, decimal: str, comment: bool) -> None:
    record = read_record(put(tmp_path / "a.lvm", lvm(kept, separator, decimal, comment)))
    check(record)
    assert record.units == ({"v": "V", "y": "um"} if kept == "No" else {"t": "s", "v": "V", "y": "um"})
    assert record.extra == {}
    assert record.notes == ()
    assert record.read_as.startswith("LabVIEW measurement file; ")


def test_labview_with_comments_and_faults(tmp_path: Path) -> None:
    lines = lvm()
    first = len(lines) - N
    lines[first] += "\tstarted by hand"
    check(read_record(put(tmp_path / "a.lvm", lines)))
    bad = [*lines]
    bad[first + 3] = bad[first + 3].replace(f"{V[3]:.6f}", "overload")
    said = problem(put(tmp_path / "b.lvm", bad))
    assert f':{first + 4}:10: error: "overload" in column "Drive" is not a number' in said
    several = [*lvm("No"), *lvm("No")[16:]]
    assert "contains a second table" in problem(put(tmp_path / "c.lvm", several))
    text = problem(put(tmp_path / "d.lvm", lvm("Multi", steps=("1E-3", "2E-3"))))
    assert "channels have separate times" in text
    cut = read_record(put(tmp_path / "e.lvm", lines[:-10]))
    assert cut.notes == ("the file says that it has 50 samples, but it has 40",)
    assert "without a segment" in problem(put(tmp_path / "f.lvm", lines[:14]))


def test_labview_in_segments(tmp_path: Path) -> None:
    """Each segment has its own header; relative times count from the segment's date and time."""
    for pref, shift in (("Relative", 120.5), ("Absolute", 120.5)):
        first = [line.replace("Relative", pref) for line in lvm()]
        first.insert(19, "\t".join(("Time", "14:21:05.0", "14:21:05.0", "")))
        later = [line.replace("Time\t14:21:05.0", "Time\t14:23:05.5") for line in first[13:]]
        if pref == "Absolute":
            rows = [line.split("\t") for line in later[-N:]]
            later[-N:] = ["\t".join([f"{float(cells[0]) + shift:.6f}", *cells[1:]]) for cells in rows]
        path = put(tmp_path / "a.lvm", [*first, "", *later])
        record = read_record(path)
        np.testing.assert_allclose(record.t, np.concatenate([T, T + shift]), rtol=0, atol=1e-6)
        np.testing.assert_allclose(record.v, np.tile(V, 2), rtol=0, atol=1e-6)
        np.testing.assert_allclose(record.y, np.tile(Y, 2), rtol=0, atol=1e-6)
        assert "2 segments" in record.read_as
        bad = [*first, "", *later]
        bad[-1] = bad[-1].replace(f"{V[-1]:.6f}", "overload")
        assert f":{len(bad)}:" in problem(put(tmp_path / "b.lvm", bad))
    other = [*first, "", *(line.replace("Position", "Current") for line in later)]
    assert "a segment with other channels" in problem(put(tmp_path / "c.lvm", other))
    unended = read_record(put(tmp_path / "e.lvm", [*first, "", *first[13:20]]))
    assert unended.notes == ("the last segment has no rows; it was left out",)
    several = [line.replace("1.000000E-3\t1.000000E-3", "1E-3\t2E-3") for line in lvm("Multi")[13:]]
    assert "channels have separate times" in problem(put(tmp_path / "f.lvm", [*lvm("Multi"), "", *several]))
    assert "a segment that begins at 0 s" in problem(put(tmp_path / "d.lvm", [*first, "", *first[13:]]))


@pytest.mark.parametrize("size", [300, 1000, 1 << 20])
def test_a_header_of_a_segment_across_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int) -> None:
    monkeypatch.setattr(csv_file, "BLOCK", size)
    monkeypatch.setattr(csv_file, "SAMPLE", 64)
    monkeypatch.setattr(csv_file, "SAMPLE_LINES", 30)
    first = lvm()
    shifted = first[13:]
    rows = [line.split("\t") for line in shifted[-N:]]
    shifted[-N:] = ["\t".join([f"{float(cells[0]) + 10.0:.6f}", *cells[1:]]) for cells in rows]
    record = read_record(put(tmp_path / "a.lvm", [*first, *shifted]))
    np.testing.assert_allclose(record.t, np.concatenate([T, T + 10.0]), rtol=0, atol=1e-6)


# Tektronix, by the manuals of MDO, MSO and DPO on spreadsheet files -------------------------------------------------


def tektronix(label: str = "Drive,Sensor", unit: str = "V,V") -> list[str]:
    return [
        "Model,MSO3014", "Firmware Version,2.38", "", "Waveform Type,ANALOG", "Point Format,Y", "Horizontal Units,s",
        "Horizontal Scale,0.004", "Horizontal Delay,0", "Sample Interval,0.001", f"Record Length,{N}",
        "Gating,0.0% to 100.0%", "Probe Attenuation,10,1", f"Vertical Units,{unit}", "Vertical Offset,0,0",
        "Vertical Scale,10,1", "Vertical Position,0,0", ",", ",", f"Label,{label}", "TIME,CH1,CH2",
        *(f"{t - 0.02:.8e},{v:.6f},{y:.6f}" for t, v, y in zip(T, V, Y, strict=True)),
    ]  # fmt: skip


def test_tektronix(tmp_path: Path) -> None:
    path = put(tmp_path / "tek0000ALL.csv", tektronix())
    record = read_record(path)
    check(record, -0.02)
    assert record.units == {"t": "s", "v": "V", "y": "V"}
    assert record.read_as == "Tektronix CSV; t = TIME, v = Drive, y = Sensor"
    check(read_record(path, {"v": "CH1", "y": "Sensor"}), -0.02)
    # Without labels nothing says which channel is which
    path = put(tmp_path / "tek0001ALL.csv", tektronix(","))
    assert problem(path) == (
        ':20:1: error: there are no columns "v" and "y" among TIME, CH1, CH2; name them with --columns '
        '"v=COLUMN,y=COLUMN", for example --columns "v=CH1,y=CH2"'
    )
    record = read_record(path, parse_columns("v=CH1,y=CH2"))
    check(record, -0.02)
    assert read_record(put(tmp_path / "a.csv", tektronix(unit="V,A"))).units["y"] == "A"


# Keysight: InfiniiVision with two header lines, DAQ in UTF-16 with lines above the header ----------------------------


def test_keysight(tmp_path: Path) -> None:
    rows = [f"{t - 0.02:.8e},{v:.6f},{y:.6f}" for t, v, y in zip(T, V, Y, strict=True)]
    path = put(tmp_path / "scope_1.csv", ["x-axis,1,2", "second,Volt,Volt", *rows])
    text = problem(path)
    assert 'there are no columns "v" and "y" among x-axis, 1, 2; name them' in text
    for option in ("v=1,y=2", "1,2,3", "t=x-axis,v=1,y=2"):
        record = read_record(path, parse_columns(option))
        check(record, -0.02)
        assert record.units == {"t": "s", "v": "Volt", "y": "Volt"}
    check(read_record(path, parse_columns("t=#1,v=#2,y=#3")), -0.02)


def test_keysight_daq(tmp_path: Path) -> None:
    start = 14 * 3600 + 21 * 60 + 5
    times = [f"03/05/2024 14:21:{int(start + t) % 60:02}:{round(1000 * t) % 1000:03}" for t in T]
    rows = [f"{k + 1},{t},{v:.6f},{y:.6f}" for k, (t, v, y) in enumerate(zip(times, V, Y, strict=True))]
    lines = ["Name:,Stage X", "Owner:,Jane", "", "Scan,Time,101 Drive (VDC),102 Sensor (VDC)", *rows]
    (tmp_path / "a.csv").write_bytes("\r\n".join(lines).encode("utf-16"))
    record = read_record(tmp_path / "a.csv")
    check(record)
    assert "UTF-16" in record.read_as
    assert "times of day" in record.read_as
    assert list(record.extra) == ["Scan"]


# Physik Instrumente, by the description of GCS arrays ----------------------------------------------------------------


def gcs(separator: int = 32, names: tuple[str, ...] = ("", ""), count: int = N) -> list[str]:
    names = names if names[0] else ("Control Voltage of OutputChan1", "Actual Position of Axis1")
    mark = chr(separator)
    return [
        "# REM E-709 data recorder", "#", "# VERSION = 1", "# TYPE = 1", f"# SEPARATOR = {separator}", "# DIM = 2",
        "# SAMPLE_TIME = 0.001000", f"# NDATA = {count}", "#", *(f"# NAME{k} = {x}" for k, x in enumerate(names)), "#",
        "# END_HEADER",
        *(f"{v:.6f}{mark}{y:.6f}{' ' if separator == 32 else ''}" for v, y in zip(V, Y, strict=True)),
    ]  # fmt: skip


@pytest.mark.parametrize("separator", [32, 9, 44])
def test_pi_gcs(tmp_path: Path, separator: int) -> None:
    record = read_record(put(tmp_path / "record.dat", gcs(separator), "\n"))
    check(record)
    assert record.sample_time == 0.001
    assert record.notes == ()
    assert record.read_as == (
        "PI GCS array; v = Control Voltage of OutputChan1, y = Actual Position of Axis1; time from SAMPLE_TIME 0.001 s "
        "(line 7)"
    )


def test_pi_gcs_that_is_not_clear_or_damaged(tmp_path: Path) -> None:
    names = ("Target Position of Axis1", "Current Position of Axis1")
    path = put(tmp_path / "a.dat", gcs(names=names), "\n")
    assert ':10:1: error: there is no column "v" among Target Position' in problem(path)
    check(read_record(path, {"v": names[0]}))
    cut = read_record(put(tmp_path / "b.dat", gcs(count=N + 1), "\n"))
    assert cut.notes == ("the file says that it has 51 samples, but it has 50",)
    lines = [line.replace("= 0.001000", "= fast") for line in gcs()]
    assert ":7:1: error: SAMPLE_TIME is not a number of seconds" in problem(put(tmp_path / "c.dat", lines, "\n"))
    lines = [line.replace("DIM = 2", "DIM = 3") for line in gcs()]
    assert "2 columns where the header has 3" in problem(put(tmp_path / "d.dat", lines, "\n"), columns={"v": "#1"})


# Other instruments: read as they are, or refused with an example of --columns that works -----------------------------


def rows(form: str) -> list[str]:
    return [form.format(k=k, t=t, ms=1e3 * t, v=v, y=y) for k, (t, v, y) in enumerate(zip(T, V, Y, strict=True))]


YOKOGAWA = [
    '"Header Size","8"', '"Model Name","DL850E"', '"TraceName",{names}', '"VUnit","V","um"',
    '"HResolution","1.000000e-03","1.000000e-03"', '"HUnit","s","s"', '"Date","2024/03/05","2024/03/05"',
]  # fmt: skip
LECROY = [
    "LECROYWS3034Z,0,Waveform,LECROYWS3034Z,0,Waveform", "Segments,1,SegmentSize,50,Segments,1,SegmentSize,50",
    "Segment,TrigTime,TimeSinceSegment1,Segment,TrigTime,TimeSinceSegment1", "Time,Ampl,Time,Ampl",
]  # fmt: skip
STYLES = {
    "rigol": (["X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-0.02,1.0e-03"], "{k},{v:.6f},{y:.6f},,"),
    "new_rigol": (["CH1V,CH2V,t0 =-2.0e-02, tInc = 1.0e-03,"], "{v:.6f},{y:.6f},,"),
    "yokogawa": ([line.format(names='"Drive","Sensor"') for line in YOKOGAWA], ",{v:.6f},{y:.6f}"),
    "yokogawa_channels": ([line.format(names='"CH1","CH2"') for line in YOKOGAWA], ",{v:.6f},{y:.6f}"),
    "siglent": (["Sample Interval,Analog:1.0e-03", "Source,CH1,CH2", "Second,Volt,Volt"], "{t:.6f},{v:.6f},{y:.6f}"),
    "lecroy": (LECROY, "{t:.7f},{v:.6f},{t:.7f},{y:.6f}"),
    "moku": (["% Moku:Go Oscilloscope", "% Time (s), Input 1 (V), Input 2 (V)"], "{t:.6e}, {v:.6f}, {y:.6f}"),
    "hioki": (['"HIOKI 8861","8861-50"', '"Time(s)","CH1-1(V)","CH1-2(V)"'], "{t:.6f},{v:.6f},{y:.6f}"),
    "picoscope": (["Time,Channel A,Channel B", "(ms),(V),(mV)", ""], "{ms:.6f},{v:.6f},{y:.6f}"),
    "saleae": (["Time [s],Channel 0,Channel 1"], "{t:.9f},{v:.9f},{y:.9f}"),
    "pymeasure": (["#Procedure: <a.Sweep>", "#Data:", "Time (s),Voltage (V),Position (um)"], "{t},{v},{y}"),
    "origin": (["Time\tVoltage\tWay", "s\tV\tum", "\tDrive\tSensor"], "{t:.6f}\t{v:.6f}\t{y:.6f}"),
    "counted": (["Index,Time (s),Voltage (V),Reading"], "{k},{t:.6f},{v:.6f},{y:.6f}"),
}  # fmt: skip
ASKED = {
    "rigol": "v=CH1,y=CH2", "new_rigol": "v=CH1,y=CH2", "yokogawa_channels": "v=CH1,y=CH2", "siglent": "v=CH1,y=CH2",
    "lecroy": "t=#1,v=#2,y=#4", "moku": "v=Input 1 (V),y=Input 2 (V)", "hioki": "v=CH1-1(V),y=CH1-2(V)",
    "picoscope": "v=Channel A,y=Channel B", "saleae": "v=Channel 0,y=Channel 1", "origin": "y=Way",
    "counted": "y=Reading",
}  # fmt: skip


@pytest.mark.parametrize("style", STYLES)
def test_styles_of_instruments(tmp_path: Path, style: str) -> None:
    head, form = STYLES[style]
    path = put(tmp_path / "a.csv", [*head, *rows(form)])
    if style not in ASKED:
        check(read_record(path))
        return
    text = problem(path)
    assert text.endswith(f', for example --columns "{ASKED[style]}"')
    check(read_record(path, parse_columns(ASKED[style])))


def test_settings_of_instruments_that_say_no_one_time(tmp_path: Path) -> None:
    head = [line.format(names='"Drive","Sensor"').replace('1.000000e-03"', '2.0e-03"', 1) for line in YOKOGAWA]
    path = put(tmp_path / "a.csv", [*head, *rows(",{v:.6f},{y:.6f}")])
    assert problem(path) == ":5:1: error: its channels have different sample rates; export them with one rate"
    path = put(tmp_path / "b.csv", ["CH1V,CH2V,t0 = 0, tInc = fast", *rows("{v:.6f},{y:.6f},,")])
    assert problem(path) == ':1:1: error: tInc has "fast", which is not a number; export it again'


def test_an_overrange_of_picoscope_is_no_value(tmp_path: Path) -> None:
    lines = ["t,v,y", *rows("{t:.6f},{v:.6f},{y:.6f}")]
    lines[8] = lines[8].rpartition(",")[0] + ",\N{INFINITY}"
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    assert read_record(tmp_path / "a.csv").notes == (
        "1 sample without a value in y dropped, the first in line 9",
    )


# TDMS, written by npTDMS ----------------------------------------------------------------------------------------------


def write_tdms(path: Path, channels: dict[str, Any], **properties: dict[str, Any]) -> Path:
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("Scan", name, x, properties.get(name, {})) for name, x in channels.items()])
    return path


def test_tdms(tmp_path: Path) -> None:
    wave = {"wf_increment": 0.001, "wf_start_offset": 0.0, "wf_start_time": np.datetime64("2024-03-05T14:21:05")}
    path = write_tdms(
        tmp_path / "a.tdms", {"Drive": V, "Sensor": Y, "Remark": ["a", "b"]},
        Drive={**wave, "unit_string": "V"}, Sensor={**wave, "NI_UnitDescription": "um"},
    )  # fmt: skip
    record = read_record(path)
    check(record)
    assert record.units == {"v": "V", "y": "um"}
    assert record.read_as == "v = Drive, y = Sensor; time from wf_increment 0.001 s (Scan/Drive)"
    assert record.notes == ("columns without numbers were left out: Scan/Remark",)
    check(read_record(path, parse_columns("v=Scan/Drive,y=Sensor")))
    # Waveforms that start at different times are not put side by side
    later = {**wave, "wf_start_offset": 0.2}
    path = write_tdms(tmp_path / "b.tdms", {"Drive": V, "Sensor": Y}, Drive=wave, Sensor=later)
    assert "the columns start at different times: Scan/Drive at 2024-03-05T14:21:05" in problem(path)
    path = write_tdms(
        tmp_path / "c.tdms", {"Drive": V, "Sensor": Y}, Drive=wave, Sensor={**wave, "wf_increment": 0.002}
    )
    assert "give --sample-time" in problem(path)


def test_tdms_with_times_and_without(tmp_path: Path) -> None:
    path = write_tdms(tmp_path / "a.tdms", {"Time": T * 1e3, "Drive": V, "Sensor": Y}, Time={"unit_string": "ms"})
    record = read_record(path)
    assert record.t == pytest.approx(T, abs=1e-12)
    assert np.array_equal(record.v, V)
    stamps = np.datetime64("2024-03-05T14:21:05") + (np.arange(N) * 1000).astype("timedelta64[us]")
    record = read_record(write_tdms(tmp_path / "b.tdms", {"Timestamp": stamps, "Drive": V, "Sensor": Y}))
    check(record)
    assert record.notes == ("Timestamp holds times of day; it was converted to seconds since the first",)
    path = write_tdms(tmp_path / "c.tdms", {"v": V, "y": Y.astype(np.float32)}, v={"wf_increment": 0.0})
    assert "give --sample-time" in problem(path)
    assert read_record(path, sample_time=0.001).y == pytest.approx(Y, rel=1e-6)
    (tmp_path / "d.tdms").write_bytes(b"something else, not written by LabVIEW")
    assert "is not a TDMS file" in problem(tmp_path / "d.tdms")


def test_tdms_without_its_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_tdms(tmp_path / "a.tdms", {"v": V, "y": Y})
    monkeypatch.setitem(sys.modules, "nptdms", None)
    assert problem(path) == (
        f": error: TDMS files need the package npTDMS; {extras.install('formats')}, or export CSV, .npz or MATLAB .mat "
        "(v7)"
    )


def test_other_rate_of_the_user_counts(tmp_path: Path) -> None:
    assert read_record(put(tmp_path / "a.dat", gcs(), "\n"), sample_time=0.5).sample_time == 0.5


def test_tdms_scaled_from_codes(tmp_path: Path) -> None:
    def scale(slope: float, at_zero: float) -> dict[str, Any]:
        return {
            "NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled", "NI_Scale[0]_Scale_Type": "Linear",
            "NI_Scale[0]_Linear_Slope": slope, "NI_Scale[0]_Linear_Y_Intercept": at_zero,
            "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF, "wf_increment": 0.001,
        }  # fmt: skip

    codes = {"Drive": np.round(V / 0.002).astype(np.int16), "Sensor": np.round((Y + 1) / 0.0005).astype(np.int16)}
    path = write_tdms(tmp_path / "a.tdms", codes, Drive=scale(0.002, 0.0), Sensor=scale(0.0005, -1.0))
    record = read_record(path)
    assert record.v == pytest.approx(V, abs=0.0011)
    assert record.y == pytest.approx(Y, abs=0.0003)
    assert record.sample_time == 0.001


# Simulink and ControlDesk: lists of structs, each with numbers and a text that names them ---------------------------


def matlab(group: Any, name: str, x: Any) -> Any:
    """A variable as MATLAB v7.3 stores it."""
    text = isinstance(x, str)
    made = group.create_dataset(name, data=np.array([[ord(c)] for c in x], np.uint16) if text else np.atleast_2d(x))
    made.attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
    return made


def write_list(
    path: Path, version: str, folder: str, time: dict[str, Any], traces: list[dict[str, Any]], of: str
) -> Path:
    """Write a struct with a time, which is a vector or a struct of its own, and a list of structs named `of`."""
    if version == "v5":
        listed = np.array([tuple(each.values()) for each in traces], dtype=[(key, "O") for key in traces[0]])
        scipy.io.savemat(path, {folder: {**time, of: listed}})
        return path
    with h5py.File(path, "w", userblock_size=512) as file:
        group, kept = file.create_group(folder), file.create_group("#refs#")
        for name, value in time.items():
            inside = group.create_group(name) if isinstance(value, dict) else group
            for key, x in value.items() if isinstance(value, dict) else ((name, value),):
                matlab(inside, key, x)
        listed = group.create_group(of)
        for key in traces[0]:
            found = listed.create_dataset(key, (len(traces), 1), dtype=h5py.ref_dtype)
            for k, each in enumerate(traces):
                found[k, 0] = matlab(kept, f"{key}{k}", each[key]).ref
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")
    return path


@pytest.mark.parametrize("version", ["v5", "v73"])
def test_lists_of_structs(tmp_path: Path, version: str) -> None:
    traces = [{"values": V, "label": "drive"}, {"values": Y, "label": "position"}]
    record = read_record(write_list(tmp_path / "simulink.mat", version, "out", {"time": T}, traces, "signals"))
    check(record)
    assert record.read_as == "t = time in seconds, as it has no unit, v = drive, y = position"
    traces = [
        {"Name": "Model Root/drive", "Data": V, "Unit": "V"}, {"Name": "Model Root/position", "Data": Y, "Unit": "um"},
    ]  # fmt: skip
    time = {"X": {"Name": "Time", "Data": T}}
    record = read_record(write_list(tmp_path / "controldesk.mat", version, "run1", time, traces, "Y"))
    check(record)
    assert record.units == {"v": "V", "y": "um"}
    # If labels do not tell them apart, the message asks for them by their places in the list
    traces = [{"values": V, "label": "x"}, {"values": Y, "label": "x"}]
    path = write_list(tmp_path / "alike.mat", version, "out", {"time": T}, traces, "signals")
    assert problem(path).endswith(', for example --columns "v=out.signals.(1).values,y=out.signals.(2).values"')
    check(read_record(path, parse_columns("v=out.signals.(1).values,y=out.signals.(2).values")))


def test_lists_of_structs_open_no_other_file(tmp_path: Path) -> None:
    """The file links to other files and stores numbers in another one, both in and next to the fields of a list."""
    traces = [{"values": V, "label": "drive"}, {"values": Y, "label": "position"}]
    path = write_list(tmp_path / "a.mat", "v73", "out", {"time": T}, traces, "signals")
    (tmp_path / "raw").write_bytes((2 * Y).tobytes())
    with h5py.File(tmp_path / "other.mat", "w") as file:
        matlab(file, "label", "drive")
    with h5py.File(path, "r+") as file:
        for group in (file["out"], file["out/signals"]):
            group["label2"] = h5py.ExternalLink("other.mat", "/label")
            group["gone"] = h5py.ExternalLink("no_such_file.mat", "/label")
            group["nowhere"] = h5py.SoftLink("/no/such/place")
        kept = file["#refs#"].create_dataset("far", (1, N), "f8", external=[(str(tmp_path / "raw"), 0, 8 * N)])
        kept.attrs["MATLAB_class"] = np.bytes_("double")
        file["out/signals/values"][1, 0] = kept.ref
    text = problem(path)
    assert 'there is no column "y" among out.signals.drive, out.time; name it' in text


@pytest.mark.parametrize("kind", ["npz", "mat", "h5", "turned.h5"])
def test_a_matrix_alone_is_a_table_without_names(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    table = np.column_stack([T, V, Y])
    if kind == "npz":
        np.savez(path, data=table)
    elif kind == "mat":
        scipy.io.savemat(path, {"data": table})
    else:
        with h5py.File(path, "w") as file:
            file["data"] = table if kind == "h5" else table.T
    assert problem(path) == (
        ": error: data is a matrix of 3 columns; say which they are with --columns 1,2,3 (time, drive, measured)"
    )
    check(read_record(path, parse_columns("1,2,3")))
