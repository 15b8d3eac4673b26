"""Other parameters for a running inverse: the C against its reference, and against plays in plain Python."""

from __future__ import annotations

import itertools
import warnings
from pathlib import Path
from typing import Any

import cffi
import numpy as np
import pytest
from modelfiles import CHAINS, FILES

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import jit
from hystgen.compensator import exchange, reference
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays.slots import OP_COMMIT, OP_INIT, OP_STEP
from hystgen.verification import compilers

ROOM = 1 << 16
EVERY = {**FILES, **CHAINS}


def units(name: str) -> tuple[Model, Model]:
    """A model, and another unit of it with wider and stiffer plays."""
    one = parse_parameters(EVERY[name])
    emit = one.emit.model_copy(update={
        "drive_lsb": 2.0**-12, "output_lsb": 2.0**-10,
        "compensation": one.emit.compensation.model_copy(update={"noise_gain": 1e9}),
    })
    pi = one.model.pi
    wider = pi.model_copy(update={
        "thresholds": tuple(1.04 * r for r in pi.thresholds), "weights": tuple(0.97 * p for p in pi.weights),
    })
    first = one.model_copy(update={"emit": emit})
    return Model(first), Model(first.model_copy(update={"model": one.model.model_copy(update={"pi": wider})}))


class Exchanging:
    """An inverse in C that loads its parameters, and two units of them."""

    def __init__(self, name: str, arithmetic: str, folder: Path) -> None:
        self.models = units(name)
        if not ARITHMETICS[arithmetic].fixed:
            self.models = tuple(
                Model(each.parameters.model_copy(update={"emit": each.parameters.emit.model_copy(
                    update={"drive_lsb": None, "output_lsb": None})})) for each in self.models
            )  # type: ignore[assignment]
        with warnings.catch_warnings(action="ignore"):
            self.options = emit_options(self.models[0], "inverse", arithmetic, "loop", tables="runtime")
            made = module.of(self.models[0], self.options)
            assert made.parameters is not None
            other = module.of(self.models[1], self.options).parameters
        assert other is not None
        assert made.parameters.hash == other.hash
        for file, text in module.files(made).items():
            (folder / file).write_text(text)
        source, library = folder / f"{name}.c", folder / f"{name}.so"
        compilers.available()[0].shared_library([source], library, compilers.STRICT)
        self.ffi = cffi.FFI()
        real = ARITHMETICS[arithmetic].c_type
        self.ffi.cdef(
            f"int {name}_load(void *, void *, size_t); void {name}_inverse_init(void *, void *);"
            f"{real} {name}_inverse_step(void *, {real}); void {name}_inverse_commit(void *, {real});"
            f"{real} {name}_inverse_exchange(void *, void *, bool);"
        )
        self.library = self.ffi.dlopen(str(library))  # its functions do not keep it open
        self.c = {
            call: getattr(self.library, f"{name}_{call}")
            for call in ("load", "inverse_init", "inverse_step", "inverse_commit", "inverse_exchange")
        }
        self.self, self.units = self.ffi.new("long long[]", ROOM), []
        for block in (made.parameters.block(), other.block()):
            unit = self.ffi.new("long long[]", ROOM)
            assert self.c["load"](unit, self.ffi.from_buffer(block), len(block)) == 0
            self.units.append(unit)
        self.c["inverse_init"](self.self, self.units[0])
        self.tables = [each.tables(arithmetic, "loop", "inverse") for each in self.models]


class Repeated:
    """The same inverse in the bit-exact reference."""

    def __init__(self, t: Any) -> None:
        self.t, self.state = t, reference.new_state(t, True)
        self.call(OP_INIT, 0)

    def call(self, which: int, x: float) -> Any:
        dtype = self.t.threshold.dtype
        answer, status = np.zeros(1, dtype), np.zeros(1, np.uint8)
        with jit.plain():
            reference.operations(self.t, True).run(
                self.t, self.state, np.array([which], np.uint8), np.array([x]).astype(dtype), answer, status
            )
        return answer[0]


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("name", ["plain", "bent", "creeping"])
def test_an_inverse_that_loads_its_parameters_can_exchange_them(name: str, arithmetic: str) -> None:
    """By default: only `optimize: speed` selects the engine that cannot."""
    model, declared = units(name)[0], f"{name}_inverse_exchange("
    if not ARITHMETICS[arithmetic].fixed:
        sizes = {"drive_lsb": None, "output_lsb": None}
        emit = model.parameters.emit.model_copy(update=sizes)
        model = Model(model.parameters.model_copy(update={"emit": emit}))
    with warnings.catch_warnings(action="ignore"):
        made = emitted_files(model, operator="both", arithmetic=arithmetic, tables="runtime")
        fast = emitted_files(model, operator="both", arithmetic=arithmetic, tables="runtime", optimize="speed")
    assert declared in made[f"{name}.h"]
    assert declared not in fast[f"{name}.h"]


