"""Replaces a folder again and again, killed at one step later each time: run by ``test_whole_output``.

    python -m tests.common.killed_writer FOLDER exchange|rename

A step is anything that Python tells its audit hooks: opening, making, renaming, listing and removing files. Prints the
number of steps at which it was killed. Raises AssertionError where the folder was not whole after one of them.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from vislam2tag.common.files import atomic as module
from vislam2tag.common.files.whole_output import restore, whole_folder

FILES = 3


def write(target: Path, text: str) -> None:
    """Write the folder as a command does."""
    with whole_folder(target, lambda folder: (folder / "0.txt").is_file()) as folder:
        for number in range(FILES):
            folder.write(f"{number}.txt", text)


def killed(target: Path, step: int) -> bool:
    """Write in a process that ends just before this step; False where it came to its end before."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    count = 0

    def hook(event: str, _arguments: tuple[object, ...]) -> None:
        nonlocal count
        count += event.startswith(("os.", "open", "shutil.", "fcntl.", "ctypes."))
        if count == step:
            os._exit(9)

    sys.addaudithook(hook)
    write(target, "new")
    os._exit(0)


def texts(target: Path) -> list[str]:
    """The content of our files in the folder; empty if there is no folder."""
    return [path.read_text() for path in sorted(target.glob("[0-9].txt"))]


def main(target: Path, how: str) -> None:
    """Kill at every step in turn; what is there is then whole, and the next command leaves nothing but its own."""
    if how == "rename":
        module._EXCHANGES.clear()
    write(target, "old")
    (target / "own").mkdir()
    (target / "own" / "notes.txt").write_text("mine")
    step, gone = 1, 0
    while killed(target, step):
        gone += not target.exists()
        restore(target)
        assert texts(target) in (["old"] * FILES, ["new"] * FILES), (step, texts(target))
        write(target, "old")
        assert (target / "own" / "notes.txt").read_text() == "mine", step
        assert len([path for path in target.rglob("*") if path.is_file()]) == FILES + 2, step
        assert {path.name for path in target.parent.iterdir()} == {target.name}, step
        step += 1
    assert texts(target) == ["new"] * FILES
    print(step - 1, gone)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
