"""Azurite, Azure's own server of blobs for tests: where it lies, and ``python3 -m tests.azurite``, which puts it there.

It is an npm package of a fixed version, installed once a machine; tests of ``az://`` are skipped where it is not.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

_VERSION = "3.37.0"
_PLACE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "vislam2tag" / f"azurite-{_VERSION}"
SERVER = _PLACE / "node_modules" / ".bin" / "azurite-blob"


def install() -> None:
    """Install it where it is missing; where there is no npm, say so."""
    if SERVER.exists():
        return
    if shutil.which("npm") is None:
        print("npm is not installed: tests of az:// will be skipped")
        return
    _PLACE.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=_PLACE.parent) as new:
        options = ("--no-save", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel", "error")
        subprocess.run(["npm", "install", "--prefix", new, *options, f"azurite@{_VERSION}"], check=True)
        if not SERVER.exists():
            shutil.rmtree(_PLACE, ignore_errors=True)
            Path(new).rename(_PLACE)
            Path(new).mkdir()  # for its own removal


if __name__ == "__main__":
    install()
