"""Parameter files: every refusal with its exact words and place, round trips, hashes, schema."""

# Exact messages are not wrapped.
# ruff: noqa: E501

from __future__ import annotations

import copy
import json
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from hystgen.basics.names import name_problem
from hystgen.basics.problems import ParameterError
from hystgen.emission.text import comment_text
from hystgen.parameters import checks as param_checks
from hystgen.parameters import yaml as yaml_positions
from hystgen.parameters.files import (
    canonical_json,
    dump_parameters,
    load_parameters,
    make_parameters,
    parameters_sha256,
    parse_parameters,
)
from hystgen.parameters.schema import DeadZoneParameters, EmitDefaults, Parameters, TanhParameters, schema

H = "hystgen: 1\nname: a\ninput_range: [0, 1]\n"
M = "model: {pi: {thresholds: [0, 1], weights: [1, 1]}}\n"

CONTRACT = """\
hystgen: 1                      # format version
name: stage_x                   # C identifier: prefix of every emitted symbol; macros use STAGE_X
description: P-885 stack, axis X      # optional
units: {input: V, output: um}
sample_time: 5.0e-5
input_range: [0.0, 100.0]
model:
  pi:
    thresholds: [0, 0.45, 0.9]
    weights: [0.72, 0.6, 0.48]
    initial_state: 0.0
  memoryless:
    kind: dead_zone
    thresholds: [-1.0, -0.4, 0, 0.4, 1.0]
    weights: [-1.1, -1.1, 4.8, -1.1, -1.1]
  output_offset: 0.0
  effects: []
emit:
  operator: inverse
  arithmetic: float32
  engine: auto
  drive_lsb: 0.005
  output_lsb: 0.001
"""

TANH = "{a0: 6.0, a1: 0.4, a2: 0.0, a3: 0.0}"


def pi(text: str) -> str:
    return H + "model: {pi: {" + text + "}}\n"


def den(text: str) -> str:
    return pi("density: {" + text + "}")


def front(text: str) -> str:
    return H + "model: {pi: {thresholds: [0, 1], weights: [1, 1]}, memoryless: " + text + "}\n"


def eff(text: str) -> str:
    return H + "model: {pi: {thresholds: [0, 1], weights: [1, 1]}, effects: " + text + "}\n"


def name(text: str) -> str:
    return f"hystgen: 1\nname: {text}\ninput_range: [0, 1]\n" + M


def case(label: str, text: str, lines: list[str]) -> Any:
    return pytest.param(text, lines, id=label)


