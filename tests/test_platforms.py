"""Nothing needs what only POSIX systems have, and every file has a name that Windows allows."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import vislam2tag

FORBIDDEN = re.compile(r"(?i:con|prn|aux|nul|com\d|lpt\d)(\..*)?|.*[<>:\"/\\|?*\x00-\x1f].*|.*[. ]")
"""What no file or folder can be called on Windows."""


@pytest.mark.slow
def test_everything_imports_and_the_demonstration_runs_without_posix(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.without_posix", str(tmp_path / "demo")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.splitlines()[-1]) > 300
    made = [path.relative_to(tmp_path) for path in tmp_path.rglob("*")]
    assert len(made) > 50
    assert (tmp_path / "demo" / "scores.json") in tmp_path.glob("demo/*")
    assert not [str(path) for path in made if FORBIDDEN.fullmatch(path.name)]


def test_own_files_have_names_for_every_system() -> None:
    sources = [path.name for path in Path(vislam2tag.__file__).parent.rglob("*") if "__pycache__" not in path.parts]
    assert not [name for name in sources if FORBIDDEN.fullmatch(name)]
