"""The parameter file's structure: frozen pydantic models with the names of the YAML keys, and their JSON Schema.

Only constraints on single values are expressed here; how values must fit together is in `checks`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, cast

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from hystgen.basics.names import MAX_NAME, MAX_UNIT, NAME_PATTERN
from hystgen.basics.quantities import MAX_PLAYS, NotNegative, Number, Positive
from hystgen.effects import Unmeasured

MAX_STAGES = 16
MAX_EFFECTS = 64
MAX_DESCRIPTION = 500
"""Maximum numbers of stages, effects and characters in a description: more than any model needs, but quick to check."""

STAGE_KINDS = ("dead_zone", "tanh")

SCHEMA_ID = "urn:hystgen:parameters:1"
"""Name of the JSON Schema of format 1: a URN, since it identifies the schema rather than its location."""

_MEMBER = "\0member "
MEMBERS = frozenset(_MEMBER + name for name in ("number", "list", *STAGE_KINDS))
"""Names of union members: elements of pydantic's locations that are not keys in the file."""


def _whole(value: object) -> object:
    if type(value) is not int:  # true and 1.0 are equal to 1
        raise PydanticCustomError("literal_error", "must be 1")
    return value


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Units(_Part):
    """Units of the drive and of the displacement, as they appear in comments, plots and reports."""

    input: str = Field(default="", max_length=MAX_UNIT, description="unit of the drive", examples=["V"])
    output: str = Field(default="", max_length=MAX_UNIT, description="unit of the displacement", examples=["um"])


class DensityTable(_Part):
    """Points of a piecewise linear density that is zero outside them."""

    r: tuple[NotNegative, ...] = Field(
        min_length=2, max_length=MAX_PLAYS, description="thresholds, strictly rising, input units"
    )
    p: tuple[NotNegative, ...] = Field(
        min_length=2, max_length=MAX_PLAYS, description="density at these thresholds, as many values as r"
    )


class DensityParameters(_Part):
    """Density p(r) of the continuous model, a formula or a table, discretised into n plays or to a tolerance."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [
                {
                    "oneOf": [
                        {"required": ["formula", "r_max"], "not": {"required": ["table"]}},
                        {"required": ["table"], "not": {"anyOf": [{"required": ["formula"]}, {"required": ["r_max"]}]}},
                    ]
                },
                {"oneOf": [{"required": ["n"]}, {"required": ["tolerance"]}]},
            ]
        }
    )

    formula: str | None = Field(
        default=None,
        max_length=1000,
        description="p(r) >= 0, from + - * / ** ( ) r numbers exp log sqrt sin cos tanh",
        examples=["0.8*exp(-0.3*r)"],
    )
    table: DensityTable | None = Field(default=None, description="points of p(r), in place of a formula")
    p0: NotNegative = Field(description="weight of the drive itself (p_0); the inverse needs more than 0")
    r_max: Positive | None = Field(default=None, description="last threshold of a formula, input units")
    n: int | None = Field(default=None, ge=1, le=MAX_PLAYS, description="number of plays")
    tolerance: Positive | None = Field(
        default=None, description="largest error of the initial loading curve, output units, in place of n"
    )


def _number_or_list(value: object) -> str:
    return _MEMBER + ("list" if isinstance(value, tuple) else "number")


class PIParameters(_Part):
    """Prandtl-Ishlinskii model: thresholds and weights, or a density, from which loading makes them."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["thresholds", "weights"], "not": {"required": ["density"]}},
                {
                    "required": ["density"],
                    "not": {"anyOf": [{"required": ["thresholds"]}, {"required": ["weights"]}]},
                },
            ]
        }
    )

    thresholds: tuple[NotNegative, ...] = Field(
        default=(), min_length=1, max_length=MAX_PLAYS + 1, description="r_0 = 0 first, strictly rising, input units"
    )
    weights: tuple[NotNegative, ...] = Field(
        default=(),
        min_length=1,
        max_length=MAX_PLAYS + 1,
        description="p_0 .. p_n, as many as thresholds, not all zero",
    )
    initial_state: Annotated[
        Annotated[Number, Tag(_MEMBER + "number")]
        | Annotated[tuple[Number, ...], Field(min_length=1, max_length=MAX_PLAYS + 1), Tag(_MEMBER + "list")],
        Discriminator(_number_or_list),
    ] = Field(default=0.0, description="start memory M0: one number, or one per threshold (the first is ignored)")
    density: DensityParameters | None = Field(default=None, description="density in place of thresholds and weights")

    _density_errors: tuple[float, float] | None = PrivateAttr(default=None)

    @property
    def density_error(self) -> float | None:
        """Bound on the discretised density's error in the initial loading curve, output units; None without one."""
        return self._density_errors[0] if self._density_errors else None

    @property
    def density_output_error(self) -> float | None:
        """Bound on the discretised density's error in the output for any drive and history; None without a density."""
        return self._density_errors[1] if self._density_errors else None