REFUSED = [
    case('empty', "", [
        '1:1: the file is empty; write the parameters into it',
    ]),
    case('only_comments', "# nothing\n\n", [
        '1:1: the file is empty; write the parameters into it',
    ]),
    case('only_marker', "---\n", [
        '1:1: the file is empty; write the parameters into it',
    ]),
    case('list_on_top', "- 1\n", [
        '1:1: the top level must be a mapping; start with `hystgen: 1`',
    ]),
    case('text_on_top', "hystgen\n", [
        '1:1: the top level must be a mapping; start with `hystgen: 1`',
    ]),
    case('open_list', H + "model: [1,\n", [
        '5:1: not valid YAML: expected a value, but found the end of the file (while parsing a value); correct the text there',
    ]),
    case('tab_indent', "hystgen:\n\tx: 1\n", [
        '2:1: not valid YAML: found a tab that cannot start anything (while scanning for what comes next); correct the text there',
    ]),
    case('open_quote', 'name: \"x\n', [
        '2:1: not valid YAML: found the end of the file (while scanning a quoted text); correct the text there',
    ]),
    case('two_colons', "a: b: c\n", [
        '1:5: not valid YAML: mapping values are not allowed here; correct the text there',
    ]),
    case('bad_escape', 'name: "\\q"\n', [
        "1:9: not valid YAML: found unknown escape character 'q' (while scanning a double-quoted text); correct the text there",
    ]),
    case('huge_escape', 'name: "\\UFFFFFFFF"\n', [
        '1:1: not valid YAML soon after this position; correct the text there',
    ]),
    case('at_sign', "name: @x\n", [
        "1:7: not valid YAML: found character '@' that cannot start anything (while scanning for what comes next); correct the text there",
    ]),
    case('stray_bracket', "a: 1\n]\n", [
        "2:1: not valid YAML: expected the end of it, but found ']' (while parsing a mapping); correct the text there",
    ]),
    case('bad_indent', "a: 1\n  b: 2\n", [
        '2:4: not valid YAML: mapping values are not allowed here; correct the text there',
    ]),
    case('nul', "name: \0\n", [
        '1:7: character U+0000 is not allowed; remove it',
    ]),
    case('bell_crlf', "name: x\r\nb: \a\n", [
        '2:4: character U+0007 is not allowed; remove it',
    ]),
    case('surrogate', "name: \ud800\n", [
        '1:7: character U+D800 is not allowed; remove it',
    ]),
    case('second_document', H + M + "---\na: 1\n", [
        '5:1: a second document starts here; keep one model per file',
    ]),
    case('yaml_1_1', "%YAML 1.1\n---\n" + H + M, [
        '1:1: directives are not accepted; remove the line that starts with %',
    ]),
    case('tag_directive', "# x\n%TAG ! tag:x,2000:\n---\n" + H + M, [
        '2:1: directives are not accepted; remove the line that starts with %',
    ]),
    case('late_directive', H + M + "...\n%YAML 1.3\n---\na: 1\n", [
        '5:1: not valid YAML soon after this position; correct the text there',
    ]),
    case('alias', H + M + "units: *u\n", [
        '5:8: units: aliases (*) are not accepted; write the value itself',
    ]),
    case('anchor', H + M + "units: &u {input: V}\n", [
        '5:8: units: anchors (&) are not accepted; remove the anchor',
    ]),
    case('merge_key', H + M + "<<: {a: 1}\n", [
        '5:1: merge keys (<<) are not accepted; write the keys out',
    ]),
    case('tag', H + M + "sample_time: !!float 1\n", [
        '5:14: sample_time: tags (!) are not accepted; remove the tag',
    ]),
    case('python_tag', H + M + "description: !!python/object/apply:os.system ['x']\n", [
        '5:14: description: tags (!) are not accepted; remove the tag',
    ]),
    case('tag_on_top', "!!map\n" + H + M, [
        '1:1: tags (!) are not accepted; remove the tag',
    ]),
    case('unknown_tag_handle', H + "model: !e!x 5\n", [
        "4:8: not valid YAML: found undefined tag handle '!e!' (while parsing a value); correct the text there",
    ]),
    case('tagged_key', H + M + "!!str sample_time: 1\n", [
        '5:1: tags (!) are not accepted; remove the tag',
    ]),
    case('duplicate_keys', H + M + "name: b\nname: c\nunits: {input: V, input: W}\n", [
        '5:1: name: this key is given twice (first in line 2); keep one of them',
        '6:1: name: this key is given twice (first in line 2); keep one of them',
        '7:19: units.input: this key is given twice (first in line 7); keep one of them',
    ]),
    case('number_key', H + M + "1: 2\n", [
        '5:1: a key must be text, not 1; correct the key',
    ]),
    case('empty_key', H + M + ": 2\n", [
        '5:1: a key must be text, not nothing; correct the key',
    ]),
    case('list_key', H + M + "? [a, {b: 1}]\n: 2\n", [
        '5:3: a key must be text, not a list or mapping; correct the key',
    ]),
    case('alias_key', H + M + "*x : 2\n", [
        '5:1: aliases (*) are not accepted; write the value itself',
    ]),
    case('too_deep', "a: " + "[" * 20, [
        '1:19: nested more than 16 deep; remove the extra nesting',
    ]),
    case('too_many_values', "a: [" + "1," * 100_000 + "]\n", [
        '1:199999: more than 100000 keys and values; keep one model per file',
    ]),
    case('everything_missing', "{}\n", [
        '1:1: hystgen: is missing; add `hystgen: 1`',
        '1:1: name: is missing; add `name: stage_x`',
        '1:1: input_range: is missing; add `input_range: [0.0, 100.0]`',
        '1:1: model: is missing; add `model: {pi: {thresholds: [0, 0.5], weights: [0.7, 0.6]}}`',
    ]),
    case('unknown_keys', H + M + "sampletime: 1\nfoo: 2\n", [
        '5:1: sampletime: unknown key; did you mean sample_time?',
        '6:1: foo: unknown key; valid here: hystgen, name, description, units, sample_time, recorded_at, input_range, residual, model, emit, not_separable',
    ]),
    case('keys_that_belong_elsewhere', H + M + "effects: []\nweights: [1]\npreview: 1\nemit: {sample_time: 1}\n", [
        '5:1: effects: unknown key; it belongs in model',
        '6:1: weights: unknown key; it belongs in model.pi',
        '7:1: preview: unknown key; it belongs in emit.compensation',
        '8:8: emit.sample_time: unknown key; it belongs at the top level',
    ]),
    case('odd_unknown_keys', H + M + '"a b\\n": 1\n' + "k" * 70 + ": 2\n", [
        '5:1: "a b\\n": unknown key; valid here: hystgen, name, description, units, sample_time, recorded_at, input_range, residual, model, emit, not_separable',
        '6:1: "kkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkk...": unknown key; valid here: hystgen, name, description, units, sample_time, recorded_at, input_range, residual, model, emit, not_separable',
    ]),
    case('no_values', "hystgen:\nname: ~\ninput_range: null\nmodel:\n  pi:\nsample_time:\nunits: {input: }\n", [
        '1:1: hystgen: has no value; write one, or remove it',
        '2:1: name: has no value; write one, or remove it',
        '3:1: input_range: has no value; write one, or remove it',
        '5:3: model.pi: has no value; write one, or remove it',
        '6:1: sample_time: has no value; write one, or remove it',
        '7:9: units.input: has no value; write one, or remove it',
    ]),
    case('format_2', "hystgen: 2\nname: a\ninput_range: [0, 1]\n" + M, [
        '1:10: hystgen: must be 1, not 2; this version reads format 1 only',
    ]),
    case('format_true', "hystgen: true\nname: a\ninput_range: [0, 1]\n" + M, [
        '1:10: hystgen: must be 1, not true; this version reads format 1 only',
    ]),
    case('format_float', "hystgen: 1.0\nname: a\ninput_range: [0, 1]\n" + M, [
        '1:10: hystgen: must be 1, not 1.0; this version reads format 1 only',
    ]),
    case('wrong_kinds', "hystgen: one\nname: 5\ndescription: [x]\nunits: V\nsample_time: {a: 1}\ninput_range: 5\nmodel: [1]\nemit: on\n", [
        '1:10: hystgen: must be 1, not the text "one"; this version reads format 1 only',
        '2:7: name: must be text, not 5; put it in quotes',
        '3:14: description: must be text, not a list; put it in quotes',
        '4:8: units: must be a mapping, not the text "V"; write `key: value` pairs in it',
        '5:14: sample_time: must be a number, not a mapping; write it like 0.45',
        '6:14: input_range: must be two numbers; write [lowest, highest]',
        '7:8: model: must be a mapping, not a list; write `key: value` pairs in it',
        '8:7: emit: must be a mapping, not the text "on"; write `key: value` pairs in it',
    ]),
    case('name_characters', name("9a"), [
        '2:7: name: "9a" is not a usable C prefix; use letters, digits and single underscores between them, starting with a letter',
    ]),
    case('name_keyword', name("Register"), [
        '2:7: name: Register is a keyword of C or C++; choose another name, such as axis_register',
    ]),
    case('name_long', name("x" * 41), [
        '2:7: name: has 41 characters, more than 40; shorten it',
    ]),
    case('name_true', name("true"), [
        '2:7: name: must be text, not true; put it in quotes',
    ]),
    case('description_long', H + M + "description: " + "x" * 501 + "\n", [
        '5:14: description: has 501 characters, more than 500; shorten it',
    ]),
    case('description_odd', H + M + 'description: "a\\tb"\n', [
        '5:14: description: contains the unprintable character U+0009; remove it',
    ]),
    case('units_long', H + M + "units: {input: " + "x" * 41 + "}\n", [
        '5:16: units.input: has 41 characters, more than 40; shorten it',
    ]),
    case('units_line', H + M + 'units: {output: "a\\nb"}\n', [
        '5:17: units.output: must be a single line; remove the line break',
    ]),
    case('sample_time_zero', H + M + "sample_time: 0\n", [
        '5:14: sample_time: must be above 0, not 0; correct the number',
    ]),
    case('sample_time_text', H + M + "sample_time: 50us\n", [
        '5:14: sample_time: must be a number, not the text "50us"; write it like 0.45',
    ]),
    case('sample_time_bool', H + M + "sample_time: true\n", [
        '5:14: sample_time: must be a number, not true; write it like 0.45',
    ]),
    case('underscore_number', H + M + "sample_time: 1_0\n", [
        '5:14: sample_time: must be a number, not the text "1_0"; write it like 0.45',
    ]),
    case('range_reversed', "hystgen: 1\nname: a\ninput_range: [1, 0.5]\n" + M, [
        '3:14: input_range: 1 is not below 0.5; write [lowest, highest]',
    ]),
    case('range_empty', "hystgen: 1\nname: a\ninput_range: [1, 1.0]\n" + M, [
        '3:14: input_range: 1 is not below 1.0; write [lowest, highest]',
    ]),
    case('range_one', "hystgen: 1\nname: a\ninput_range: [1]\n" + M, [
        '3:14: input_range: must be two numbers; write [lowest, highest]',
    ]),
    case('range_three', "hystgen: 1\nname: a\ninput_range: [1, 2, 3]\n" + M, [
        '3:14: input_range: must be two numbers; write [lowest, highest]',
    ]),
    case('range_items', "hystgen: 1\nname: a\ninput_range: [.inf, low]\n" + M, [
        '3:15: input_range[0]: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
        '3:21: input_range[1]: must be a number, not the text "low"; write it like 0.45',
    ]),
    case('range_huge', "hystgen: 1\nname: a\ninput_range: [-2e30, 1e400]\n" + M, [
        '3:15: input_range[0]: must be at least -1e+30, not -2e+30; correct the number',
        '3:22: input_range[1]: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
    ]),
    case('range_big_int', "hystgen: 1\nname: a\ninput_range: [0, " + "9" * 5000 + "]\n" + M, [
        '3:18: input_range[1]: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
    ]),
    case('range_hex', "hystgen: 1\nname: a\ninput_range: [0, 0x" + "f" * 400 + "]\n" + M, [
        '3:18: input_range[1]: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
    ]),
    case('pi_empty', pi(""), [
        '4:13: model.pi: needs thresholds and weights, or a density; add them',
    ]),
    case('thresholds_only', pi("thresholds: [0, 1]"), [
        '4:13: model.pi.weights: is missing; add `weights: [0.7, 0.6, 0.5]`',
    ]),
    case('weights_only', pi("weights: [0, 1]"), [
        '4:13: model.pi.thresholds: is missing; add `thresholds: [0, 0.5, 1.0]`',
    ]),
    case('pi_unknown', pi("thresholds: [0], wieghts: [1]"), [
        '4:13: model.pi.weights: is missing; add `weights: [0.7, 0.6, 0.5]`',
        '4:31: model.pi.wieghts: unknown key; did you mean weights?',
    ]),
    case('thresholds_start', pi("thresholds: [0.5, 1], weights: [1, 1]"), [
        '4:27: model.pi.thresholds[0]: must be 0, not 0.5; start with r_0 = 0',
    ]),
    case('thresholds_order', pi("thresholds: [0, 2, 1, 1], weights: [1, 1, 1, 1]"), [
        '4:33: model.pi.thresholds[2]: 1 is not above the 2 before it; sort the list and remove repeated values',
        '4:36: model.pi.thresholds[3]: 1 is not above the 1 before it; sort the list and remove repeated values',
    ]),
    case('thresholds_negative', pi("thresholds: [-1, 0], weights: [1, 1]"), [
        '4:27: model.pi.thresholds[0]: must be at least 0, not -1; correct the number',
    ]),
    case('thresholds_none', pi("thresholds: [], weights: []"), [
        '4:26: model.pi.thresholds: has 0 values, at least 1 needed; add to the list',
        '4:39: model.pi.weights: has 0 values, at least 1 needed; add to the list',
    ]),
    case('thresholds_number', pi("thresholds: 0, weights: 1"), [
        '4:26: model.pi.thresholds: must be a list, not 0; write [ ] around the values',
        '4:38: model.pi.weights: must be a list, not 1; write [ ] around the values',
    ]),
    case('nan_inf', pi("thresholds: [0, .inf], weights: [.nan, -.inf]"), [
        '4:30: model.pi.thresholds[1]: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
        '4:47: model.pi.weights[0]: must be a finite number, not nan; write one of at most 1e+30 in magnitude',
        '4:53: model.pi.weights[1]: must be a finite number, not -inf; write one of at most 1e+30 in magnitude',
    ]),
    case('weights_length', pi("thresholds: [0, 1], weights: [1]"), [
        '4:43: model.pi.weights: has 1 value for 2 in thresholds; give as many as thresholds',
    ]),
    case('weights_negative', pi("thresholds: [0, 1], weights: [1, -0.5]"), [
        '4:47: model.pi.weights[1]: must be at least 0, not -0.5; correct the number',
    ]),
    case('weights_zero', pi("thresholds: [0, 1], weights: [0, 0.0]"), [
        '4:43: model.pi.weights: are all 0; at least one must be positive',
    ]),
    case('weights_bool', pi("thresholds: [0, 1], weights: [true, null]"), [
        '4:44: model.pi.weights[0]: must be a number, not true; write it like 0.45',
        '4:50: model.pi.weights[1]: has no value; write one, or remove it',
    ]),
    case('too_many_plays', pi(f"thresholds: {list(range(4098))}, weights: {[1] * 4098}"), [
        '4:26: model.pi.thresholds: has 4098 values, more than 4097; shorten the list',
        '4:23515: model.pi.weights: has 4098 values, more than 4097; shorten the list',
    ]),
    case('state_length', pi("thresholds: [0, 1], weights: [1, 1], initial_state: [0, 0, 0]"), [
        '4:66: model.pi.initial_state: has 3 values for 2 thresholds (r_0 included); write one number, or one per threshold',
    ]),
    case('state_one', pi("thresholds: [0, 1], weights: [1, 1], initial_state: [0]"), [
        '4:66: model.pi.initial_state: has 1 value for 2 thresholds (r_0 included); write one number, or one per threshold',
    ]),
    case('state_none', pi("thresholds: [0, 1], weights: [1, 1], initial_state: []"), [
        '4:66: model.pi.initial_state: has 0 values, at least 1 needed; add to the list',
    ]),
    case('state_text', pi("thresholds: [0, 1], weights: [1, 1], initial_state: zero"), [
        '4:66: model.pi.initial_state: must be a number or a list of numbers, not the text "zero"; write it like 0.0',
    ]),
    case('state_mapping', pi("thresholds: [0, 1], weights: [1, 1], initial_state: {}"), [
        '4:66: model.pi.initial_state: must be a number or a list of numbers, not a mapping; write it like 0.0',
    ]),
    case('state_bool', pi("thresholds: [0, 1], weights: [1, 1], initial_state: false"), [
        '4:66: model.pi.initial_state: must be a number, not false; write it like 0.45',
    ]),
    case('state_item', pi("thresholds: [0, 1], weights: [1, 1], initial_state: [0, x]"), [
        '4:70: model.pi.initial_state[1]: must be a number, not the text "x"; write it like 0.45',
    ]),
    case('density_beside', pi("thresholds: [0], density: {table: {r: [0, 1], p: [1, 1]}, p0: 1, n: 1}"), [
        '4:31: model.pi.density: is given as well as thresholds; remove one or the other',
    ]),
    case('density_number', pi("density: 5"), [
        '4:23: model.pi.density: must be a mapping, not 5; write `key: value` pairs in it',
    ]),
    case('density_empty', den(""), [
        '4:23: model.pi.density.p0: is missing; add `p0: 0.7`',
        '4:23: model.pi.density: needs formula or table; give one of the two',
        '4:23: model.pi.density: needs n or tolerance; give one of the two',
    ]),
    case('density_both', den("formula: 1, table: {r: [0, 1], p: [1, 1]}, r_max: 1, p0: 1, n: 1, tolerance: 1"), [
        '4:23: model.pi.density: has both formula and table; give one of the two',
        '4:23: model.pi.density: has both n and tolerance; give one of the two',
        '4:33: model.pi.density.formula: must be text, not 1; put it in quotes',
    ]),
    case('density_no_r_max', den("formula: '1', p0: 1, n: 1"), [
        '4:23: model.pi.density.r_max: is missing; add `r_max: 10`',
    ]),
    case('density_r_max_table', den("table: {r: [0, 1], p: [1, 1]}, r_max: 1, p0: 1, n: 1"), [
        '4:55: model.pi.density.r_max: is not used with a table, which ends at its last r; remove it',
    ]),
    case('density_numbers', den("formula: '1', r_max: 0, p0: -1, n: 0"), [
        '4:45: model.pi.density.r_max: must be above 0, not 0; correct the number',
        '4:52: model.pi.density.p0: must be at least 0, not -1; correct the number',
        '4:59: model.pi.density.n: must be at least 1, not 0; correct the number',
    ]),
    case('density_n', den("formula: '1', r_max: 1, p0: 1, n: 4097"), [
        '4:58: model.pi.density.n: must be at most 4096, not 4097; correct the number',
    ]),
    case('density_n_float', den("formula: '1', r_max: 1, p0: 1, n: 4.0"), [
        '4:58: model.pi.density.n: must be a whole number, not 4.0; write it like 12',
    ]),
    case('density_tolerance', den("formula: '1', r_max: 1, p0: 1, tolerance: 0"), [
        '4:66: model.pi.density.tolerance: must be above 0, not 0; correct the number',
    ]),
    case('density_unreachable', den("formula: '1', r_max: 1, p0: 1, tolerance: 1e-9"), [
        '4:66: model.pi.density.tolerance: 1e-09 is not reached with 4096 thresholds; ask for 7.49e-09 or more',
    ]),
    case('density_formula', den("formula: 'exp(r', r_max: 1, p0: 1, n: 1"), [
        "4:33: model.pi.density.formula: '(' is not closed at character 4; add )",
    ]),
    case('density_long', den("formula: '" + "+" * 1001 + "', r_max: 1, p0: 1, n: 1"), [
        '4:33: model.pi.density.formula: has 1001 characters, more than 1000; shorten it',
    ]),
    case('density_negative', den("formula: 1-r, r_max: 2, p0: 1, n: 1"), [
        '4:33: model.pi.density.formula: p(r) is negative, -1 at r = 2; change the formula or r_max so that p(r) >= 0',
    ]),
    case('density_singular', den("formula: 1/r, r_max: 2, p0: 1, n: 1"), [
        '4:33: model.pi.density.formula: has no real value at r = 0; correct the formula or r_max',
    ]),
    case('density_pole', den("formula: 1/(r-1)**2, r_max: 3, p0: 1, n: 1"), [
        '4:33: model.pi.density.formula: cannot be integrated: no smooth function near r = 1; remove the pole or the fast oscillation',
    ]),
    case('density_not_finite', den("formula: -log(r), r_max: 1, p0: 1, n: 1"), [
        '4:33: model.pi.density.formula: is not finite at r = 0; correct the formula or r_max',
    ]),
    case('density_zero', den("formula: 0*r, r_max: 1, p0: 0, n: 3"), [
        '4:23: model.pi.density: is 0 everywhere, and so is p0; at least one must be positive',
    ]),
    case('density_huge', den("formula: 1e30+r, r_max: 100, p0: 0, n: 3"), [
        '4:23: model.pi.density: makes weights up to 3.33e+31, more than 1e+30; choose other units',
    ]),
    case('density_state', den("formula: r, r_max: 1, p0: 1, n: 2}, initial_state: [0, 1], x: {"), [
        '4:75: model.pi.initial_state: has 2 values for 3 thresholds (r_0 included); write one number, or one per threshold',
        '4:83: model.pi.x: unknown key; valid here: thresholds, weights, initial_state, density',
    ]),
    case('table_order', den("table: {r: [0, 1, 1], p: [1, 1, 1]}, p0: 1, n: 1"), [
        '4:42: model.pi.density.table.r[2]: 1 is not above the 1 before it; sort the list and remove repeated values',
    ]),
    case('table_length', den("table: {r: [0, 1], p: [1, 1, 1]}, p0: 1, n: 1"), [
        '4:46: model.pi.density.table.p: has 3 values for 2 in r; give as many as r',
    ]),
    case('table_short', den("table: {r: [0], p: [1]}, p0: 1, n: 1"), [
        '4:35: model.pi.density.table.r: has 1 value, at least 2 needed; add to the list',
        '4:43: model.pi.density.table.p: has 1 value, at least 2 needed; add to the list',
    ]),
    case('table_negative', den("table: {r: [-1, 1], p: [1, -1]}, p0: 1, n: 1"), [
        '4:36: model.pi.density.table.r[0]: must be at least 0, not -1; correct the number',
        '4:51: model.pi.density.table.p[1]: must be at least 0, not -1; correct the number',
    ]),
    case('table_missing', den("table: {q: 1}, p0: 1, n: 1"), [
        '4:31: model.pi.density.table.r: is missing; add `r: [0, 5, 10]`',
        '4:31: model.pi.density.table.p: is missing; add `p: [0.8, 0.2, 0.1]`',
        '4:32: model.pi.density.table.q: unknown key; valid here: r, p',
    ]),
    case('density_state_length', H + "model: {pi: {density: {formula: r, r_max: 1, p0: 1, n: 2}, initial_state: [0, 1]}}\n", [
        '4:75: model.pi.initial_state: has 2 values for 3 thresholds (r_0 included); write one number, or one per threshold',
    ]),
    case('stage_number', front("5"), [
        '4:64: model.memoryless: must be a stage or a list of stages, not 5; write a mapping with kind: dead_zone or kind: tanh',
    ]),
    case('stage_items', front("[5, {kind: tan}, {}, {kind: }, {kind: 5}]"), [
        '4:65: model.memoryless[0]: must be a stage, not 5; write a mapping with kind: dead_zone or kind: tanh',
        '4:75: model.memoryless[1].kind: must be dead_zone or tanh, not the text "tan"; did you mean tanh?',
        '4:81: model.memoryless[2].kind: is missing; add `kind: dead_zone` or `kind: tanh`',
        '4:86: model.memoryless[3].kind: has no value; write one, or remove it',
        '4:102: model.memoryless[4].kind: must be dead_zone or tanh, not 5; choose one of them',
    ]),
    case('stage_alone', front("{kind: deadzone}"), [
        '4:71: model.memoryless.kind: must be dead_zone or tanh, not the text "deadzone"; did you mean dead_zone?',
    ]),
    case('stages_many', front("[" + "{kind: tanh, ascending: {a0: 1, a1: 1, a2: 0, a3: 0}}," * 17 + "]"), [
        '4:64: model.memoryless: has 17 values, more than 16; shorten the list',
    ]),
    case('dead_zone', front("{kind: dead_zone, thresholds: [1, 1, 2], weights: [1], x: 1}"), [
        '4:94: model.memoryless.thresholds: do not contain 0; add 0 and the weight of the linear part',
        '4:98: model.memoryless.thresholds[1]: 1 is not above the 1 before it; sort the list and remove repeated values',
        '4:114: model.memoryless.weights: has 1 value for 3 in thresholds; give as many as thresholds',
        '4:119: model.memoryless.x: unknown key; valid here: kind, thresholds, weights',
    ]),
    case('dead_zone_missing', front("[{kind: dead_zone}]"), [
        '4:65: model.memoryless[0].thresholds: is missing; add `thresholds: [0, 0.5, 1.0]`',
        '4:65: model.memoryless[0].weights: is missing; add `weights: [0.7, 0.6, 0.5]`',
    ]),
    case('dead_zone_many', front(f"{{kind: dead_zone, thresholds: {list(range(4097))}, weights: [1]}}"), [
        '4:94: model.memoryless.thresholds: has 4097 values, more than 4096; shorten the list',
    ]),
    case('tanh_missing', front("{kind: tanh, ascending: {a0: 1, a1: 1}}"), [
        '4:88: model.memoryless.ascending.a2: is missing; add `a2: 0.0`',
        '4:88: model.memoryless.ascending.a3: is missing; add `a3: 0.0`',
    ]),
    case('tanh_sign', front("{kind: tanh, ascending: {a0: 1, a1: -1, a2: 0, a3: 0}, descending: {a0: 0, a1: 0, a2: 0, a3: 0}}"), [
        '4:88: model.memoryless.ascending: a0 = 1 and a1 = -1 make a falling branch; give both the same sign',
        '4:136: model.memoryless.descending.a0: must not be 0, or the branch is constant; give a0 and a1 of the same sign',
        '4:143: model.memoryless.descending.a1: must not be 0, or the branch is constant; give a0 and a1 of the same sign',
    ]),
    case('tanh_no_branch', front("[{kind: tanh}]"), [
        '4:65: model.memoryless[0].ascending: is missing; add `ascending: {a0: 6.0, a1: 0.4, a2: 0.0, a3: 0.0}`',
    ]),
    case('tanh_too_flat', front("{kind: tanh, ascending: {a0: 1.0e-200, a1: 1.0e-200, a2: 0, a3: 0}}"), [
        "4:88: model.memoryless.ascending: a0 a1, the branch's steepest slope, is 0.0; keep to 1e-150 .. 1e150",
    ]),
    case('tanh_key_named_tanh', front("{kind: tanh, tanh: 1, ascending: {a0: 1}}"), [
        '4:77: model.memoryless.tanh: unknown key; valid here: kind, ascending, descending',
        '4:97: model.memoryless.ascending.a1: is missing; add `a1: 0.0`',
        '4:97: model.memoryless.ascending.a2: is missing; add `a2: 0.0`',
        '4:97: model.memoryless.ascending.a3: is missing; add `a3: 0.0`',
    ]),
    case('offset', H + "model: {pi: {thresholds: [0], weights: [1]}, output_offset: x}\n", [
        '4:61: model.output_offset: must be a number, not the text "x"; write it like 0.45',
    ]),
    case('effect_keys', eff("[{name: lag, time_constnt: 1}, {name: creep, shape: slow}, {name: delay, shape: x, time: q}]"), [
        '4:62: model.effects[0].time_constant: is missing; add `time_constant: 0.0125`',
        '4:74: model.effects[0].time_constnt: unknown key; did you mean time_constant?',
        '4:113: model.effects[1].shape: must be exponential or logarithmic, not the text "slow"; choose one of them',
        '4:134: model.effects[2].shape: unknown key; valid here: name, time',
        '4:150: model.effects[2].time: must be a number, not the text "q"; write it like 0.45',
    ]),
    case('effect_shape', eff("[{name: drift, shape: bent, rate: 1}]"), [
        '4:83: model.effects[0].shape: must be linear or curved, not the text "bent"; choose one of them',
    ]),
    case('effect_numbers', eff("[{name: lag, time_constant: -1}, {name: resonance, frequency: 0, damping: 11}, {name: drift, rate: .inf}]"), [
        '4:89: model.effects[0].time_constant: must be at least 0, not -1; correct the number',
        '4:123: model.effects[1].frequency: must be above 0, not 0; correct the number',
        '4:135: model.effects[1].damping: must be at most 10, not 11; correct the number',
        '4:160: model.effects[2].rate: must be a finite number, not inf; write one of at most 1e+30 in magnitude',
    ]),
    case('effect_lengths', eff("[{name: creep, time_constants: [1, 2], weights: [1]}, {name: rate_dependence, betas: [1, 2]}, {name: noncongruent, coefficients: [[1], [2]]}]"), [
        '4:109: model.effects[0].weights: has 1 value for 2 in time_constants; give as many as time_constants',
        '4:146: model.effects[1].betas: has 2 values for 1 play; give one for each threshold but r_0',
        '4:190: model.effects[2].coefficients: has 2 lists for 1 play; give one for each threshold but r_0',
    ]),
    case('effect_no_plays', H + "model: {pi: {thresholds: [0], weights: [1]}, effects: [{name: rate_dependence, betas: [1]}]}\n", [
        '4:63: model.effects[0].name: acts on plays with a threshold, and the model has none; remove the entry',
    ]),
    case('effect_twice', eff("[{name: lag, time_constant: 1}, {name: resonance, frequency: 1, damping: 1}, {name: lag, time_constant: 2}]"), [
        '4:145: model.effects[2].name: lag is given twice (first in model.effects[0]); keep one of them',
    ]),
    case('effect_spectrum', eff("[{name: creep, shape: logarithmic, per_decade: 0.1, t_min: 2, t_max: 1}]"), [
        '4:130: model.effects[0].t_max: 1.0 is not above t_min = 2.0; give seconds, t_min < t_max',
    ]),
    case('effect_saturation_in_front', eff("[{name: saturation, side: front}]"), [
        '4:62: model.effects[0].level: is missing; add `level: 50.0` (this is saturation behind the plays; one in front is a stage of model.memoryless)',
        '4:81: model.effects[0].side: unknown key; valid here: name, shape, level, centre (this is saturation behind the plays; one in front is a stage of model.memoryless)',
    ]),
    case('effect_empty_values', eff("[{name: lag, time_constant: }, {name: slew_limit, rate: 1, falling_rate: }]"), [
        '4:74: model.effects[0].time_constant: has no value; write one, or remove it',
        '4:120: model.effects[1].falling_rate: has no value; write one, or remove it',
    ]),
    case('effect_near', eff("[{name: creap}]"), [
        '4:69: model.effects[0].name: unknown effect creap; did you mean creep?',
    ]),
    case('effect_unknown', eff("[{name: zzz}]"), [
        '4:69: model.effects[0].name: unknown effect zzz; known effects: creep, rate_dependence, resonance, lag, delay, slew_limit, asymmetry, saturation, thermal, influence, drift, ageing, sensor_nonlinearity, noncongruent, bouc_wen',
    ]),
    case('effect_user', eff("[{name: 'user:x'}]"), [
        '4:69: model.effects[0].name: user:x is not defined in any given file; give its file (--effects)',
    ]),
    case('effect_asymmetry', eff("[{name: asymmetry}]"), [
        '4:69: model.effects[0].name: asymmetry is not written here; make it a stage of model.memoryless',
    ]),
    case('effect_forms', eff("[creep, {}, {name: 5}, {name: }, null]"), [
        '4:62: model.effects[0]: must be an effect with its name, not the text "creep"; write {name: ..}',
        '4:69: model.effects[1].name: is missing; add the name of an effect',
        '4:80: model.effects[2].name: must name an effect, not 5; known effects: creep, rate_dependence, resonance, lag, delay, slew_limit, asymmetry, saturation, thermal, influence, drift, ageing, sensor_nonlinearity, noncongruent, bouc_wen',
        '4:85: model.effects[3].name: has no value; write one, or remove it',
        '4:94: model.effects[4]: has no value; write one, or remove it',
    ]),
    case('effects_mapping', eff("{name: creep}"), [
        '4:61: model.effects: must be a list, not a mapping; write [ ] around the values',
    ]),
    case('emit', H + M + "emit: {operator: inv, arithmetic: float, engine: 5, drive_lsb: 0, output_lsb: -1, x: 1}\n", [
        '5:18: emit.operator: must be inverse, forward or both, not the text "inv"; did you mean inverse?',
        '5:35: emit.arithmetic: must be float32, float64, q31 or q15, not the text "float"; did you mean float32 or float64?',
        '5:50: emit.engine: must be auto, corners or loop, not 5; choose one of them',
        '5:64: emit.drive_lsb: must be above 0, not 0; correct the number',
        '5:79: emit.output_lsb: must be above 0, not -1; correct the number',
        '5:83: emit.x: unknown key; valid here: output, operator, arithmetic, engine, optimize, drive_lsb, '
        'output_lsb, compensation, converter, health, degauss',
    ]),
    case('emit_output', H + M + "emit: {output: 3}\n", [
        '5:16: emit.output: must be text, not 3; put it in quotes',
    ]),
    case('emit_output_lines', H + M + 'emit: {output: "a\\nb"}\n', [
        '5:16: emit.output: must be a single line; remove the line break',
    ]),
    case('compensation', H + M + "emit:\n  compensation: {preview: -1, drive_hold: x, noise_gain: 0, taps: 4, corner: 1.5,"
         " resonance: tuned, quiet: x, still: true}\n", [
        '6:27: emit.compensation.preview: must be at least 0, not -1; correct the number',
        '6:43: emit.compensation.drive_hold: must be straight or held, not the text "x"; choose one of them',
        '6:58: emit.compensation.noise_gain: must be above 0, not 0; correct the number',
        '6:67: emit.compensation.taps: must be 3 or 5, not 4; choose one of them',
        '6:78: emit.compensation.corner: must be a whole number, not 1.5; write it like 12',
        '6:94: emit.compensation.resonance: must be inverse, notch, shaper or none, not the text "tuned"; choose one of them',
        '6:108: emit.compensation.quiet: must be true or false, not the text "x"; write one of them, without quotes',
        '6:111: emit.compensation.still: unknown key; valid here: preview, drive_hold, noise_gain, max_rate, '
        'resonance, taps, corner, quiet, compensate',
    ]),
    case('compensate', H + M + "emit: {compensation: {compensate: [lag]}}\nnot_separable: [[creep], [a, b, c], 3]\n", [
        '5:36: emit.compensation.compensate[0]: must be drift or self_heating, not the text "lag"; choose one of them',
        '6:17: not_separable[0]: must be two names; write [asymmetry, sensor_nonlinearity]',
        '6:26: not_separable[1]: must be two names; write [asymmetry, sensor_nonlinearity]',
        '6:37: not_separable[2]: must be a list, not 3; write [ ] around the values',
    ]),
    case('emit_lsb', H + M + "emit: {drive_lsb: q, output_lsb: 1e31}\n", [
        '5:19: emit.drive_lsb: must be a number, not the text "q"; write it like 0.45',
        '5:34: emit.output_lsb: must be at most 1e+30, not 1e+31; correct the number',
    ]),
]  # fmt: skip

