"""Figures 15 and 16: the closed loop, with and without a compensator, and with the emitted C as compensator.

    python examples/note/closed_loop.py [-o FOLDER]

The note runs three cases and finds either inverse "greatly improved" over none. With its own plant (38), gains and
reference, the largest error says the opposite: the hysteresis has a gain above 1, which simply raises the loop gain. A
linear scale in place of the inverse takes that gain out; compared with the scale, the inverse has the smaller largest
error (but not the smaller rms: the hysteresis mostly lags, and so does the loop). The price of the gain shows in the
error over time: where two plays or more follow, the uncompensated loop is beyond its stability limit and rings near the
plant's resonance; so does the loop with the scale, on its steepest segments.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from printed import ESTIMATE_2, STAGE_1, MismatchError, save
from scipy import signal

from hystgen.basics import drawing
from hystgen.closed_loop import CompiledC, Loop, PIController, Response

HERE = Path(__file__).resolve().parent
PLANT = ([8.8e16], [1.0, 1.6e4, 6.6e8, 5.3e12, 8.8e16])
CONTROLLER = PIController(kp=0.185, ki=185.0)
MEAN_GAIN = 2.05  # output over drive of Example 1's loop at a drive of +-4; in this control loop the drive is smaller
PERIOD = 1.0  # s; the first period is left out, since the start memory still affects it
BLOCK = 200  # each drawn point is the largest of this many samples

# Largest error in the second period, as measured with another simulation of the same loop
EXPECTED = {"no compensator": 0.102, "exact inverse": 0.136, "approximate inverse": 0.139, "linear scale 1/2.05": 0.206}
COLOURS = (drawing.FAULT, drawing.MEASURED, drawing.GAP, drawing.RESIDUAL, drawing.OTHER)


def reference(t: float) -> float:
    """In output units; `t` in s."""
    return 4.0 * math.sin(2.0 * math.pi * t)


def make(folder: Path) -> None:
    """Run the loops, print their errors and draw the figures. Raises MismatchError if a figure has changed."""
    rate = STAGE_1.parameters.sample_time
    assert rate is not None

    def run(compensator: object) -> Response:
        return Loop(PLANT, CONTROLLER, rate, STAGE_1, compensator).run(reference, 2 * PERIOD)

    parts = (None, STAGE_1.inverse(), ESTIMATE_2.inverse(), 1.0 / MEAN_GAIN)
    cases = {name: run(part) for name, part in zip(EXPECTED, parts, strict=True)}
    alone = cases["no compensator"]
    cases[f"linear scale 1/{gain(alone):.2f}"] = run(1.0 / gain(alone))
    emitted = {f"emitted C, {name}": run(CompiledC(STAGE_1, arithmetic=name)) for name in ("float32", "q15")}

    title = f"Error in the second period, {1 / rate:.0f} samples/s"
    print(f"{title:44}{'max':>7}{'rms':>9}{'> 1 kHz':>10}")
    for name, response in (cases | emitted).items():
        numbers = response.max_error(PERIOD), response.rms_error(PERIOD), ringing(response)[0]
        print("  {:42}{:9.4f}{:9.4f}{:10.4f}".format(name, *numbers))
    print(
        'The note: with either inverse "greatly improved" over no compensator. The largest error says the opposite:\n'
        f"the hysteresis has a mean gain of {gain(alone):.2f} here ({MEAN_GAIN} at a drive of +-4), which stays in\n"
        "the loop without a compensator. Against a linear scale that takes the same gain out, both inverses have the\n"
        "smaller largest error, though not the smaller rms. Where the slope is beyond the stability limit, the loop\n"
        f"rings without a compensator (at {ringing(alone)[1]:.0f} Hz) and with that scale, but not with an inverse."
    )

    for name, expected in EXPECTED.items():
        found = cases[name].max_error(PERIOD)
        if round(found, 3) != expected:
            raise MismatchError(f"{name}: the largest error is {found:.4f} instead of {expected}")
    folder.mkdir(parents=True, exist_ok=True)
    with drawing.styled():
        save(folder, "figure_15", paths(cases))
        save(folder, "figure_16", tracking(cases, emitted))


def second(response: Response) -> slice:
    """The samples of the second period."""
    return slice(int(np.searchsorted(response.t, PERIOD - 1e-9)), None)


def gain(response: Response) -> float:
    """Slope of the straight line through the origin that best fits displacement over demand."""
    u, h = response.control[second(response)], response.displacement[second(response)]
    return float(u @ h / (u @ u))


def ringing(response: Response) -> tuple[float, float]:
    """Largest part of the error above 1 kHz in the second period, and its strongest frequency (Hz)."""
    step = response.t[1] - response.t[0]
    fast = signal.sosfiltfilt(signal.butter(4, 1000.0, "high", fs=1.0 / step, output="sos"), response.error)
    # the transient at the end comes from the filter, not from the loop
    fast = fast[second(response)][:-200]
    return float(np.max(np.abs(fast))), float(np.argmax(np.abs(np.fft.rfft(fast))) / (len(fast) * step))


def paths(cases: dict[str, Response]) -> object:
    """The actuator as the controller sees it: displacement over demand, and its deviation from a straight line."""
    figure = drawing.figure(10.4, 4.3)
    loops, rest = figure.subplots(1, 2)
    for (name, response), colour in zip(cases.items(), COLOURS, strict=True):
        u, h = response.control[second(response)], response.displacement[second(response)]
        loops.plot(u, h, color=colour, label=name, linewidth=1.2)
        # the case without a compensator is drawn below those with a scale
        rest.plot(u / np.max(np.abs(u)), h - gain(response) * u, color=colour,
                  **({"linewidth": 4.0, "alpha": 0.4} if name == "no compensator" else {"linewidth": 1.2}))  # fmt: skip
    loops.set(title="Displacement over demand", xlabel="demand $u$ (output units)",
              ylabel="displacement $h$ (output units)")  # fmt: skip
    rest.set(title="Minus the best straight line", xlabel="demand over its maximum",
             ylabel="deviation (output units)")  # fmt: skip
    figure.legend(loc="outside lower center", ncols=5)
    return figure


def tracking(cases: dict[str, Response], emitted: dict[str, Response]) -> object:
    """Reference and output, the error, and how far the emitted C is from the exact inverse in double precision."""
    figure = drawing.figure(10.4, 8.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0))
    whole, error, coded = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, :])
    for (name, response), colour in zip(cases.items(), COLOURS, strict=True):
        here = drawing.kept(0, len(response.t), response.output)
        whole.plot(response.t[here], response.output[here], color=colour, label=name, linewidth=1.0)
        here = drawing.kept(int(second(response).start), len(response.t), response.error)
        error.plot(response.t[here], response.error[here], color=colour, linewidth=1.2)
    exact = cases["exact inverse"]
    whole.plot(exact.t[::100], exact.reference[::100], color="black", linestyle=":", label="reference")
    whole.set(title="Reference and output", xlabel="time (s)", ylabel="output units")
    error.set(title="Error, second period", xlabel="time (s)", ylabel="reference $-$ output (output units)")
    for (name, response), colour in zip(emitted.items(), (drawing.MODEL, drawing.QUIET), strict=True):
        far = np.abs(response.output - exact.output).reshape(-1, BLOCK).max(axis=1)
        coded.semilogy(response.t[::BLOCK], far, color=colour, label=name, linewidth=1.2)
    coded.set(title="Exact inverse as emitted C: distance from double precision",
              xlabel="time (s)", ylabel=f"largest in {1e3 * BLOCK * exact.t[1]:.0f} ms (output units)")  # fmt: skip
    drawing.legend_above(coded)
    figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="The note's closed loop: figures 15 and 16.")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "out", help="folder of the figures")
    make(parser.parse_args().output)


if __name__ == "__main__":
    main()
