"""One module writes, renames and deletes files: no other place of the source opens one for writing or removes one.

What a call does is told by its name and its arguments, so that a method of another object with the same name as one of
``pathlib`` may be taken for it; give such a method another name.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "vislam2tag"
THE_MODULE = SOURCE / "common" / "files" / "folder.py"
EXEMPT = {
    "cli/terminal.py": "a second handle of standard error, and a nameless file for what libraries print there",
    "site/plans/reader_process.py": "a second handle of standard output, and /dev/null in its place",
}
"""Files whose writes reach no name on a disk."""
METHODS = {
    *("write_text", "write_bytes", "mkdir", "touch", "unlink", "rmdir", "symlink_to", "hardlink_to"),
    *("chmod", "lchmod", "rmtree", "copyfile", "copytree", "copy2", "copystat", "mkdtemp", "mkstemp", "makedirs"),
    *("removedirs", "renames", "savefig", "write_ipc", "sink_parquet", "sink_csv", "sink_ndjson", "sink_ipc"),
    *("write_excel", "write_delta", "saveas", "write_image", "write_html", "tofile", "savetxt", "savez"),
}
"""Names of methods and functions that write to a path, whatever they are called on."""
OF_OS = {
    "open",
    "remove",
    "rename",
    "replace",
    "link",
    "symlink",
    "mkfifo",
    "mknod",
    "fdopen",
    "utime",
    "unlink",
    "truncate",
}
CLASSES = {
    *("TemporaryDirectory", "NamedTemporaryFile", "TemporaryFile", "SpooledTemporaryFile", "FileHandler"),
    *("RotatingFileHandler", "FileIO"),
}
IN_MEMORY = {"buffer", "file", "stream", "opened", "path", "place"}
"""What a writer of a library may be given: a buffer, or what :class:`Folder` has opened or named."""


def calls(tree: ast.AST) -> Iterator[ast.Call]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def mode_of(call: ast.Call, at: int) -> str:
    """The mode that a file is opened with; ``?`` if it is computed."""
    given = next((word.value for word in call.keywords if word.arg == "mode"), None)
    if given is None and len(call.args) > at:
        given = call.args[at]
    if given is None:
        return "r"
    return str(given.value) if isinstance(given, ast.Constant) else "?"


def writes(call: ast.Call) -> bool:
    """Whether a call may write, rename or remove a file."""
    function = call.func
    if isinstance(function, ast.Name):
        return function.id in CLASSES | {"rmtree", "copyfile"} or (
            function.id == "open" and set(mode_of(call, 1)) & set("wax+?") != set()
        )
    if not isinstance(function, ast.Attribute):
        return False
    name, owner = function.attr, function.value
    owner_name = owner.id if isinstance(owner, ast.Name) else ""
    if owner_name == "os":
        return name in OF_OS | METHODS
    if owner_name in ("shutil", "tempfile"):
        return True
    if name in CLASSES or (name in METHODS and not given_by_folder(call)):
        return True
    if name == "open":
        return set(mode_of(call, 1 if owner_name in ("io", "gzip", "bz2", "lzma") else 0)) & set("wax+") != set()
    if name in ("rename", "replace"):
        of_columns = ast.unparse(owner).startswith("pl.")
        return not of_columns and len(call.args) == 1 and not call.keywords and may_be_path(call.args[0])
    if name in ("save", "write_parquet", "write_csv", "write_ndjson"):
        return bool(call.args) and not given_by_folder(call)
    if name in ("ZipFile", "File", "TarFile"):
        return set(mode_of(call, 1)) & set("wax+") != set() and not given_by_folder(call)
    return False


def may_be_path(argument: ast.expr) -> bool:
    """Whether an argument may be a path: names of columns are constants, mappings or calls that make them."""
    return isinstance(argument, ast.Name | ast.Attribute | ast.BinOp)


def given_by_folder(call: ast.Call) -> bool:
    """Whether what is written to is a buffer, or what the module gave."""
    target = call.args[0] if call.args else None
    name = target.id if isinstance(target, ast.Name) else target.attr if isinstance(target, ast.Attribute) else ""
    return name in IN_MEMORY


def test_no_other_place_writes() -> None:
    found = [
        f"{path.relative_to(SOURCE)}:{call.lineno}: {ast.unparse(call)[:80]}"
        for path in sorted(SOURCE.rglob("*.py"))
        if path != THE_MODULE and path.relative_to(SOURCE).as_posix() not in EXEMPT
        for call in calls(ast.parse(path.read_text()))
        if writes(call)
    ]
    assert found == []


@pytest.mark.parametrize(
    "line",
    [
        'open(path, "w")',
        'path.open("ab", buffering=0)',
        'path.open(mode="x")',
        "os.open(path, flags)",
        'path.write_text("a")',
        "path.unlink(missing_ok=True)",
        "path.rename(target)",
        "path.replace(folder / name)",
        "shutil.rmtree(path)",
        "tempfile.mkdtemp()",
        "TemporaryDirectory()",
        "logging.FileHandler(name)",
        "image.save(folder / name)",
        "figure.savefig(out)",
        "table.write_parquet(target)",
        'zipfile.ZipFile(target, "w")',
        'h5py.File(target, "w")',
    ],
)
def test_a_line_that_writes_is_seen(line: str) -> None:
    assert any(map(writes, calls(ast.parse(line))))


@pytest.mark.parametrize(
    "line",
    [
        "path.open()",
        'path.open("rb")',
        'open(path, encoding="utf-8")',
        'table.rename({"a": "b"})',
        'text.replace("a", "b")',
        'image.save(buffer, "PNG")',
        "replace(record, floor=1)",
        "folder.write(name, text)",
    ],
)
def test_a_line_that_reads_is_let_pass(line: str) -> None:
    assert not any(map(writes, calls(ast.parse(line))))