class DeadZoneParameters(_Part):
    """Sum of dead zones."""

    kind: Literal["dead_zone"]
    thresholds: tuple[Number, ...] = Field(
        min_length=1, max_length=MAX_PLAYS, description="strictly rising, 0 among them, units of the stage's input"
    )
    weights: tuple[Number, ...] = Field(
        min_length=1, max_length=MAX_PLAYS, description="as many as thresholds; the one at 0 is the linear part"
    )


class TanhBranch(_Part):
    """Branch `a0 tanh(a1 v + a2) + a3` of an envelope, with a0 a1 > 0."""

    a0: Number = Field(description="half height")
    a1: Number = Field(description="inverse width")
    a2: Number = Field(description="shift of the argument")
    a3: Number = Field(description="shift of the value")


class TanhParameters(_Part):
    """Tanh envelope: one branch for a rising and one for a falling drive."""

    kind: Literal["tanh"]
    ascending: TanhBranch = Field(description="branch of a rising drive")
    descending: TanhBranch = Field(
        default=cast("TanhBranch", None), description="branch of a falling drive; by default the same"
    )

    @model_validator(mode="after")
    def _same_branch(self) -> TanhParameters:
        if self.descending is None:
            object.__setattr__(self, "descending", self.ascending)
        return self


def _kind(value: object) -> str | None:
    kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
    return _MEMBER + kind if kind in STAGE_KINDS else None


StageParameters = Annotated[
    Annotated[DeadZoneParameters, Tag(_MEMBER + "dead_zone")] | Annotated[TanhParameters, Tag(_MEMBER + "tanh")],
    Discriminator(_kind),
]


def _as_list(value: object) -> object:
    return (value,) if isinstance(value, Mapping) else value


class ModelParameters(_Part):
    """The actuator's behaviour: a memoryless front, the Prandtl-Ishlinskii model, an offset, further effects."""

    pi: PIParameters
    memoryless: Annotated[tuple[StageParameters, ...], BeforeValidator(_as_list)] = Field(
        default=(),
        max_length=MAX_STAGES,
        description="stage in front of pi, or a list of stages in order from the drive",
    )
    output_offset: Number = Field(default=0.0, description="added to the model's output, output units")
    effects: tuple[Any, ...] = Field(
        default=(), max_length=MAX_EFFECTS, description="effects beyond the static model, in any order"
    )
    """Instances of `hystgen.effects.Effect`, whose classes are imported when a file names them."""


def _auto(value: object) -> object:
    return None if value == "auto" else value


MOST_REFERENCES = 1000
"""[samples] Maximum number of references that a compensator stores: 4000 bytes in float32 and 1000 products per step; a
preview of 1 s at 1 kHz."""


class Compensation(_Part):
    """How the inverse compensates effects."""

    preview: Annotated[int, Field(ge=0, le=MOST_REFERENCES)] | None = Field(
        default=None,
        description="samples by which the reference leads; auto: what the model needs; with fewer, the motion is late",
    )
    drive_hold: Literal["straight", "held"] = Field(
        default="straight", description="held: the converter holds each drive, half a sample later than a straight line"
    )
    noise_gain: Positive | None = Field(
        default=None,
        description="largest reference-to-drive gain, relative to the static one; averaging the reference limits it",
    )
    max_rate: Positive | None = Field(
        default=None, description="fastest drive that error bounds are stated for, input units per s"
    )
    resonance: Literal["inverse", "notch", "shaper", "none"] = Field(
        default="inverse",
        description="how modes are compensated; notch, shaper: point-to-point steps do not ring, without a preview",
    )
    taps: Literal[3, 5] = Field(default=3, description="references that a mode uses; 5 for a fourth-order error")
    corner: Annotated[int, Field(ge=0, le=100)] = Field(
        default=0, description="corners of the reference are rounded by three moving averages of this many samples"
    )
    quiet: bool = Field(
        default=False,
        description="the drive rests while the reference does, except as creep requires; references that move by a "
        "code now and then get larger leads",
    )

    compensate: tuple[Unmeasured, ...] = Field(
        default=(),
        description="effects to compensate although nothing measures them: a drift, counted from set_offset on, and "
        "the drive's own heat, or that of its loops",
    )

    _preview = field_validator("preview", mode="before")(_auto)


