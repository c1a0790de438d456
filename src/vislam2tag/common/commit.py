"""The commit that the program was built from: recorded in a built package, asked of git in a checkout.

``hatch_build.py`` loads this module by its path, so it imports only what Python itself has.
"""

from __future__ import annotations

from pathlib import Path

COMMIT_FILE = "commit.txt"
"""Beside ``__init__.py`` in a built package; a checkout has none."""


def commit_of_package(package: Path) -> str | None:
    """Return the commit of this package folder; None if neither the build nor git knows it."""
    recorded = package / COMMIT_FILE
    if recorded.is_file():
        return recorded.read_text(encoding="utf-8").strip()
    return commit_of_checkout(package.parents[1])


def commit_of_checkout(folder: Path) -> str | None:
    """Return the short name of the commit, with ``-dirty`` if a tracked file differs; None without git."""
    repository = folder / ".git"
    if not repository.exists():
        return None
    import subprocess

    place = (f"--git-dir={repository}", f"--work-tree={folder}")
    command = ("git", *place, "describe", "--always", "--dirty", "--exclude=*", "--abbrev=10")
    try:
        described = subprocess.run(command, capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL)
    except (OSError, subprocess.CalledProcessError):
        return None
    return described.stdout.strip()