@pytest.mark.slow(one_in=5)
@pytest.mark.parametrize(("name", "arithmetic"), [
    *itertools.product(
        ["plain", "listed", "two_branches", "bent", "aged", "warm", "relaxing", "viscous", "viscous_twin", "dashpot",
         "soft_dashpot", "dilated", "bumpy", "creeping", "logarithmic", "wider", "worn"],
        ["float32", "q31", "float64", "q15"],
    ),
    *itertools.product(["quick"], ["float32", "float64"]),
])
def test_an_exchange_has_the_bits_of_the_reference(name: str, arithmetic: str, tmp_path: Path) -> None:
    c, rng = Exchanging(name, arithmetic, tmp_path), np.random.default_rng(7)
    other, present = Repeated(c.tables[0]), 0
    (low, high), (least, most) = (t[0] for t in (c.tables[0].limits.output, c.tables[0].limits.drive))
    jumps = []
    for k in range(240):
        u = (rng.uniform(0.9 * low, 0.9 * high) if k % 7 == 0 else 0.5 * (low + high) + 0.4 * (high - low) * np.sin(k))
        u = c.tables[0].threshold.dtype.type(u)
        assert c.c["inverse_step"](c.self, u.item()) == other.call(OP_STEP, u)
        if k % 5 == 1:
            v = c.tables[0].threshold.dtype.type(rng.uniform(least, most))
            c.c["inverse_commit"](c.self, v.item())
            other.call(OP_COMMIT, v)
        if k % 20 == 13:
            following = 1 - present
            jump, state = exchange.exchange(c.tables[present], c.tables[following], other.state)
            for take in (False, False, True):
                assert c.c["inverse_exchange"](c.self, c.units[following], take) == jump
            other.t, other.state, present = c.tables[following], state, following
            jumps.append(float(jump))
    assert len(set(jumps)) > 6


def test_the_memory_is_the_admissible_one_nearest_to_it(tmp_path: Path) -> None:
    """Plays by their definition: they hold, then go on with the other thresholds and weights from projected values."""
    c, rng = Exchanging("plain", "float64", tmp_path), np.random.default_rng(8)
    first, second = (each.cascade.pi for each in c.models)
    plays = [0.0] * (first.n + 1)
    drive = 0.0
    for u in rng.uniform(-8, 8, 40).tolist():
        drive = c.c["inverse_step"](c.self, u)
        plays = [max(drive - r, min(drive + r, z)) for z, r in zip(plays, first.thresholds, strict=True)]
        assert sum(p * z for p, z in zip(first.weights, plays, strict=True)) == pytest.approx(u, abs=1e-9)
    jump = c.c["inverse_exchange"](c.self, c.units[1], True)
    held = sum(p * z for p, z in zip(first.weights, plays, strict=True))
    for i in range(1, len(plays)):
        room = second.thresholds[i] - second.thresholds[i - 1]
        plays[i] = max(plays[i - 1] - room, min(plays[i - 1] + room, plays[i]))
    for k, u in enumerate([held, *rng.uniform(-7, 7, 40).tolist()]):
        before, drive = drive, c.c["inverse_step"](c.self, u)
        assert k or drive - before == pytest.approx(jump, abs=1e-9)
        plays = [max(drive - r, min(drive + r, z)) for z, r in zip(plays, second.thresholds, strict=True)]
        assert sum(p * z for p, z in zip(second.weights, plays, strict=True)) == pytest.approx(u, abs=1e-9)
    assert abs(jump) > 0.01
