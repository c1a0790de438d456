"""A file that gives no more at once than allowed, whatever is asked for.

Archives are looked at as folders; nothing in them writes outside.
"""

from __future__ import annotations

import gzip
import io
import shutil
import struct
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import BoundedFile, folder_of, names_in, zip_heads
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import import_format_of

CONTENT = bytes(range(10))


def bounded(most: int) -> BoundedFile:
    return BoundedFile(io.BytesIO(CONTENT), most, ValueError("too much"))


def test_reads_up_to_the_limit_are_those_of_the_file() -> None:
    file = bounded(10)
    assert (file.read(4), file.tell(), file.read()) == (CONTENT[:4], 4, CONTENT[4:])
    assert file.seekable()
    assert file.seek(-3, io.SEEK_END) == 7
    assert file.read(10) == CONTENT[7:]


@pytest.mark.parametrize("size", [7, -1])
def test_more_than_the_limit_is_refused_asked_for_or_not(size: int) -> None:
    with pytest.raises(ValueError, match="too much"):
        bounded(6).read(size)


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
        assert (folder_of(path, Folder.at(scratch)) / "in" / "a.csv").read_text() == "x"
    assert [str(name) for name in names_in(folder / "in" / "a.csv")] == ["a.csv"]
    assert folder_of(folder / "in" / "a.csv", Folder.at(tmp_path)) == folder / "in"


