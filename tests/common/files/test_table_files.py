from __future__ import annotations

import ast
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import polars as pl
import pytest

import vislam2tag
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import (
    parquet_metadata,
    read_csv,
    read_parquet,
    scan_csv,
    scan_parquet,
    write_csv,
    write_parquet,
)

SOURCES = Path(vislam2tag.__file__).parent
ODD_NAMES = ("ds[1]", "b*", "c?", "{d}", "%41", "k=v", "~", "-dash", "a b", "Gebäude", "🏠", "file:", "a\\b")


@pytest.mark.parametrize("name", ODD_NAMES)
def test_a_path_names_one_file_whatever_its_characters(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for number, folder in enumerate(("ds1", "bb", "cc", "d", "A", "other", name)):
        Path(folder).mkdir()
        Path(folder, "t.csv").write_text(f"n\n{number}\n")
    path, csv = Path(name, "t.parquet"), Path(name, "t.csv")
    table = read_csv(csv)
    assert table.rows() == scan_csv(csv, {"n": pl.Int64}).collect().rows() == [(6,)]
    write_parquet(table, Folder.at(Path(name)), "t.parquet", metadata={"who": "us"})
    write_parquet(pl.LazyFrame({"n": [0]}), Folder.at(Path("ds1")), "t.parquet")
    write_csv(table, Folder.at(Path(name)), "again.csv")
    assert read_parquet(path).equals(table)
    assert scan_parquet(path).collect().equals(table)
    assert scan_parquet([path, path]).collect().rows() == [(6,), (6,)]
    assert parquet_metadata(path)["who"] == "us"
    assert sorted(path.name for path in Path(name).iterdir()) == ["again.csv", "t.csv", "t.parquet"]


def test_what_is_no_plain_file_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "pipe", tmp_path / "folder", Path("/dev/zero")):
        for opened in (read_csv, partial(scan_csv, schema={}), read_parquet, scan_parquet, parquet_metadata):
            with pytest.raises(OSError, match="it is not a regular file"):
                opened(path)
    with pytest.raises(FileNotFoundError):
        read_csv(tmp_path / "absent")


def test_a_path_that_is_no_utf_8_is_refused_with_a_printable_name(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"bad\xff.csv")
    path.write_text("n\n1\n")
    with pytest.raises(OSError, match=r"not UTF-8.*bad\\+udcff"):
        read_csv(path)


@pytest.mark.parametrize("content", [b'"', b'a,b\n"', b'a,b\n1,"'])
def test_a_quote_alone_at_the_end_is_an_error_not_a_panic(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    for opened in (lambda: read_csv(path), lambda: read_csv(content), lambda: scan_csv(path, {"a": pl.String})):
        with pytest.raises(pl.exceptions.ComputeError, match="a quote in its last field"):
            opened()
    assert read_csv(content, quote_char=None, has_header=False).height


def calls() -> Iterator[tuple[str, ast.Call, ast.Attribute, set[str]]]:
    """Each call of a method in the package: its place, and the names that a loop takes from a constant there."""
    for path in sorted(SOURCES.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        fixed = {
            node.target.id
            for node in ast.walk(tree)
            if isinstance(node, ast.comprehension) and isinstance(node.target, ast.Name) and is_constant(node.iter)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                yield f"{path.relative_to(SOURCES)}:{node.lineno}", node, node.func, fixed


def is_constant(node: ast.expr, fixed: frozenset[str] | set[str] = frozenset()) -> bool:
    """Whether an expression is made of literals and of constants only."""
    if isinstance(node, ast.Name):
        return node.id.isupper() or node.id in fixed
    if isinstance(node, ast.JoinedStr):
        parts = [part.value for part in node.values if isinstance(part, ast.FormattedValue)]
        return all(is_constant(part, fixed) for part in parts)
    return isinstance(node, ast.Constant)


TO_BUFFERS = ("write_csv", "write_parquet", "write_ipc", "write_ipc_stream")
"""Methods that may write into memory elsewhere, too."""


def test_only_this_module_opens_tables() -> None:
    others = {
        f"{place} {method.attr}"
        for place, call, method, _ in calls()
        if not place.startswith("common/files/table_files.py")
        if (
            isinstance(method.value, ast.Name)
            and method.value.id == "pl"
            and method.attr.startswith(("scan_", "read_"))
        )
        or method.attr.startswith("sink_")
        or (
            method.attr in TO_BUFFERS and call.args and ast.unparse(call.args[0]) not in ("buffer", "file", "self.file")
        )
    }
    assert not others


def test_files_that_others_gave_are_read_where_pipes_and_devices_are_refused() -> None:
    """Files of the package's own are exempt."""
    own = (
        "api.py",
        "common/files/given_files.py",
        "common/commit.py",
        "common/findings.py",
        "cli/commands_studio.py",
        "views/page.py",
        "studio/receiving/server.py",
        "pipeline/positioning/serve.py",
        "site/plans/reader_process.py",
        "estimation/dead_reckoning/gait.py",
    )
    others = {
        f"{place} {ast.unparse(call)}"
        for place, call, method, _ in calls()
        if method.attr in ("read_bytes", "read_text") and not place.startswith(own)
    }
    assert not others


def test_no_pattern_is_made_of_a_path() -> None:
    """Patterns of descriptions of apps are constants of their modules."""
    patterns = {
        f"{place} {ast.unparse(call)}"
        for place, call, method, fixed in calls()
        if method.attr in ("glob", "rglob", "iglob") and call.args and not is_constant(call.args[0], fixed)
        if ast.unparse(call.args[0]) not in ("self.poses.files", "keyframes.files", "f'*{suffix}'")
    }
    assert not patterns
