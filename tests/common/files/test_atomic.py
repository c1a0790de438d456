"""A lock is held by one at a time, whoever is killed, and leaves no file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files import atomic
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import Folder

HOLD = """
import sys, pathlib
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.atomic import only_one
with only_one(Folder.at(pathlib.Path(sys.argv[1])), "lock", "held"):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_it_is_free_again_when_its_holder_was_killed(tmp_path: Path) -> None:
    file = tmp_path / "lock"
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(OutputError, match="wait for it"), only_one(Folder.at(tmp_path), "lock", "wait for it"):
            pass
        holder.kill()
    assert file.exists(), "killed, it could not tidy"
    with only_one(Folder.at(tmp_path), "lock", "wait for it"):
        pass
    assert not file.exists()


def test_a_held_file_that_cannot_be_removed_goes_afterwards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remove = Folder.remove
    refused: list[str] = []

    def refuse_once(folder: Folder, name: str) -> None:
        if not refused:
            refused.append(name)
            raise PermissionError(13, "used by another process")
        remove(folder, name)

    monkeypatch.setattr(atomic, "_ON_WINDOWS", True)
    with only_one(Folder.at(tmp_path), "lock", "held"):
        monkeypatch.setattr(Folder, "remove", refuse_once)
    assert refused == ["lock"]
    assert not (tmp_path / "lock").exists()


def test_a_folder_that_cannot_be_locked_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused = pytest.raises(OutputError, match=r"file: cannot be written or locked")
    with refused, only_one(Folder.at(tmp_path / "file"), "x", ""):
        pass


def test_a_lock_is_not_taken_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "victim").write_text("precious")
    (tmp_path / "lock").symlink_to(tmp_path / "victim")
    with pytest.raises(OutputError, match="it is a link"), only_one(Folder.at(tmp_path), "lock", "held"):
        pass
    assert (tmp_path / "victim").read_text() == "precious"
