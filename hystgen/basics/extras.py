"""How to install an extra of this package into the Python that runs it."""

from __future__ import annotations

import importlib.metadata
import json
import shlex
import shutil
import sys
import urllib.parse
import urllib.request
from pathlib import Path


def install(extra: str) -> str:
    """The command that installs `extra` where hystgen runs: from the checkout or file that it came from, if any."""
    pip = shutil.which("pip")
    own = pip is not None and Path(pip).parent == Path(sys.executable).parent
    command = ["pip"] if own else [sys.executable, "-m", "pip"]
    return shlex.join([*command, "install", *_requirement(extra)])


def _requirement(extra: str) -> list[str]:
    """Arguments of pip install."""
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "pyproject.toml").is_file():  # installed editable, or not installed at all
        return ["-e", f"{checkout}[{extra}]"]
    try:
        text = importlib.metadata.distribution("hystgen").read_text("direct_url.json")
        known = json.loads(text or "{}")
    except (importlib.metadata.PackageNotFoundError, ValueError):
        known = {}
    url = str(known.get("url", ""))
    if url.startswith("file://"):
        return [f"{urllib.request.url2pathname(urllib.parse.urlparse(url).path)}[{extra}]"]
    if "vcs_info" in known:
        revision = known["vcs_info"].get("commit_id", "")
        return [f"hystgen[{extra}] @ {known['vcs_info']['vcs']}+{url}{'@' if revision else ''}{revision}"]
    return [f"hystgen[{extra}]"]