ACCEPTED = {
    "contract": CONTRACT,
    "least": H + M,
    "effects": eff("[{name: creep, time_constants: [1], weights: [0]}, {name: saturation, shape: hard, level: 2}, {name: drift, rate: -1e-3}]"),
    "effect_shapes": eff("[{name: creep, shape: logarithmic, per_decade: 0.1}, {name: thermal, source: logged}, {name: lag, time_constant: 0}]"),
    "only_p0": pi("thresholds: [0], weights: [1]"),
    "p0_zero": pi("thresholds: [0, 1], weights: [0, 1]"),
    "bom": "\ufeff" + H + M,
    "crlf": (H + M).replace("\n", "\r\n"),
    "directive": "%YAML 1.2\n---\n" + H + M + "...\n",
    "octal_hex_exponent": pi("thresholds: [0, 0o17, 0x1F, 1e2, .5e+3], weights: [1, +1, 1., .5, 1E-3]"),
    "negative_zero": pi("thresholds: [-0.0, 1], weights: [1, -0]"),
    "list_state": pi("thresholds: [0, 1], weights: [1, 1], initial_state: [0, -0.5]"),
    "description": H + M + "description: |\n  two\n  lines: µm # {x}\n",
    "on_is_text": H + M + "units: {input: on, output: yes}\n",
    "quoted": H.replace("name: a", "'name': \"a\"") + M,
    "formula": den("formula: 0.8*exp(-0.3*r), p0: 0.7, r_max: 10, n: 12"),
    "tolerance": den("formula: 0.8*exp(-0.3*r), p0: 0, r_max: 10, tolerance: 0.01"),
    "table": den("table: {r: [0.5, 1, 3], p: [0, 1, 0]}, p0: 1, n: 4"),
    "stage_list": front(f"[{{kind: tanh, ascending: {TANH}}}, {{kind: dead_zone, thresholds: [0], weights: [-1]}}]"),
    "two_branches": front(f"{{kind: tanh, ascending: {TANH}, descending: {{a0: -6, a1: -0.4, a2: 0, a3: 1}}}}"),
    "no_stages": front("[]"),
    "fixed_point": H + M + "emit: {arithmetic: q15, operator: both, engine: loop}\n",
    "most_plays": pi(f"thresholds: {list(range(4097))}, weights: {[1] * 4097}"),
    "largest": "hystgen: 1\nname: a\ninput_range: [-1e30, 1e30]\n" + M,
}


