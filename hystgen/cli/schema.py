"""`hystgen schema`: the JSON Schemas of the parameter file and of what other commands write."""

from __future__ import annotations

import click

from hystgen.basics import console


@click.command()
@click.option("--manifest", is_flag=True, help="that of NAME_manifest.json, which emit --manifest writes")
@click.option("--monitor", is_flag=True, help="that of monitor.json, which monitor writes")
@click.option("--refine", is_flag=True, help="that of the JSON that refine writes")
def schema(manifest: bool, monitor: bool, refine: bool) -> None:
    """Print the JSON Schema of the parameter file, or of a file that another command writes.

    Editors use it if the file begins with  # yaml-language-server: $schema=hystgen.schema.json

    Example: hystgen schema > hystgen.schema.json
    """
    import json

    if manifest + monitor + refine > 1:
        raise click.UsageError("--manifest, --monitor and --refine are different schemas; give one of them")
    if monitor:
        from hystgen.service.monitoring import schema as wanted
    elif refine:
        from hystgen.service.learning import schema as wanted
    elif manifest:
        from hystgen.emission.manifest import schema as wanted
    else:
        from hystgen.parameters.schema import schema as wanted

    console.say(json.dumps(wanted(), indent=2))