def test_the_first_bytes_of_tables_in_a_zip(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for name in ("walk/poses.csv", "walk/WIFI.CSV", "walk/film.mp4", "../outside.csv", "walk/z.csv"):
            archive.writestr(name, f"content of {name}")
    with (tmp_path / "a.zip").open("rb") as file:
        heads = zip_heads(file, {".csv"}, 7, 3)
    assert heads == {PurePosixPath(f"walk/{name}"): b"content" for name in ("poses.csv", "WIFI.CSV")}


def test_a_folder_that_holds_only_an_archive_means_the_archive(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "LICENSE").write_text("MIT")
    tar(tmp_path / "data" / "a.tar.xz", "a.csv")
    assert [str(name) for name in names_in(tmp_path / "data")] == ["a.csv"]
    assert (folder_of(tmp_path / "data", Folder.at(tmp_path / "scratch")) / "a.csv").is_file()


def test_nothing_is_written_outside(tmp_path: Path) -> None:
    tar(tmp_path / "a.tar.xz", "../evil", "/tmp/evil", "good")
    folder = folder_of(tmp_path / "a.tar.xz", Folder.at(tmp_path / "scratch"))
    assert [path.name for path in folder.rglob("*")] == ["good"]
    assert not (tmp_path / "scratch" / "evil").exists()


@pytest.mark.parametrize("name", ["a.zip", "a.tar.xz"])
def test_a_damaged_archive_is_told(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"no archive")
    assert list(names_in(tmp_path / name)) == []
    with pytest.raises(DatasetError, match=f"{name}: cannot be unpacked"):
        folder_of(tmp_path / name, Folder.at(tmp_path))


def zip_of(path: Path, content: bytes = b"x" * 100, method: int = zipfile.ZIP_STORED) -> bytearray:
    """A zip of one file; returns its bytes."""
    with zipfile.ZipFile(path, "w", method) as zipped:
        zipped.writestr("a.csv", content)
    return bytearray(path.read_bytes())


def entry_of(data: bytearray) -> int:
    """Where the directory's first entry begins."""
    return data.index(b"PK\x01\x02")


def encrypted(data: bytearray) -> None:
    data[entry_of(data) + 8] |= 1


def packed_by_an_unknown_method(data: bytearray) -> None:
    data[entry_of(data) + 10] = 99


def of_another_content(data: bytearray) -> None:
    data[40] ^= 1


def name_not_utf8(data: bytearray) -> None:
    at = entry_of(data)
    data[at + 9] |= 8
    data[at + 46] = 0xFF


def directory_beyond_the_file(data: bytearray) -> None:
    end = data.index(b"PK\x05\x06")
    data[end + 12 : end + 20] = b"\xfe\xff\xff\x7f\xfe\xff\xff\x7f"


def zip64_entry_far_away(data: bytearray) -> None:
    """The entry says that its place stands in a ZIP64 field, and there is none."""
    at = entry_of(data)
    data[at + 42 : at + 46] = b"\xff\xff\xff\xff"


def zip64_end_that_lies(data: bytearray) -> None:
    """The directory is said to be of 2^62 bytes."""
    end = data.index(b"PK\x05\x06")
    lie = struct.pack("<4sQHHIIQQQQ", b"PK\x06\x06", 44, 45, 45, 0, 0, 1, 1, 1 << 62, 0)
    lie += struct.pack("<4sIQI", b"PK\x06\x07", 0, end, 1)
    data[end:end] = lie
    data[-14:-6] = b"\xff" * 8


@pytest.mark.parametrize(
    ("lie", "said"),
    [
        (encrypted, "it is encrypted"),
        (packed_by_an_unknown_method, "it is packed by method 99"),
        (of_another_content, "Bad CRC-32"),
        (name_not_utf8, "can't decode byte 0xff"),
        (directory_beyond_the_file, ""),
        (zip64_entry_far_away, ""),
        (zip64_end_that_lies, ""),
    ],
)
def test_a_zip_that_lies_is_one_message(tmp_path: Path, lie: Callable[[bytearray], None], said: str) -> None:
    path = tmp_path / "a.zip"
    data = zip_of(path)
    lie(data)
    path.write_bytes(data)
    list(names_in(path))
    with pytest.raises(DatasetError, match=rf"a\.zip: cannot be unpacked \(.*{said}") as caught:
        folder_of(path, Folder.at(tmp_path / "scratch"))
    assert len(str(caught.value).splitlines()) == 1


def test_an_archive_that_cannot_be_listed_is_not_called_unknown(tmp_path: Path) -> None:
    data = zip_of(tmp_path / "a.zip")
    encrypted(data)
    (tmp_path / "a.zip").write_bytes(data)
    with pytest.raises(DatasetError, match="it is encrypted"):
        import_format_of(tmp_path / "a.zip")


def test_a_tar_s_name_that_is_no_utf8_is_told(tmp_path: Path) -> None:
    path = tar(tmp_path / "a.tar.xz", "\udcff.csv")
    with pytest.raises(DatasetError, match="is not UTF-8"):
        folder_of(path, Folder.at(tmp_path / "scratch"))


def test_links_and_devices_in_a_tar_are_left_out(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "a.tar", "w") as archive:
        for number, kind in enumerate((tarfile.CHRTYPE, tarfile.BLKTYPE, tarfile.FIFOTYPE, tarfile.LNKTYPE)):
            member = tarfile.TarInfo(f"{number}.csv")
            member.type, member.linkname = kind, "/etc/passwd"
            archive.addfile(member)
        member = tarfile.TarInfo("link")
        member.type, member.linkname = tarfile.SYMTYPE, str(tmp_path)
        archive.addfile(member)
        inside = tarfile.TarInfo("link/through.csv")
        inside.size = 1
        archive.addfile(inside, io.BytesIO(b"x"))
    folder = folder_of(tmp_path / "a.tar", Folder.at(tmp_path / "scratch"))
    assert [path.relative_to(folder).as_posix() for path in folder.rglob("*.csv")] == ["link/through.csv"]
    assert not (tmp_path / "through.csv").exists()


def test_unpacking_ends_at_its_limit(tmp_path: Path) -> None:
    zip_of(tmp_path / "a.zip", bytes(5_000_000), zipfile.ZIP_DEFLATED)
    with tarfile.open(tmp_path / "a.tar.gz", "w:gz") as archive:
        archive.add(tmp_path / "a.zip", "a.zip")
        member = tarfile.TarInfo("a.csv")
        member.size = 5_000_000
        archive.addfile(member, io.BytesIO(bytes(5_000_000)))
    for name in ("a.zip", "a.tar.gz"):
        with pytest.raises(DatasetError, match=r"unpacks to more than 0\.003 GB; raise --max-unpacked-gb"):
            folder_of(tmp_path / name, Folder.at(tmp_path), 3_000_000)
        unpacked = sum(path.stat().st_size for path in (tmp_path / "unpacked").rglob("*"))
        assert unpacked <= 3_000_000 + (1 << 20)
        shutil.rmtree(tmp_path / "unpacked")


def test_folders_within_folders_have_a_limit(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "deep.zip", "w") as archive:
        archive.writestr("/".join(["d"] * 1500) + "/a.csv", "x")
    with pytest.raises(DatasetError, match="more than 100 folders deep"):
        folder_of(tmp_path / "deep.zip", Folder.at(tmp_path / "scratch"))
    assert not (tmp_path / "scratch").exists()


def test_a_header_of_a_tar_as_long_as_memory_is_refused(tmp_path: Path) -> None:
    """A name of 200 MB, which packs to 200 KB."""
    header = tarfile.TarInfo("././@LongLink")
    header.type, header.size = tarfile.GNUTYPE_LONGNAME, 200_000_000
    with gzip.open(tmp_path / "a.tar.gz", "wb", compresslevel=1) as file:
        file.write(header.tobuf(tarfile.GNU_FORMAT))
        for _ in range(200):
            file.write(bytes(1_000_000))
    with pytest.raises(DatasetError, match="damaged or too long"):
        folder_of(tmp_path / "a.tar.gz", Folder.at(tmp_path / "scratch"))


def test_no_such_path(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no such file or folder"):
        folder_of(tmp_path / "none", Folder.at(tmp_path))