def refusal(text: str) -> list[str]:
    with pytest.raises(ParameterError) as caught:
        parse_parameters(text, "f.yaml")
    assert caught.value.file == "f.yaml"
    assert len(caught.value.problems) == len(str(caught.value).split("\n"))
    return str(caught.value).split("\n")


@pytest.mark.parametrize(("text", "lines"), REFUSED)
def test_refusal(text: str, lines: list[str]) -> None:
    expected = [re.sub(r"^(\d+:\d+):", r"f.yaml:\1: error:", line) for line in lines]
    assert refusal(text) == expected
    assert all(line.isprintable() for line in expected)
    assert all("; " in line for line in expected), "every message says what to do"


@pytest.mark.parametrize("label", ACCEPTED)
def test_accepted(label: str) -> None:
    parameters = parse_parameters(ACCEPTED[label])
    assert parse_parameters(dump_parameters(parameters)) == parameters
    hash(parameters)


def test_contract_example() -> None:
    parameters = parse_parameters(CONTRACT)
    assert parameters.hystgen == 1
    assert (parameters.name, parameters.description) == ("stage_x", "P-885 stack, axis X")
    assert (parameters.units.input, parameters.units.output, parameters.sample_time) == ("V", "um", 5e-5)
    assert parameters.input_range == (0.0, 100.0)
    assert parameters.model.pi.thresholds == (0.0, 0.45, 0.9)
    assert parameters.model.pi.weights == (0.72, 0.6, 0.48)
    assert parameters.model.pi.density is None
    assert parameters.model.pi.density_error is None
    (stage,) = parameters.model.memoryless
    assert isinstance(stage, DeadZoneParameters)
    assert stage.thresholds == (-1.0, -0.4, 0.0, 0.4, 1.0)
    assert parameters.emit.drive_lsb == 0.005


