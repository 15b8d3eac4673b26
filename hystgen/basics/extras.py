"""The extras of this package, and the command that installs one into the running Python."""

from __future__ import annotations

import importlib.util
import json
import shlex
import shutil
import sys
from pathlib import Path

FIT = ("scipy", "numba", "llvmlite", "joblib", "threadpoolctl", "rich")
"""Packages of the extra `fit`, needed for every fit."""

PLOT = ("matplotlib",)
"""Packages of the extra `plot`."""


class MissingExtraError(ImportError):
    """A required extra is not installed; the message gives the command that installs it."""


def require_fit(what: str, plot: bool = False) -> None:
    """Raise MissingExtraError if `what` cannot be done because packages of the extra `fit` are not installed.

    `plot`: the extra `plot` is needed as well, and one command installs both.
    """
    missing = {
        extra: [name for name in packages if importlib.util.find_spec(name) is None]
        for extra, packages in (("fit", FIT), ("plot", PLOT if plot else ()))
    }
    lacking = [extra for extra, packages in missing.items() if packages]
    if lacking:
        packages = ", ".join(name for extra in lacking for name in missing[extra])
        which = "extra" if len(lacking) == 1 else "extras"
        raise MissingExtraError(f"{what} needs {packages}; install the {which} with: {install(','.join(lacking))}")


def install(extra: str) -> str:
    """The command that installs `extra` into this Python, from the checkout or file hystgen came from, if any."""
    pip = shutil.which("pip")
    own = pip is not None and Path(pip).parent == Path(sys.executable).parent
    command = ["pip"] if own else [sys.executable, "-m", "pip"]
    return shlex.join([*command, "install", *_requirement(extra)])


def _requirement(extra: str) -> list[str]:
    """Arguments of pip install."""
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "pyproject.toml").is_file():  # an editable install, or not installed at all
        return ["-e", f"{checkout}[{extra}]"]
    import importlib.metadata
    import urllib.parse
    import urllib.request

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
