"""A lock is held by one at a time, whoever is killed, and leaves no file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files import lock
from vislam2tag.common.files.lock import only_one

HOLD = """
import sys, pathlib
from vislam2tag.common.files.lock import only_one
with only_one(pathlib.Path(sys.argv[1]), "held"):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_it_is_free_again_when_its_holder_was_killed(tmp_path: Path) -> None:
    file = tmp_path / "lock"
    command = [sys.executable, "-c", HOLD, str(file)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(OutputError, match="wait for it"), only_one(file, "wait for it"):
            pass
        holder.kill()
    assert file.exists(), "killed, it could not tidy"
    with only_one(file, "wait for it"):
        pass
    assert not file.exists()


def test_where_a_held_file_cannot_be_removed_it_goes_afterwards(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unlink = Path.unlink
    refused: list[Path] = []

    def refuse_once(path: Path) -> None:
        if not refused:
            refused.append(path)
            raise PermissionError(13, "used by another process")
        unlink(path)

    monkeypatch.setattr(lock, "_ON_WINDOWS", True)
    with only_one(tmp_path / "lock", "held"):
        monkeypatch.setattr(Path, "unlink", refuse_once)
    assert refused == [tmp_path / "lock"]
    assert not (tmp_path / "lock").exists()


def test_what_cannot_be_locked_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"file: cannot be written or locked"), only_one(tmp_path / "file" / "x", ""):
        pass