def test_values() -> None:
    got = parse_parameters(ACCEPTED["octal_hex_exponent"]).model.pi
    assert got.thresholds == (0, 15, 31, 100, 500)
    assert got.weights == (1, 1, 1, 0.5, 0.001)
    assert all(type(x) is float for x in got.thresholds + got.weights)
    assert parse_parameters(ACCEPTED["on_is_text"]).units.input == "on"
    zero = parse_parameters(ACCEPTED["negative_zero"]).model.pi
    assert str(zero.thresholds[0]) == "0.0"
    one, two = parse_parameters(ACCEPTED["stage_list"]).model.memoryless
    assert isinstance(one, TanhParameters)
    assert isinstance(two, DeadZoneParameters)
    assert one.descending == one.ascending
    assert one.ascending.a0 == 6.0
    least = parse_parameters(H + M)
    assert least.emit == EmitDefaults()
    assert (least.emit.operator, least.emit.arithmetic, least.emit.engine) == ("inverse", "float32", "auto")
    assert (least.model.pi.initial_state, least.model.output_offset, least.sample_time) == (0.0, 0.0, None)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001), ("+.5", 0.5), ("1.", 1.0), ("010", 10), ("0o10", 8), ("0xfF", 255), ("-7", -7), ("true", True), ("FALSE", False),
        ("~", None), ("", None), ("Null", None), ("on", "on"), ("yes", "yes"), ("nULL", "nULL"), ("1_0", "1_0"), ("0b1", "0b1"), ("1:30", "1:30"),
        ("2020-01-01", "2020-01-01"), ("-.INF", float("-inf")), (".Inf", float("inf")), ("inf", "inf"), ("1e", "1e"), ("e5", "e5"), ("٣", "٣"), ("-0o7", "-0o7"),
    ],
)  # fmt: skip
def test_core_schema(text: str, value: object) -> None:
    got = yaml_positions.resolve(text)
    assert (got, type(got)) == (value, type(value))


def test_nan_is_recognised() -> None:
    got = yaml_positions.resolve(".NaN")
    assert isinstance(got, float)
    assert got != got


