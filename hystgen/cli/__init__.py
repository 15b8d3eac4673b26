"""The command line: parse the words, call one function, print what it returns. One file per command."""

from __future__ import annotations

import gc

import click

from hystgen.basics import console
from hystgen.basics.version import __version__
from hystgen.cli.diagnose import diagnose
from hystgen.cli.emit import emit
from hystgen.cli.identify import identify
from hystgen.cli.schema import schema
from hystgen.cli.show import show
from hystgen.cli.simulate import simulate
from hystgen.cli.track import track
from hystgen.cli.verify import verify


OBJECTS = 50_000
"""[objects] made between two searches for garbage. Nearly all objects of a command are classes and functions, which
stay: with Python's 700, `hystgen emit` of a plain model spends 70 of 1,666 million instructions, and 50 of 340 ms, on
looking at them again and again."""


@click.group(cls=console.Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystgen")
def main() -> None:
    """From a measured hysteresis loop to a verified compensator in C."""
    from hystgen.basics import jit

    gc.set_threshold(OBJECTS)
    jit.announce = console.note


for command in (emit, verify, simulate, identify, diagnose, track, show, schema):
    main.add_command(command)
