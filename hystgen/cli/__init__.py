"""The command line: parse the arguments, call one function, print the result. One file per command."""

from __future__ import annotations

import atexit
import difflib
import gc
import importlib
import os

import click

from hystgen.basics import console
from hystgen.basics.version import __version__

COMMANDS = (
    "emit", "verify", "blob", "build", "fmu", "simulate", "degauss", "identify", "diagnose", "track", "compare",
    "monitor", "refine", "show", "schema",
)
"""The commands, each in a module of the same name."""


class _Commands(console.Commands):
    """Commands that are imported on first use."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  for all groups
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002  for all groups
        if cmd_name not in COMMANDS:
            return None
        found: click.Command = getattr(importlib.import_module(f"hystgen.cli.{cmd_name}"), cmd_name)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command; for an unknown one, a failure that says which may be meant."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            close = difflib.get_close_matches(args[0], COMMANDS, 1)
            meant = OTHERWISE.get(args[0]) or (close[0] if close else "")
            ctx.fail(f"No such command '{args[0]}'." + (f" Did you mean '{meant}'?" if meant else ""))
        return super().resolve_command(ctx, args)


OTHERWISE = {
    "plan": "diagnose --plan", "fit": "identify", "invert": "simulate --operator inverse",
    "inverse": "simulate --operator inverse", "raster": "simulate --operator inverse",
    "fleet": "identify --batch", "batch": "identify --batch", "report": "identify --report", "plot": "show --plot",
}
"""Words for which there is no command of that name, and what does it."""


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystgen")
def main() -> None:
    """From a measured hysteresis loop to a verified compensator in C."""
    from hystgen.basics import jit

    atexit.register(gc.freeze)  # no garbage search at exit: 62 of 1,486 million instructions, for memory freed anyway
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # would search every installed distribution
    jit.announce = console.note
