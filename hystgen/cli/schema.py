"""`hystgen schema`: the JSON Schemas of the parameter file and of the manifest."""

from __future__ import annotations

import click

from hystgen.basics import console


@click.command()
@click.option("--manifest", is_flag=True, help="that of NAME_manifest.json, which emit --manifest writes")
def schema(manifest: bool) -> None:
    """Print the JSON Schema of the parameter file, or of the manifest.

    Editors use it if the file begins with  # yaml-language-server: $schema=hystgen.schema.json

    Example: hystgen schema > hystgen.schema.json
    """
    import json

    if manifest:
        from hystgen.emission.manifest import schema as wanted
    else:
        from hystgen.parameters.schema import schema as wanted

    console.say(json.dumps(wanted(), indent=2))
