"""Records the commit in every wheel and source distribution that is built from a checkout (``pyproject.toml``)."""

from __future__ import annotations

import tempfile
from pathlib import Path
from runpy import run_path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGES = {"sdist": "src/vislam2tag", "wheel": "vislam2tag"}
"""Where the package is in what is built."""


class CommitHook(BuildHookInterface):
    """Adds the file that ``vislam2tag --version`` reads; an unpacked source distribution already has it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, except to an editable installation: git knows the commit of its checkout."""
        commit = run_path(str(Path(self.root, "src/vislam2tag/common/commit.py")))
        name = commit["commit_of_checkout"](Path(self.root))
        if version == "editable" or name is None:
            return
        self.made = tempfile.TemporaryDirectory()
        file = Path(self.made.name) / commit["COMMIT_FILE"]
        file.write_text(f"{name}\n", encoding="utf-8")
        build_data["force_include"][str(file)] = f"{PACKAGES[self.target_name]}/{file.name}"
