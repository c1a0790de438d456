"""Archives are looked at as folders; nothing in them writes outside."""

from __future__ import annotations

import io
import tarfile
import zipfile
from pathlib import Path

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.dataset.reading.archives import folder_of, names_in


def tar(path: Path, *names: str) -> Path:
    with tarfile.open(path, "w:xz") as archive:
        for name in names:
            member = tarfile.TarInfo(name)
            member.size = 1
            archive.addfile(member, io.BytesIO(b"x"))
        link = tarfile.TarInfo("link")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        archive.addfile(link)
    return path


def test_folder_file_and_archives_show_the_same_names(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    (folder / "in").mkdir(parents=True)
    (folder / "in" / "a.csv").write_text("x")
    with zipfile.ZipFile(tmp_path / "a.ZIP", "w") as zipped:
        zipped.writestr("in/a.csv", "x")
    for path in (folder, tar(tmp_path / "a.tar.xz", "in/a.csv"), tmp_path / "a.ZIP"):
        assert [str(name) for name in names_in(path)] == ["in/a.csv"]
        scratch = tmp_path / f"scratch-{path.name}"
        assert (folder_of(path, scratch) / "in" / "a.csv").read_text() == "x"
    assert [str(name) for name in names_in(folder / "in" / "a.csv")] == ["a.csv"]
    assert folder_of(folder / "in" / "a.csv", tmp_path) == folder / "in"


def test_a_folder_that_holds_only_an_archive_means_the_archive(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "LICENSE").write_text("MIT")
    tar(tmp_path / "data" / "a.tar.xz", "a.csv")
    assert [str(name) for name in names_in(tmp_path / "data")] == ["a.csv"]
    assert (folder_of(tmp_path / "data", tmp_path / "scratch") / "a.csv").is_file()


def test_nothing_is_written_outside(tmp_path: Path) -> None:
    tar(tmp_path / "a.tar.xz", "../evil", "/tmp/evil", "good")
    folder = folder_of(tmp_path / "a.tar.xz", tmp_path / "scratch")
    assert [path.name for path in folder.rglob("*")] == ["good"]
    assert not (tmp_path / "scratch" / "evil").exists()


@pytest.mark.parametrize("name", ["a.zip", "a.tar.xz"])
def test_a_damaged_archive_is_told(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"no archive")
    assert list(names_in(tmp_path / name)) == []
    with pytest.raises(DatasetError, match=f"{name}: cannot be unpacked"):
        folder_of(tmp_path / name, tmp_path)


def test_no_such_path(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no such file or folder"):
        folder_of(tmp_path / "none", tmp_path)