def test_all_problems_at_once() -> None:
    text = """\
hystgen: 1
name: double
descripton: typing error
description: "tab\\t"
units: {input: V, input: W}
sample_time: -1
input_range: [5, 1]
model:
  pi:
    thresholds: [0, 0.9, 0.45]
    weights: [0.72, 0.6]
    initial_state: [0, 0]
  memoryless:
    - {kind: dead_zone, thresholds: [1, 2], weights: [1]}
    - {kind: tanh, ascending: {a0: 1, a1: -1, a2: 0, a3: 0}}
    - *stage
  effects:
    - {name: crep}
emit: {operator: revers}
"""
    assert refusal(text) == [
        "f.yaml:2:7: error: name: double is a keyword of C or C++; choose another name, such as axis_double",
        "f.yaml:3:1: error: descripton: unknown key; did you mean description?",
        "f.yaml:4:14: error: description: contains the unprintable character U+0009; remove it",
        "f.yaml:5:19: error: units.input: this key is given twice (first in line 5); keep one of them",
        "f.yaml:6:14: error: sample_time: must be above 0, not -1; correct the number",
        "f.yaml:7:14: error: input_range: 5 is not below 1; write [lowest, highest]",
        "f.yaml:10:26: error: model.pi.thresholds[2]: 0.45 is not above the 0.9 before it; sort the list and remove repeated values",
        "f.yaml:11:14: error: model.pi.weights: has 2 values for 3 in thresholds; give as many as thresholds",
        "f.yaml:12:20: error: model.pi.initial_state: has 2 values for 3 thresholds (r_0 included); write one number, or one per threshold",
        "f.yaml:14:37: error: model.memoryless[0].thresholds: do not contain 0; add 0 and the weight of the linear part",
        "f.yaml:14:54: error: model.memoryless[0].weights: has 1 value for 2 in thresholds; give as many as thresholds",
        "f.yaml:15:31: error: model.memoryless[1].ascending: a0 = 1 and a1 = -1 make a falling branch; give both the same sign",
        "f.yaml:16:7: error: model.memoryless[2]: aliases (*) are not accepted; write the value itself",
        "f.yaml:18:14: error: model.effects[0].name: unknown effect crep; did you mean creep?",
        "f.yaml:19:18: error: emit.operator: must be inverse, forward or both, not the text \"revers\"; did you mean inverse?",
    ]


def test_problem_objects() -> None:
    with pytest.raises(ParameterError) as caught:
        parse_parameters(pi("thresholds: [0, 1], weights: [1, -1]"))
    (problem,) = caught.value.problems
    assert (problem.path, problem.line, problem.column) == ("model.pi.weights[1]", 4, 47)
    assert problem.message == "must be at least 0, not -1; correct the number"
    assert str(caught.value).startswith("<string>:4:47: error: model.pi.weights[1]: ")


def test_unknown_finding_of_pydantic_is_passed_on() -> None:
    said = param_checks._reworded("brand_new", "x", 1, {}, "Input should be even")
    assert said == "input should be even; correct the value"


# Files ---------------------------------------------------------------------------------------------------


def load_refusal(path: Path | str) -> str:
    with pytest.raises(ParameterError) as caught:
        load_parameters(path)
    return str(caught.value).replace(str(path), "FILE")


def test_load(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(CONTRACT)
    assert load_parameters(path) == load_parameters(str(path)) == parse_parameters(CONTRACT)
    path.write_bytes(b"\xef\xbb\xbf" + CONTRACT.replace("\n", "\r\n").encode())
    assert load_parameters(path) == parse_parameters(CONTRACT)


def test_unreadable(tmp_path: Path) -> None:
    assert load_refusal(tmp_path / "none.yaml") == "FILE: error: cannot be read (No such file or directory); give the path of a parameter file"
    assert load_refusal(tmp_path) == "FILE: error: cannot be read (Is a directory); give the path of a parameter file"
    assert load_refusal("a\0b") == "FILE: error: cannot be read (embedded null byte); give the path of a parameter file"


def test_size(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(CONTRACT + "#" * (2**20 - len(CONTRACT) - 1) + "\n")
    assert path.stat().st_size == 2**20
    assert load_parameters(path) == parse_parameters(CONTRACT)
    path.write_text(CONTRACT + "#" * (2**20 - len(CONTRACT)) + "\n")
    size = "the file has 1048577 bytes, more than 1048576 (1 MiB); keep one model per file"
    assert load_refusal(path) == f"FILE: error: {size}"
    assert refusal(path.read_text()) == [f"f.yaml: error: {size}"]
    assert load_refusal("/dev/zero") == "FILE: error: the file has more than 1048576 bytes (1 MiB); keep one model per file"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"name: x\r\ndescription: \xc3\xa9\xe9\n", "FILE:2:15: error: byte 0xE9 is not UTF-8; save the file as UTF-8"),
        (CONTRACT.encode("utf-16"), "FILE:1:1: error: byte 0xFF is not UTF-8; save the file as UTF-8"),
        (b"name: \xed\xa0\x80\n", "FILE:1:7: error: byte 0xED is not UTF-8; save the file as UTF-8"),
    ],
)
def test_not_utf8(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_bytes(content)
    assert load_refusal(path) == message


def test_bombs_are_refused_quickly() -> None:
    start = time.perf_counter()
    bomb = "a: &a [x]\n" + "".join(f"{b}: &{b} [{', '.join(['*' + a] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    lines = refusal(bomb)
    assert sum("aliases" in line for line in lines) == 72
    assert sum("anchors" in line for line in lines) == 9
    for opening in ("[", "{a: ", "- ", "? "):
        assert "nested more than 16 deep" in refusal(opening * 100_000)[-1]
    assert "more than 100000 keys and values" in refusal("a: [\n" + "1,\n" * 200_000 + "]")[0]
    assert time.perf_counter() - start < 30


def test_many_problems_stay_quick() -> None:
    start = time.perf_counter()
    assert len(refusal("".join(f"key{i}: 1\n" for i in range(20_000)))) == 20_004
    assert len(refusal(pi(f"thresholds: {list(range(4097))}, weights: {[-1] * 4097}"))) == 4097
    assert time.perf_counter() - start < 30


# Plain data ----------------------------------------------------------------------------------------------


def test_make_parameters() -> None:
    import numpy as np

    data = {
        "hystgen": 1,
        "name": "a",
        "sample_time": None,
        "input_range": [0, np.float64(1)],
        "model": {"pi": {"thresholds": np.array([0.0, 1.0]), "weights": (1, np.float64(0.1)), "density": None}},
    }
    parameters = make_parameters(data)
    assert parameters == parse_parameters(pi("thresholds: [0, 1], weights: [1, 0.1]"))
    assert type(parameters.model.pi.weights[1]) is float
    with pytest.raises(ParameterError) as caught:
        make_parameters({**data, "name": "int", "input_range": [0, 10**400], "units": None}, "here")
    assert str(caught.value) == (
        "here: error: input_range[1]: must be a finite number, not inf; write one of at most 1e+30 in magnitude\n"
        "here: error: name: int is a keyword of C or C++; choose another name, such as axis_int"
    )


# Writing -------------------------------------------------------------------------------------------------

numbers = st.floats(-1e30, 1e30)
weights = st.floats(0, 1e30)


@st.composite
def parameter_data(draw: st.DrawFn) -> dict[str, Any]:
    count = draw(st.integers(1, 5))
    rising = st.lists(st.floats(0, 1e30, exclude_min=True), min_size=count - 1, max_size=count - 1, unique=True)
    points = draw(st.lists(st.integers(0, 50), min_size=2, max_size=5, unique=True))
    listed = {
        "thresholds": [0.0, *sorted(draw(rising))],
        "weights": [*draw(st.lists(weights, min_size=count - 1, max_size=count - 1)), 1.0],
        "initial_state": draw(st.one_of(numbers, st.lists(numbers, min_size=count, max_size=count))),
    }
    density = {
        "table": {"r": sorted(points), "p": draw(st.lists(st.floats(0, 1e20), min_size=len(points), max_size=len(points)))},
        "p0": draw(st.floats(0, 1e20, exclude_min=True)),
        "n": draw(st.integers(1, 5)),
    }
    sizes = st.floats(0, 1e30, exclude_min=True)
    slopes = st.floats(1e-30, 1e30)  # their product is a slope, which must stay in bounds
    branch = st.builds(lambda a0, a1, a2, a3, sign: {"a0": a0 * sign, "a1": a1 * sign, "a2": a2, "a3": a3}, slopes, slopes, numbers, numbers, st.sampled_from([1, -1]))
    dead_zones = st.lists(numbers.filter(bool), unique=True, max_size=4).map(lambda r: sorted([0.0, *r]))
    dead_zone = dead_zones.flatmap(
        lambda r: st.fixed_dictionaries(
            {"kind": st.just("dead_zone"), "thresholds": st.just(r), "weights": st.lists(numbers, min_size=len(r), max_size=len(r))}
        )
    )
    tanh = st.fixed_dictionaries({"kind": st.just("tanh"), "ascending": branch}, optional={"descending": branch})
    effect = st.one_of(
        st.builds(lambda x: {"name": "lag", "time_constant": x}, st.floats(0, 1e30)),
        st.builds(lambda x, y: {"name": "resonance", "frequency": x, "damping": y}, sizes, st.floats(0, 10, exclude_min=True)),
        st.builds(lambda x: {"name": "creep", "time_constants": [x, x], "weights": [x, 0]}, sizes),
        st.builds(lambda x: {"name": "creep", "shape": "logarithmic", "per_decade": x}, weights),
        st.builds(lambda x: {"name": "slew_limit", "rate": x}, sizes),
        st.builds(lambda x, y: {"name": "thermal", "source": "self_heating", "time_constant": x, "heating": y}, sizes, weights),
        st.builds(lambda x, y: {"name": "sensor_nonlinearity", "coefficients": [x, y], "scale": 1}, numbers, numbers),
    )
    ends = draw(st.lists(numbers, min_size=2, max_size=2, unique=True))
    printable = st.text(st.characters(codec="utf-8").filter(str.isprintable), max_size=40)
    lines = st.text(st.one_of(st.just("\n"), st.characters(codec="utf-8").filter(str.isprintable)), max_size=99)
    return {
        "hystgen": 1,
        "name": draw(st.from_regex(r"\A[A-Za-z](_?[A-Za-z0-9]){0,19}\Z").filter(lambda n: name_problem(n) is None)),
        "description": draw(lines),
        "units": {"input": draw(printable), "output": draw(printable)},
        "sample_time": draw(st.none() | sizes),
        "input_range": sorted(ends),
        "model": {
            "pi": draw(st.sampled_from([listed, {"density": density}])),
            "memoryless": draw(st.one_of(dead_zone, tanh, st.lists(st.one_of(dead_zone, tanh), max_size=3))),
            "output_offset": draw(numbers),
            "effects": draw(st.lists(effect, max_size=3, unique_by=lambda e: e["name"])),
        },
        "emit": {
            "output": draw(st.none() | st.sampled_from(["firmware", "../a b/c", "/abs: #1"])),
            "operator": draw(st.sampled_from(["inverse", "forward", "both"])),
            "arithmetic": draw(st.sampled_from(["float32", "float64", "q31", "q15"])),
            "engine": draw(st.sampled_from(["auto", "corners", "loop"])),
            "optimize": draw(st.sampled_from(["auto", "speed", "size"])),
            "drive_lsb": draw(st.none() | sizes),
            "output_lsb": draw(st.none() | sizes),
            "compensation": {
                "preview": draw(st.none() | st.integers(0, 1000)),
                "drive_hold": draw(st.sampled_from(["straight", "held"])),
                "noise_gain": draw(st.none() | sizes),
                "max_rate": draw(st.none() | sizes),
                "resonance": draw(st.sampled_from(["inverse", "notch", "shaper", "none"])),
                "taps": draw(st.sampled_from([3, 5])),
                "corner": draw(st.integers(0, 100)),
            },
        },
    }


@settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.too_slow])
@given(parameter_data(), st.text(max_size=20), st.text(max_size=20))
@pytest.mark.thorough
def test_round_trip(data: dict[str, Any], header: str, comment: str) -> None:
    parameters = make_parameters(data)
    text = dump_parameters(parameters, {"model.pi": comment, "emit.engine": comment, "sample_time": comment}, header)
    again = parse_parameters(text)
    assert again == parameters
    assert repr(again) == repr(parameters)
    assert parameters_sha256(again) == parameters_sha256(parameters)
    assert dump_parameters(again) == dump_parameters(parameters)
    jsonschema.validate(json.loads(json.dumps(YAML(typ="safe", pure=True).load(text))), schema())


