"""Memory and time of reading one large record in every format.

`python benchmarks/record_memory.py --samples 10000000` writes a record of t, v, y in each format with the format's own
library, reads each in a separate process and prints the growth of the resident set, at its peak and after reading, in
units of the arrays that are kept (24 bytes per sample), and the seconds taken.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

READ = r"""
import io, json, sys, time
import h5py, pyarrow, pyarrow.parquet, scipy.io
from hystgen.records import read_record

# What the libraries load with their first file does not grow with the record
small = io.BytesIO()
pyarrow.parquet.write_table(pyarrow.table({"t": [0.0]}), small)
pyarrow.parquet.ParquetFile(small).read()

def status(key):
    with open("/proc/self/status") as lines:
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith(key))

with open("/proc/self/clear_refs", "w") as file:
    file.write("5")  # the high-water mark starts again from here
before = status("VmRSS")
began = time.perf_counter()
record = read_record(sys.argv[1])
seconds = time.perf_counter() - began
kept = record.t.nbytes + record.v.nbytes + record.y.nbytes
print(json.dumps({"samples": len(record), "seconds": seconds, "peak": (status("VmHWM") - before) / kept,
                  "after": (status("VmRSS") - before) / kept, "sum": float(record.y.sum()),
                  "notes": record.notes}))
"""


def columns(samples: int) -> dict[str, np.ndarray]:
    """A drive with all its digits, as written by a recorder that stores doubles."""
    rng = np.random.default_rng(0)
    t = np.arange(samples) * 5e-5
    v = 50.0 * np.sin(t) + rng.normal(0.0, 0.1, samples)
    return {"t": t, "v": v, "y": 0.1 * v + rng.normal(0.0, 0.01, samples)}


def write_files(samples: int, folder: Path) -> Iterator[Path]:
    """The same record as one file per format, each written after the previous one has been used."""
    import h5py
    import pyarrow as pa
    import pyarrow.parquet as pq
    import scipy.io

    data = columns(samples)
    with open(folder / "record.csv", "w", encoding="ascii") as out:
        out.write("t [s],v [V],y [um]\n")
        for first in range(0, samples, 100_000):
            part = (x[first : first + 100_000].tolist() for x in data.values())
            out.writelines(f"{t!r},{v!r},{y!r}\n" for t, v, y in zip(*part, strict=True))
    yield folder / "record.csv"
    text = (folder / "record.csv").read_bytes()
    middle = text.index(b"\n", len(text) // 2) + 1
    # A sample without a value, and one whose time does not rise
    (folder / "faults.csv").write_bytes(text[:middle] + b"1.0,,2.0\n0.0,1.0,2.0\n" + text[middle:])
    del text
    yield folder / "faults.csv"
    np.savez(folder / "record.npz", **data)
    yield folder / "record.npz"
    np.savez_compressed(folder / "compressed.npz", **data)
    yield folder / "compressed.npz"
    scipy.io.savemat(folder / "record.mat", data)
    yield folder / "record.mat"
    with h5py.File(folder / "record.h5", "w") as file:
        for name, x in data.items():
            file.create_dataset(f"run/{name}", data=x)
    yield folder / "record.h5"
    with h5py.File(folder / "compressed.h5", "w") as file:
        for name, x in data.items():
            file.create_dataset(name, data=x.reshape(1, -1), chunks=(1, min(samples, 8192)), compression="gzip")
    yield folder / "compressed.h5"
    pq.write_table(pa.table(data), folder / "record.parquet")
    yield folder / "record.parquet"
    pq.write_table(pa.table(data), folder / "one_group.parquet", row_group_size=samples)
    yield folder / "one_group.parquet"


def measure(path: Path) -> dict[str, float]:
    """Read one file in a separate process."""
    done = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main() -> None:
    """Print a line for each format."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=10_000_000)
    samples = parser.parse_args().samples
    print(f"{'file':20}{'MB':>8}{'seconds':>10}{'peak':>8}{'after':>8}")
    with tempfile.TemporaryDirectory() as folder:
        for path in write_files(samples, Path(folder)):
            found = measure(path)
            size = path.stat().st_size / 1e6
            figures = f"{found['seconds']:10.2f}{found['peak']:8.2f}{found['after']:8.2f}"
            print(f"{path.name:20}{size:8.0f}{figures}", flush=True)


if __name__ == "__main__":
    main()
