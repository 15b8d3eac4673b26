"""The command line: parse the arguments, call one function, print the result. One file per command."""

from __future__ import annotations

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


@click.group(cls=console.Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystgen")
def main() -> None:
    """From a measured hysteresis loop to a verified compensator in C."""
    from hystgen.basics import jit

    jit.announce = console.note


for command in (emit, verify, simulate, identify, diagnose, track, show, schema):
    main.add_command(command)
