"""Text is a path, and one path where several may stand; what is no plain file is refused, not waited for."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from vislam2tag.common.files.given_files import path_or_none, paths_of, plain, read_bytes, read_json, read_toml_values


def test_a_path_may_be_left_out() -> None:
    assert path_or_none(None) is None
    assert path_or_none("a") == path_or_none(Path("a")) == Path("a")


def test_one_path_or_several() -> None:
    assert paths_of("survey") == paths_of(Path("survey")) == [Path("survey")]
    assert paths_of(("a", Path("b"))) == [Path("a"), Path("b")]


def test_a_plain_file_is_read_also_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"abc")
    (tmp_path / "link").symlink_to("file")
    assert read_bytes(tmp_path / "file") == read_bytes(tmp_path / "link") == b"abc"


def test_pipes_sockets_and_devices_are_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "socket"))
        (tmp_path / "zero").symlink_to("/dev/zero")
        for name in ("pipe", "socket", "zero"):
            with pytest.raises(OSError, match="not a regular file"):
                plain(tmp_path / name)


def test_what_is_missing_or_a_folder_is_told_as_ever(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "absent")
    with pytest.raises(IsADirectoryError):
        read_bytes(tmp_path)


def test_values_nested_too_deep_are_told_as_what_they_are_not(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("[" * 100_000)
    with pytest.raises(ValueError, match="nested too deep"):
        read_json(path)
    path.write_text("a = " + "[" * 100_000)
    with pytest.raises(ValueError, match="nested too deep"):
        read_toml_values(path)
    for key in ("a" + ".a" * 20_000, '"a b"' + " . 'c d'" * 20_000):
        for text in (f"{key} = 1", f"[{key}]", f"x = {{ {key} = 1 }}"):
            path.write_text(text)
            with pytest.raises(ValueError, match="nested too deep"):
                read_toml_values(path)
    path.write_text("a.b.c = [" + "1.5, " * 1000 + "]")
    assert len(read_toml_values(path)["a"]["b"]["c"]) == 1000