def test_dump_text() -> None:
    text = dump_parameters(
        parse_parameters(CONTRACT), {"model.pi.weights": "fitted\nin June", "emit.operator": "default"}, "stage X\n\nP-885"
    )
    assert text == (
        "# stage X\n#\n# P-885\n"
        'hystgen: 1\nname: stage_x\ndescription: "P-885 stack, axis X"\nunits: {input: V, output: um}\n'
        "sample_time: 5e-05\ninput_range: [0.0, 100.0]\nmodel:\n  pi:\n    thresholds: [0.0, 0.45, 0.9]\n"
        "    # fitted\n    # in June\n    weights: [0.72, 0.6, 0.48]\n"
        "  memoryless:\n    - kind: dead_zone\n      thresholds: [-1.0, -0.4, 0.0, 0.4, 1.0]\n"
        "      weights: [-1.1, -1.1, 4.8, -1.1, -1.1]\n"
        "emit:\n  # default\n  operator: inverse\n  drive_lsb: 0.005\n  output_lsb: 0.001\n"
    )


def test_dump_effects_in_full() -> None:
    text = eff("[{name: slew_limit, rate: 5}, {name: noncongruent, coefficients: [[0.1, 0]]}, {name: resonance, frequency: 9, damping: 1}, {name: resonance, frequency: 8, damping: 2}]")
    dumped = dump_parameters(parse_parameters(text))
    assert dumped.endswith(
        "  effects:\n    - name: slew_limit\n      rate: 5.0\n      falling_rate: 5.0\n"
        "    - name: noncongruent\n      shape: play_functions\n      coefficients: [[0.1, 0.0]]\n"
        "    - name: resonance\n      frequency: 9.0\n      damping: 1.0\n"
        "    - name: resonance\n      frequency: 8.0\n      damping: 2.0\n"
    )
    assert parse_parameters(dumped) == parse_parameters(text)
    assert '"effects":[{"falling_rate":5.0,"name":"slew_limit","rate":5.0},' in canonical_json(parse_parameters(text))
    short = eff("[{name: creep, time_constants: [1], weights: [1]}]")
    long = eff("[{name: creep, shape: exponential, weights: [1.0], time_constants: [1e0]}]")
    assert parameters_sha256(parse_parameters(short)) == parameters_sha256(parse_parameters(long))


def test_effects_as_objects() -> None:
    parameters = parse_parameters(eff("[{name: creep, time_constants: [1], weights: [1]}, {name: slew_limit, rate: 5}]"))
    data = {"hystgen": 1, "name": "a", "input_range": [0, 1]}
    again = make_parameters(
        {**data, "model": {"pi": {"thresholds": [0, 1], "weights": [1, 1]}, "effects": parameters.model.effects}}
    )
    assert again == parameters


def test_dump_least_and_wrapping() -> None:
    assert dump_parameters(parse_parameters(H + M)) == (
        "hystgen: 1\nname: a\ninput_range: [0.0, 1.0]\nmodel:\n  pi:\n    thresholds: [0.0, 1.0]\n    weights: [1.0, 1.0]\n"
    )
    table = ", ".join(str(i) for i in range(80))
    text = dump_parameters(parse_parameters(den(f"table: {{r: [{table}], p: [{table}]}}, p0: 1, n: 90")))
    assert max(len(line) for line in text.splitlines()) <= 100
    assert "table: {r: [0.0, 1.0," in text
    assert "thresholds" not in text
    emit = dump_parameters(parse_parameters(H + M), {"emit": "as usual"})
    assert emit.endswith("# as usual\nemit: {}\n")
    assert parse_parameters(emit) == parse_parameters(H + M)


def test_dump_refuses_comments_on_nothing() -> None:
    with pytest.raises(ValueError, match=r"no such keys to comment: model\.weights"):
        dump_parameters(parse_parameters(CONTRACT), {"model.weights": "x"})


# Canonical form and hash ---------------------------------------------------------------------------------


def test_canonical_json() -> None:
    assert canonical_json(parse_parameters(den("formula: 'r', r_max: 1, p0: 1, n: 2"))) == (
        '{"description":"","emit":{"arithmetic":"float32","drive_lsb":null,"engine":"auto","operator":"inverse","output_lsb":null},'
        '"hystgen":1,"input_range":[0.0,1.0],"model":{"effects":[],"memoryless":[],"output_offset":0.0,'
        '"pi":{"density":{"formula":"r","n":2,"p0":1.0,"r_max":1.0,"table":null,"tolerance":null},"initial_state":0.0}},'
        '"name":"a","sample_time":null,"units":{"input":"","output":""}}'
    )
    assert '"optimize":"size"' in canonical_json(parse_parameters(H + M + "emit: {optimize: size}\n"))
    assert parameters_sha256(parse_parameters(H + M)) == "2fbbca7334d59f1230679aa4ffa15effc67782184e067b2ccb5010972c1b339f"


def test_hash_ignores_the_folder_of_the_c() -> None:
    """Moving the C changes no byte of it."""
    without, there = (parse_parameters(H + M + f"emit: {{engine: loop{more}}}\n") for more in ("", ", output: fw"))
    assert there.emit.output == "fw"
    assert parameters_sha256(without) == parameters_sha256(there)


def test_hash_ignores_form() -> None:
    rewritten = """\
# another layout
emit: {output_lsb: 1e-3, drive_lsb: 5.0E-3}
model:
    memoryless:
      - {weights: [-1.1, -1.1, 4.8, -1.1, -1.1], thresholds: [-1, -.4, -0.0, 4e-1, 1], kind: "dead_zone"}
    pi: {weights: [.72, 0.60, 48e-2], thresholds: [0, 0.45, 0.9]}
input_range: [0, 0x64]
sample_time: 0.00005
units: {output: 'um', input: "V"}
description: >-
  P-885 stack,
  axis X
name: stage_x
hystgen: 1
"""
    assert parse_parameters(rewritten) == parse_parameters(CONTRACT)
    assert parameters_sha256(parse_parameters(rewritten)) == parameters_sha256(parse_parameters(CONTRACT))


def test_hash_sees_every_value() -> None:
    seen = {parameters_sha256(parse_parameters(text)) for text in ACCEPTED.values()}
    same = {"bom", "crlf", "directive", "quoted", "no_stages"}  # as "least"
    assert len(seen) == len(ACCEPTED) - len(same)


# JSON Schema ---------------------------------------------------------------------------------------------


def plain(text: str) -> Any:
    """The text's data as another YAML reader sees it, in JSON types; None if it cannot read it."""
    try:
        return json.loads(json.dumps(YAML(typ="safe", pure=True).load(text)))
    except Exception:
        return None


def accepted(data: Any) -> bool:
    try:
        parse_parameters(json.dumps(data))
    except ParameterError:
        return False
    return True


VALIDATOR = jsonschema.Draft202012Validator(schema())