MOST_BITS = 24
"""[bits] Most bits of a converter: delta-sigma converters have 24, of which the last ones are noise."""


class Converter(_Part):
    """The codes of a converter: `range[0]` at the lowest code, `range[1]` at the highest one."""

    bits: Annotated[int, Field(ge=2, le=MOST_BITS)] = Field(description="bits of a code", examples=[16])
    range: tuple[Number, Number] = Field(
        description="quantities at the lowest and at the highest code, input or output units", examples=[[-10.0, 110.0]]
    )
    coding: Literal["offset-binary", "twos-complement"] = Field(
        description="codes from 0 on, or signed ones with 0 in the middle"
    )


class Converters(_Part):
    """The converters through which references come in and drives go out."""

    reference: Converter = Field(description="source of references: output units")
    drive: Converter = Field(description="destination of drives: input units")


class Health(_Part):
    """The watch over the model's error that `emit --health` adds."""

    window: Annotated[int, Field(ge=1, le=2**16)] | None = Field(
        default=None, description="samples after which mean and mean square are judged, a power of 2; auto: enough"
    )
    false_alarms: Annotated[float, Field(gt=0.0, le=0.1)] = Field(
        default=1e-6, description="probability that a window of a healthy unit raises an alarm"
    )
    band: Positive | None = Field(
        default=None, description="largest rms error of a window, output units, in place of one derived from `residual`"
    )

    _window = field_validator("window", mode="before")(_auto)


class Residual(_Part):
    """Error of the identified model on records that took no part in the fit."""

    rms: Positive = Field(description="rms error, output units")
    correlation: Positive = Field(description="time in s over which the error or its square stays correlated")
    samples: Annotated[float, Field(ge=1.0)] = Field(description="number of independent samples of the error")

class Degaussing(_Part):
    """The sequence of drives that erases the memory."""

    end: Number | None = Field(
        default=None, description="drive at its end, input units; default: that of the start memory", examples=[50.0]
    )
    within: Annotated[Positive, Field(lt=1)] | None = Field(
        default=None, description="fraction of a step to which effects settle at its end; default: 0.01"
    )
    max_rate: Positive | None = Field(
        default=None, description="fastest drive, input units per s; default: compensation.max_rate, or the range in "
        "50 samples; never above a slew limit",
    )


class EmitDefaults(_Part):
    """Defaults of `hystgen emit`."""

    output: Annotated[str, Field(max_length=MAX_DESCRIPTION)] | None = Field(
        default=None, description="folder to write the C to, relative to this file's own", examples=["firmware"]
    )
    operator: Literal["inverse", "forward", "both"] = Field(default="inverse", description="operator to emit")
    arithmetic: Literal["float32", "float64", "q31", "q15"] = Field(
        default="float32", description="number format of the C"
    )
    engine: Literal["auto", "corners", "loop"] = Field(default="auto", description="how the play sum is evaluated")
    optimize: Literal["auto", "speed", "size"] = Field(
        default="auto", description="goal of engine auto: few instructions, little code, or a balance of both"
    )
    drive_lsb: Positive | None = Field(
        default=None, description="fixed point, and a quiet drive in floating point: input units per code"
    )
    output_lsb: Positive | None = Field(default=None, description="fixed point: output units per code")
    compensation: Compensation = Field(default=Compensation(), description="how the inverse compensates effects")
    converter: Converters | None = Field(
        default=None, description="converters of references and drives, for steps of the inverse from code to code"
    )
    health: Health = Field(default=Health(), description="bands of the watch that --health adds")
    degauss: Degaussing | None = Field(
        default=None, description="writes a generator of the drives that erase the memory; {} for the defaults"
    )


