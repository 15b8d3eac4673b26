"""`hystgen schema`: the JSON Schema of the parameter file."""

from __future__ import annotations

import click

from hystgen.basics import console


@click.command()
def schema() -> None:
    """Print the JSON Schema of the parameter file.

    Editors use it if the file begins with  # yaml-language-server: $schema=hystgen.schema.json

    Example: hystgen schema > hystgen.schema.json
    """
    import json

    from hystgen.parameters.schema import schema as parameter_schema

    console.say(json.dumps(parameter_schema(), indent=2))