def test_schema_is_valid() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())
    made = schema()
    assert made["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert made["$id"] == f"urn:hystgen:parameters:{made['properties']['hystgen']['const']}"
    assert made["title"] == "hystgen parameter file"
    for example in made["examples"]:
        VALIDATOR.validate(example)
        assert accepted(example)
    text = json.dumps(made)
    assert "\\u0000" not in text
    assert "null" not in text
    for part in [made, *made["$defs"].values()]:
        for key, value in part["properties"].items():
            assert key in ("kind", "pi") or value.get("description"), key


@pytest.mark.parametrize("label", ACCEPTED)
def test_schema_accepts(label: str) -> None:
    VALIDATOR.validate(plain(ACCEPTED[label].removeprefix("\ufeff")))


def test_schema_refuses_what_it_can_see() -> None:
    """The schema accepts only those refused files whose fault no schema can express.

    (`underscore_number` is a number to the reader used here, though not in YAML 1.2.)
    """
    beyond = {
        "yaml_1_1", "tag_directive", "anchor", "tag", "tag_on_top", "tagged_key", "format_float", "name_keyword",
        "description_odd", "units_line", "underscore_number", "range_reversed", "range_empty", "thresholds_start",
        "thresholds_order", "weights_length", "weights_zero", "state_length", "state_one", "density_n_float",
        "density_unreachable", "emit_output_lines", "density_formula", "density_negative", "density_singular", "density_pole",
        "density_not_finite", "density_zero", "density_huge", "table_order", "table_length", "density_state_length",
        "tanh_sign", "tanh_too_flat", "effect_lengths", "effect_no_plays", "effect_twice", "effect_spectrum", "effect_user",
    }  # fmt: skip
    passed = set()
    for parameter in REFUSED:
        text, label = str(parameter.values[0]), str(parameter.id)
        data = plain(text) if len(text) < 100_000 else None
        if data is not None and VALIDATOR.is_valid(data):
            passed.add(label)
    assert passed == beyond


junk = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 5000), st.floats(allow_nan=False), st.sampled_from(["", "x", "tanh", "dead_zone", "1"]),
    st.just([]), st.just({}), st.lists(st.integers(-1, 3), max_size=4), st.just({"kind": "tanh"}),
).map(copy.deepcopy)  # fmt: skip


@settings(deadline=None, max_examples=200)
@given(st.sampled_from([label for label in ACCEPTED if label not in ("most_plays", "tolerance")]), st.data())
def test_what_the_schema_refuses_is_refused(label: str, data: st.DataObject) -> None:
    root = copy.deepcopy(plain(ACCEPTED[label].removeprefix("\ufeff")))
    for _ in range(data.draw(st.integers(1, 3))):
        node: Any = root
        while isinstance(node, dict | list) and node:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            key = data.draw(st.sampled_from(keys))
            if not isinstance(node[key], dict | list) or not node[key] or data.draw(st.booleans()):
                action = data.draw(st.sampled_from(["replace", "delete", "add"]))
                if action == "delete":
                    del node[key]
                elif action == "replace":
                    node[key] = data.draw(junk)
                elif isinstance(node, dict):
                    node[data.draw(st.sampled_from(["x", "density", "thresholds", "n", "table", "r_max", "descending"]))] = data.draw(junk)
                else:
                    node.append(data.draw(junk))
                break
            node = node[key]
    if not VALIDATOR.is_valid(root):
        assert not accepted(root)


# Names and comments --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; give a name such as stage_x"),
        ("x" * 41, "has 41 characters, more than 40; shorten it"),
        ("a b", '"a b" is not a usable C prefix; use letters, digits and single underscores between them, starting with a letter'),
        ("INT", "INT is a keyword of C or C++; choose another name, such as axis_int"),
        ("Main", "main would write main.h and main.c, which are the firmware's own; choose another name"),
        ("math", "math.h would hide the system's header <math.h>; choose another name, such as axis_math"),
        ("AUX", "AUX is a device name on Windows, where AUX.h cannot be written; choose another name, such as axis_aux"),
        ("hystgen_a", "hystgen_a begins with hystgen, the prefix of the shared run time; choose another name"),
        ("a_selftest", "a_selftest.h is the self-test of a model named a; choose another name"),
        ("flt_x", "the macros FLT_... belong to <float.h>; choose another name, such as axis_flt_x"),
        ("uint8", "the macros UINT8_... belong to <stdint.h>; choose another name, such as axis_uint8"),
        ("dec32_" + "x" * 32, "the macros DEC32_... belong to <float.h>; choose another name"),
    ],
)
def test_name_problem(text: str, message: str) -> None:
    assert name_problem(text) == message


@pytest.mark.parametrize(
    "text",
    [
        "_a", "a_", "a__b", "1a", "a-b", "é", "a\n", "a.b", "ª", "while", "BOOL", "co_await", "constexpr", "and_eq", "nullptr", "typeof", "stdint",
        "StdBool", "float", "tgmath", "stdckdint", "pthread", "arduino", "con", "PRN", "nul", "com1", "LPT9", "dbl", "LDBL", "Flt", "size", "ptrdiff",
        "INT8", "uint_least16", "int_fast64", "HYSTGEN", "hystgen", "intmax", "wchar", "decltype", "dec_a", "signal", "sig", "fp", "x_SelfTest",
    ],
)  # fmt: skip
def test_names_refused(text: str) -> None:
    assert name_problem(text) is not None


@pytest.mark.parametrize("text", ["a", "A", "stage_x", "axis1", "X_1_y", "integer", "floats", "deck", "hystgenx", "str_x", "mem_x", "is_x", "e", "tofu", "x" * 40, "status", "interferometer"])
def test_names_accepted(text: str) -> None:
    assert name_problem(text) is None


@settings(max_examples=200)
@given(st.from_regex(r"\A[A-Za-z](_?[A-Za-z0-9]){0,39}\Z").filter(lambda n: name_problem(n) is None))
def test_emitted_identifiers_never_meet(stem: str) -> None:
    upper = stem.upper()
    symbols = [f"{stem}_{end}" for end in ("real_t", "forward_t", "inverse_t", "selftest")]
    symbols += [f"{stem}_{op}_{verb}" for op in ("forward", "inverse") for verb in ("init", "reset", "step", "commit", "status")]
    macros = "N_PLAYS DRIVE_MIN DRIVE_MAX OUTPUT_MIN OUTPUT_MAX DRIVE_LSB OUTPUT_LSB STATUS_INPUT_CLAMPED STATUS_OUTPUT_CLAMPED STATUS_HELD STATUS_DOMAIN"
    macros += " FORWARD_MAX_ERROR INVERSE_MAX_ERROR FORWARD_MAX_ERROR_LSB INVERSE_MAX_ERROR_LSB IMPLEMENTATION H SELFTEST_H"
    emitted = symbols + [f"{upper}_{end}" for end in macros.split()]
    assert len(set(emitted)) == len(emitted)
    assert not any("__" in word or word.startswith("_") for word in emitted)
    assert not any(re.match(r"(FLT|DBL|LDBL|DEC|INT(\d|_LEAST|_FAST)|U?INT(8|16|32|64|MAX|PTR)|SIZE|PTRDIFF|HYSTGEN)_", word) for word in emitted)


@pytest.mark.parametrize(
    ("text", "comment"),
    [
        ("plain text, 100 %", "plain text, 100 %"), ("*/ int x; /*", "* / int x; / *"), ("*/*/", "* / * /"), ("**//**", "** // **"),
        ("a\\", "a/"), ("a\\\nb", "a/ b"), ("*\\", "* /"), ("\\*", "/ *"), ("??/", "? ?/"), ("????=", "? ? ? ?="), ("µm", "um"), ("μm", "um"),
        ("20 °C ± 1", "20 degC +/- 1"), ("1 kΩ", "1 kOhm"), ("m·s⁻¹", "m.s^-^1"), ("é Ä ß ø", "e A ss o"), ("日本", "? ?"), ("a\0b\x1bc", "a?b?c"),
        (" a\r\n\tb\u2028c ", "a b c"), ("x\u202ey", "x?y"), ("é\\", "e/"), ("日/*", "?/ *"), ("", ""), ("\n", ""), ("√*/", "?* /"), ("😀", "?"),
    ],
)  # fmt: skip
def test_comment_text(text: str, comment: str) -> None:
    assert comment_text(text) == comment


@settings(max_examples=500)
@given(st.text(st.one_of(st.sampled_from("*/\\?=()<>!'-\n\r µΩé日 \ufeff"), st.characters()), max_size=60))
def test_comment_text_is_harmless(text: str) -> None:
    comment = comment_text(text)
    assert comment.isascii()
    assert comment == "" or comment.isprintable()
    assert not any(bad in comment for bad in ("*/", "/*", "\\", "??", "\n"))
    assert comment == comment.strip()
    assert comment_text(comment) == comment


def test_import_is_light() -> None:
    code = "import sys, hystgen.parameters.files; print(*sorted({m.split('.')[0] for m in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"mpmath", "numpy", "scipy", "numba", "jsonschema", "matplotlib", "jinja2"} & set(loaded)


def test_frozen() -> None:
    parameters = parse_parameters(CONTRACT)
    with pytest.raises(ValueError, match="frozen"):
        parameters.name = "b"  # type: ignore[misc]
    assert isinstance(parameters, Parameters)