class Parameters(_Part):
    """Parameter file of hystgen: one hysteresis model and how to emit it.

    Built by `load_parameters`, `parse_parameters` and `make_parameters`, which also check how values fit together.
    """

    hystgen: Annotated[Literal[1], BeforeValidator(_whole)] = Field(description="format version")
    name: str = Field(
        description="prefix of every emitted C symbol, in upper case of every macro, and name of the files",
        json_schema_extra={"pattern": NAME_PATTERN, "maxLength": MAX_NAME},
        examples=["stage_x"],
    )
    description: str = Field(default="", max_length=MAX_DESCRIPTION, description="what the model describes")
    units: Units = Field(default=Units(), description="units for comments, plots and reports")
    sample_time: Positive | None = Field(
        default=None, description="period at which the emitted step is called, in seconds", examples=[5.0e-5]
    )
    recorded_at: Positive | None = Field(
        default=None, description="for information: sample time of the records behind the model, in seconds",
        examples=[5.0e-3],
    )
    input_range: tuple[Number, Number] = Field(
        description="lowest and highest drive the actuator may see, input units", examples=[[0.0, 100.0]]
    )
    residual: Residual | None = Field(
        default=None, description="error that identification left, with which monitor and --health compare later ones"
    )
    model: ModelParameters = Field(description="what the actuator does")
    emit: EmitDefaults = Field(default=EmitDefaults(), description="defaults of `hystgen emit`")
    not_separable: tuple[tuple[str, str], ...] = Field(
        default=(), description="pairs of an effect that a diagnosis named and one that the records leave possible"
    )


_EXAMPLE = {
    "hystgen": 1,
    "name": "stage_x",
    "description": "P-885 stack, axis X",
    "units": {"input": "V", "output": "um"},
    "sample_time": 5.0e-5,
    "input_range": [0.0, 100.0],
    "model": {"pi": {"thresholds": [0.0, 0.45, 0.9], "weights": [0.72, 0.6, 0.48], "initial_state": 0.0}},
    "emit": {"operator": "inverse", "arithmetic": "float32", "engine": "auto"},
}


def schema() -> dict[str, object]:
    """JSON Schema (2020-12) of the parameter file in its YAML form, for editors."""
    made = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": SCHEMA_ID,
        **_tidy(Parameters.model_json_schema()),
        "title": "hystgen parameter file",
        "description": "One hysteresis model and how to emit it.",
        "examples": [_EXAMPLE],
    }
    stages = made["$defs"]["ModelParameters"]["properties"]["memoryless"]
    several = {key: stages.pop(key) for key in ("type", "items", "maxItems")}
    stages["anyOf"] = [several["items"], several]
    made["$defs"]["ModelParameters"]["properties"]["effects"]["items"] = {"anyOf": _effects(made["$defs"])}
    return made


def _effects(definitions: dict[str, object]) -> list[dict[str, object]]:
    """Schemas of the shapes of all effects, added to the definitions; a user's own may have any keys."""
    from hystgen import effects

    found: list[dict[str, object]] = []
    for name in effects.CATALOGUE:
        for shape in effects.shapes(name):
            definitions[shape.__name__] = _tidy(shape.model_json_schema())
            found.append({"$ref": f"#/$defs/{shape.__name__}"})
    own = {"type": "string", "pattern": "^user:.", "description": "an effect of the user's own, with its keys"}
    return [*found, {"type": "object", "required": ["name"], "properties": {"name": own}}]


def _tidy(node: object) -> Any:
    """Remove what only Python needs: field titles, null as a value, defaults that only mark absence."""
    if isinstance(node, list):
        return [_tidy(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    if {"type": "null"} in node.get("anyOf", ()):
        value, _ = node["anyOf"]
        node = {**value, **{key: entry for key, entry in node.items() if key != "anyOf"}}
    unneeded = {"default"} if isinstance(node.get("default"), dict | list | None) else set()
    if isinstance(node.get("title"), str):
        unneeded.add("title")
    return {key: _tidy(entry) for key, entry in node.items() if key not in unneeded}
