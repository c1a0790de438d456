"""Files and folders appear whole, and leave nothing where they cannot.

A folder is there whole whenever its writer is killed; of two writers the second is refused.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files import atomic as module
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.whole_output import file_to_write, restore, whole_folder, work_folder_of, write_file


def test_a_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with file_to_write(target) as file:
        file.write(b"new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_block_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")

    def interrupted() -> None:
        with file_to_write(target) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_places_that_cannot_be_written_are_reported(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    for target in (tmp_path / "absent" / "a.txt", tmp_path / "folder"):
        with pytest.raises(OutputError, match="cannot be written"):
            write_file(target, "new")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_a_link_that_the_user_named_is_followed(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "a.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "disk" / "a.txt")
    write_file(tmp_path / "link.txt", "new")
    assert (tmp_path / "disk" / "a.txt").read_text() == "new"
    assert (tmp_path / "link.txt").is_symlink()


def ours(folder: Path) -> bool:
    return (folder / "a.txt").is_file()


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {OWN_FILES}


def write(target: Path, text: str = "new") -> None:
    with whole_folder(target, ours) as folder:
        folder.write("a.txt", text)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["exchange", "rename"])
def test_killed_at_any_step_the_folder_is_whole_and_the_next_command_tidies(tmp_path: Path, how: str) -> None:
    command = [sys.executable, "-m", "tests.common.killed_writer", str(tmp_path / "out"), how]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    steps, gone = map(int, done.stdout.split())
    assert steps > 20
    assert (gone > 0) == (how == "rename"), "kills that left nothing in its place until the next command"


def test_it_appears_whole_and_replaces_only_its_own(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    write(out, "first")
    with whole_folder(out, ours) as folder:
        folder.write("a.txt", "second")
        folder.write("b.txt", "second")
        assert (out / "a.txt").read_text() == "first"
    assert names(out) == {"a.txt", "b.txt"}
    assert names(out.parent) == {"out"}
    with pytest.raises(OutputError, match="not made by this command"), whole_folder(out, lambda _: False):
        pass
    assert names(out) == {"a.txt", "b.txt"}
    assert names(out.parent) == {"out"}


def test_a_failure_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "out", "old")
    with pytest.raises(ZeroDivisionError), whole_folder(tmp_path / "out", ours):
        raise ZeroDivisionError
    full = pytest.raises(OutputError, match=r"out: cannot be written \(No space left on device\)")
    with full, whole_folder(tmp_path / "out", ours):
        raise OSError(28, "No space left on device")

    move = Folder.move

    def refuse(folder: Folder, name: str, to: Folder, new_name: str) -> None:
        if name == "new":
            raise PermissionError(13, "Permission denied")
        move(folder, name, to, new_name)

    monkeypatch.setattr(module, "_EXCHANGES", {})
    monkeypatch.setattr(Folder, "move", refuse)
    with pytest.raises(OutputError, match=r"out: cannot be written \(Permission denied\)"):
        write(tmp_path / "out")
    assert (tmp_path / "out" / "a.txt").read_text() == "old"
    assert names(tmp_path) == {"out"}


def test_a_second_command_is_refused_and_disturbs_nothing(tmp_path: Path) -> None:
    with whole_folder(tmp_path / "out", ours) as folder:
        folder.write("a.txt", "first")
        with pytest.raises(OutputError, match="out: another command is writing there"):
            write(tmp_path / "out", "second")
        restore(tmp_path / "out")
        write(tmp_path / "other", "third")
    assert (tmp_path / "out" / "a.txt").read_text() == "first"
    assert names(tmp_path) == {"out", "other"}


def test_what_another_command_put_there_meanwhile_stays(tmp_path: Path) -> None:
    refused = pytest.raises(OutputError, match="not made by this command")
    with refused, whole_folder(tmp_path / "out", ours):
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "thesis.txt").write_text("theirs")
    assert names(tmp_path / "out") == {"thesis.txt"}


@pytest.mark.parametrize("how", ["exchange", "rename"])
def test_half_of_an_old_folder_is_never_restored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    if how == "rename":
        monkeypatch.setattr(module, "_EXCHANGES", {})
    work = work_folder_of(tmp_path / "out")
    for name in ("old", "new", "replaced"):
        (work / name).mkdir(parents=True)
        (work / name / "a.txt").write_text(name)
    restore(tmp_path / "out")
    assert (tmp_path / "out" / "a.txt").read_text() == "old"
    assert names(tmp_path) == {"out"}
    (tmp_path / "out" / OWN_FILES).write_text(OwnFiles.of(["a.txt"]).text())
    (work / "old").mkdir(parents=True)
    write(tmp_path / "out")
    assert (tmp_path / "out" / "a.txt").read_text() == "new"
    assert names(tmp_path) == {"out"}


def test_a_link_stays_a_link_and_the_own_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "disk" / "out")
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "out")
    write(tmp_path / "link", "through the link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "disk" / "out" / "a.txt").read_text() == "through the link"
    assert names(tmp_path) == {"disk", "link"}
    monkeypatch.chdir(tmp_path / "disk" / "out")
    with pytest.raises(OutputError, match="is the current folder"):
        write(Path())


def test_a_file_in_its_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="is a file"):
        write(tmp_path / "out")
    with pytest.raises(OutputError, match="cannot be created"):
        write(tmp_path / "out" / "below")
    assert names(tmp_path) == {"out"}


def test_files_of_the_user_are_kept_and_those_of_the_command_replaced(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, ours) as folder:
        for name in ("a.txt", "sub/first.txt"):
            folder.write(name, "first")
    (out / "notes.txt").write_text("mine")
    (out / "sub" / "mine.txt").write_text("mine")
    (out / "sub" / "link").symlink_to(tmp_path)
    for _ in range(2):
        write(out, "second")
        assert names(out) == {"a.txt", "notes.txt", "sub"}
        assert names(out / "sub") == {"mine.txt", "link"}
        assert (out / "sub" / "link").is_symlink()
        assert (out / "a.txt").read_text() == "second"
        assert OwnFiles.read(out) == OwnFiles.of(["a.txt"])


def test_a_file_of_the_user_is_not_replaced_by_one_of_the_command(tmp_path: Path) -> None:
    out = tmp_path / "out"
    write(out, "first")
    (out / "b.txt").write_text("mine")

    def replace_both() -> None:
        with whole_folder(out, ours) as folder:
            folder.write("a.txt", "second")
            folder.write("b.txt", "second")

    with pytest.raises(OutputError, match=r"b.txt: was not written by this command"):
        replace_both()
    assert ((out / "a.txt").read_text(), (out / "b.txt").read_text()) == ("first", "mine")


def test_a_folder_without_a_record_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.txt").write_text("of 0.2")
    with pytest.raises(OutputError, match="did not store a list of its files"):
        write(tmp_path / "out")
    assert (tmp_path / "out" / "a.txt").read_text() == "of 0.2"


def test_a_planted_work_folder_that_leads_elsewhere_is_refused(tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    (victim / "photos").mkdir(parents=True)
    (tmp_path / ".out.vislam2tag").symlink_to(victim)
    with pytest.raises(OutputError, match="it is a link"):
        write(tmp_path / "out")
    assert names(victim) == {"photos"}
