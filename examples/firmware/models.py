"""Models of the two simulated stages, from recordings of them: `python examples/firmware/models.py`.

Each stage is recorded as a bench would record it: slow loops and a hold, at 1 kHz, and a fast sweep at 20 kHz. The
creep of the ceramic and the lag of the amplifier are known effects; the model with both becomes models/axis_x.yaml, the
plays alone become models/plays_x.yaml.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import hystgen
from hystgen.parameters.files import dump_parameters

HERE = Path(__file__).resolve().parent
RATE = int((HERE / "board.h").read_text(encoding="utf-8").partition("#define BOARD_RATE ")[2].split()[0])  # Hz
SEEDS = {"x": 1, "y": 1000}  # as in main.c
UNITS = {"input": "V", "output": "um"}
CONVERTERS = """\
  converter:
    reference: {bits: 16, range: [0, 20], coding: offset-binary}
    drive: {bits: 16, range: [-10, 110], coding: offset-binary}
"""


class Stage:
    """The stage of stage.c, compiled for this machine."""

    def __init__(self, seed: int, folder: Path) -> None:
        library = folder / "stage.so"
        flags = ["-O2", "-shared", "-fPIC", "-ffp-contract=off"]
        subprocess.run(["cc", *flags, "-o", library, HERE / "stage.c"], check=True)
        self._c = ctypes.CDLL(str(library))
        self._c.stage_step.restype, self._c.stage_step.argtypes = ctypes.c_float, [ctypes.c_void_p, ctypes.c_float]
        self._state = ctypes.create_string_buffer(16384)
        self._c.stage_init(self._state, ctypes.c_uint32(seed))

    def record(self, drive: np.ndarray, every: int = 1) -> np.ndarray:
        """Time, drive and displacement at each tick: the displacement is read before the drive is set."""
        rows, position = [], self._c.stage_step(self._state, float(drive[0]))
        for k, v in enumerate(drive):
            if k % every == 0:
                rows.append((k / RATE, v, position))
            position = self._c.stage_step(self._state, float(v))
        return np.array(rows)


def drives() -> dict[str, tuple[np.ndarray, int]]:
    """The drives of the recordings, in V, and how many ticks apart they are logged."""
    slow, fast = np.arange(8 * RATE) / RATE, np.arange(RATE // 2) / RATE
    loops = 50 - 50 * np.cos(2 * np.pi * slow) * np.linspace(1, 0.1, len(slow))
    hold = np.concatenate([np.linspace(0, 80, RATE // 5), np.full(7 * RATE, 80.0)])
    sweep = 50 - 40 * np.cos(2 * np.pi * (20 * fast + 160 * fast**2))
    fade = 50 - 35 * np.cos(2 * np.pi * 60 * fast) * np.linspace(1, 0.3, len(fast))
    other = np.concatenate([fade, np.linspace(fade[-1], 90, RATE // 10), np.full(4 * RATE, 90.0)])
    return {"loops": (loops, 20), "hold": (hold, 20), "sweep": (sweep, 1), "holdout": (other, 4)}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE / "models", help="folder for the parameter files")
    folder = parser.parse_args().output
    for axis, seed in SEEDS.items():
        with tempfile.TemporaryDirectory() as scratch:
            for what, (drive, every) in drives().items():
                rows = Stage(seed, Path(scratch)).record(drive, every)
                np.savetxt(Path(scratch) / f"{what}.csv", rows, "%.6f", ",", header="t[s],v[V],y[um]", comments="")
            files = [Path(scratch) / f"{what}.csv" for what in drives()]
            records, holdout = files[:-1], files[-1]
            plays = hystgen.identify(files[0], holdout=files[1], name=f"plays_{axis}", units=UNITS)
            start = hystgen.identify(records, holdout=holdout, name=f"axis_{axis}", units=UNITS)
            whole = hystgen.diagnose(start, records, holdout=holdout, known=("creep", "lag"))
        print(f"{axis}: {plays}, {whole}")
        for name, found in ((f"plays_{axis}", plays), (f"axis_{axis}", whole)):
            parameters = found.model.parameters.model_copy(update={"input_range": (0.0, 100.0)})
            text = f"{dump_parameters(parameters)}sample_time: {1 / RATE!r}\nemit:\n{CONVERTERS}"
            (folder / f"{name}.yaml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
