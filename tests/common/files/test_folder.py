"""Nothing outside a folder is touched, files appear whole, and what killed programs left goes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.files import folder as module
from vislam2tag.common.files.folder import UNFINISHED, Folder, scratch_folder

WRITES: dict[str, Callable[[Folder, str], object]] = {
    "write": lambda folder, name: folder.write(name, "new"),
    "filling": lambda folder, name: _fill(folder, name),
    "appending": lambda folder, name: _append(folder, name),
    "create": lambda folder, name: folder.create(name, b"new"),
    "copy": lambda folder, name: folder.copy(Path(__file__), name),
    "link": lambda folder, name: folder.link(Path(__file__), name),
    "move to": lambda folder, name: folder.move("own.txt", folder, name, replace=True),
    "move from": lambda folder, name: folder.move(name, folder, "moved"),
    "remove": lambda folder, name: folder.remove(name),
    "remove_tree": lambda folder, name: folder.remove_tree(name),
    "without_links": lambda folder, name: folder.without_links(name),
    "make": lambda folder, name: folder.folder(name).make(),
}


def _fill(folder: Folder, name: str) -> None:
    with folder.filling(name) as path:
        path.write_text("new")


def _append(folder: Folder, name: str) -> None:
    with folder.appending(name) as file:
        file.write(b"new")


@pytest.fixture(params=["handles", "paths"])
def attacked(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Folder]:
    """A folder of somebody's, and one with links that lead there; with and without handles of directories."""
    if request.param == "paths":
        monkeypatch.setattr(module, "_HAS_HANDLES", False)
    victim, survey = tmp_path / "victim", tmp_path / "survey"
    victim.mkdir()
    (victim / "keys").write_text("precious")
    survey.mkdir()
    (survey / "own.txt").write_text("own")
    (survey / "link").symlink_to(victim)
    (survey / "keys").symlink_to(victim / "keys")
    (survey / "absent").symlink_to(victim / "absent")
    return victim, Folder.at(survey)


def tree(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("write", WRITES.values(), ids=WRITES.keys())
@pytest.mark.parametrize("name", ["link/keys", "link/new", "keys", "absent", "link"])
def test_no_write_goes_through_a_link(
    attacked: tuple[Path, Folder], write: Callable[[Folder, str], object], name: str
) -> None:
    victim, folder = attacked
    if (refused := write) in (WRITES["create"], WRITES["link"]) and name in ("keys", "absent", "link"):
        with pytest.raises(FileExistsError):
            refused(folder, name)
    else:
        with pytest.raises(OSError, match="it is a link"):
            write(folder, name)
    assert tree(victim) == {"keys": "precious"}
    assert {name for name in folder.names() if (folder / name).is_symlink()} == {"link", "keys", "absent"}


@pytest.mark.parametrize("write", WRITES.values(), ids=WRITES.keys())
def test_no_write_replaces_a_pipe_or_device(tmp_path: Path, write: Callable[[Folder, str], object]) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match=r"a device, pipe or socket|exists"):
        write(Folder(tmp_path), "pipe")
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("name", ["../victim/keys", "/etc/x", "..", "", "a/../../b", "a\0b"])
def test_names_that_lead_outside_are_refused(attacked: tuple[Path, Folder], name: str) -> None:
    victim, folder = attacked
    for write in WRITES.values():
        with pytest.raises(OSError, match="leads out of the folder"):
            write(folder, name)
    assert tree(victim) == {"keys": "precious"}


def test_the_folder_that_the_user_gave_may_be_a_link(attacked: tuple[Path, Folder]) -> None:
    victim, folder = attacked
    Folder.at(folder / "link").write("notes.txt", "new")
    assert tree(victim) == {"keys": "precious", "notes.txt": "new"}


def test_a_removed_tree_does_not_take_along_what_its_links_lead_to(attacked: tuple[Path, Folder]) -> None:
    victim, folder = attacked
    Folder(folder.root.parent).remove_tree("survey")
    assert not folder.path.exists()
    assert tree(victim) == {"keys": "precious"}


@given(st.binary(max_size=300), st.binary(max_size=300))
def test_a_file_holds_what_was_written_last(tmp_path_factory: pytest.TempPathFactory, one: bytes, two: bytes) -> None:
    folder = Folder.at(tmp_path_factory.mktemp("folder"))
    for content in (one, two):
        folder.write("a/b.bin", content)
        assert (folder / "a/b.bin").read_bytes() == content
    assert folder.folder("a").names() == ["b.bin"]


def test_a_failure_leaves_the_file_that_was_there_and_nothing_else(tmp_path: Path) -> None:
    folder = Folder.at(tmp_path)
    folder.write("a.txt", "old")

    def interrupted_writing() -> None:
        with folder.writing("a.txt") as file:
            file.write(b"half")
            raise KeyboardInterrupt

    def interrupted_filling() -> None:
        with folder.filling("a.txt") as path:
            path.write_text("half")
            raise KeyboardInterrupt

    for interrupted in (interrupted_writing, interrupted_filling):
        with pytest.raises(KeyboardInterrupt):
            interrupted()
    assert tree(tmp_path) == {"a.txt": "old"}
    assert folder.names() == ["a.txt"]


LEAVE = """
import os, signal, sys, pathlib
from vislam2tag.common.files.folder import Folder
folder = Folder.at(pathlib.Path(sys.argv[1]))
with folder.filling("b.bin") as path, folder.writing("a.txt") as file:
    path.write_text("half")
    file.write(b"half")
    file.flush()
    print("half", flush=True)
    sys.stdin.read()
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no locks of this kind, and nothing is removed there")
def test_what_a_killed_program_left_goes_and_what_a_living_one_writes_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = tmp_path / ".vislam2tag-notes.part"
    mine.write_text("mine")
    with subprocess.Popen(
        [sys.executable, "-c", LEAVE, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"half\n"
        for _ in range(2):
            monkeypatch.setattr(module, "_swept", set())
            Folder.at(tmp_path).write("c.txt", "whole")
            left = [name for name in Folder.at(tmp_path).names() if UNFINISHED.fullmatch(name)]
            if writer.poll() is None:
                assert len(left) == 2
                writer.send_signal(signal.SIGKILL)
                writer.wait()
    assert left == []
    assert Folder.at(tmp_path).names() == [mine.name, "c.txt"]


def test_scratch_folders_go_with_their_block(tmp_path: Path) -> None:
    with scratch_folder() as scratch, scratch_folder(Folder.at(tmp_path)) as inside:
        scratch.write("a.txt", "a")
        inside.write("b.txt", "b")
        assert inside.path.parent == tmp_path
        inside.move("b.txt", Folder.at(tmp_path), "b.txt")
    assert not scratch.path.exists()
    assert Folder.at(tmp_path).names() == ["b.txt"]
