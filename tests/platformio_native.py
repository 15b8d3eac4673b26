"""Stand-ins for PlatformIO's platform `native` and for its build tool, both of which it would download."""

from __future__ import annotations

import json
from pathlib import Path

FILES = {
    "platforms/native/platform.json": '{"name": "native", "version": "1.0.0", "title": "Native", "packages": {}}',
    "platforms/native/platform.py": (
        "from platformio.public import PlatformBase\n\n\nclass NativePlatform(PlatformBase):\n    pass\n"
    ),
    "platforms/native/builder/main.py": (
        "from SCons.Script import AlwaysBuild, Default, DefaultEnvironment\n"
        "env = DefaultEnvironment()\n"
        "Default(AlwaysBuild(env.Alias('buildprog', env.BuildProgram(), env.VerboseAction('', ''))))\n"
    ),
    "packages/tool-scons/scons.py": "from SCons.Script import main\nmain()\n",
}  # fmt: skip


def settings(core: Path) -> dict[str, str]:
    """Environment variables with which PlatformIO finds both in the new folder `core` and stays off the network."""
    from platformio.dependencies import get_core_dependencies

    scons = {"name": "tool-scons", "version": get_core_dependencies()["tool-scons"].lstrip("~^")}
    origin = {"type": "tool", **scons, "spec": {"owner": "platformio", "name": "tool-scons"}}
    named = {"package.json": json.dumps(scons), ".piopm": json.dumps(origin)}
    for path, text in {**FILES, **{f"packages/tool-scons/{name}": text for name, text in named.items()}}.items():
        (core / path).parent.mkdir(parents=True, exist_ok=True)
        (core / path).write_text(text)
    return {
        "PLATFORMIO_CORE_DIR": str(core), "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
        "PLATFORMIO_SETTING_CHECK_PLATFORMIO_INTERVAL": "9999",
    }
