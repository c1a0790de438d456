"""Names from files reach the terminal as text; one module prints for all commands."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.surveys import make_survey
from vislam2tag import cli
from vislam2tag.cli.terminal import visible_console

EVIL = "LG\x1b]0;owned\x07\x1b[2J\u202e"


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey whose device is called by escape sequences; one of its sessions cannot be read."""
    root = make_survey(tmp_path_factory.mktemp("evil") / "survey", devices=("LG",), sessions=2, seconds=5.0)
    floor = root / "floor_0"
    (floor / "LG").rename(floor / EVIL)
    (broken, *_) = (floor / EVIL).iterdir()
    for table in broken.iterdir():
        table.write_bytes(b"\x1b[31m\n" * 9)
    return root


@pytest.mark.parametrize("command", ["inspect", "process", "check", "evaluate", "survey-landmarks"])
def test_escape_sequences_in_names_are_not_obeyed(survey: Path, tmp_path: Path, command: str) -> None:
    out = () if command == "inspect" else ("--out", tmp_path / "x.csv", "--jobs", "1")
    done = vislam2tag(command, survey, *out)
    said = done.stdout + done.stderr
    assert r"\u001b]0;owned" in said
    log = tmp_path / "x.csv" / "log.txt"
    said += log.read_text() if log.exists() else ""
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", said)


def test_styles_are_still_obeyed() -> None:
    stream = io.StringIO()
    console = visible_console(file=stream, force_terminal=True, color_system="standard")
    console.print(f"[red]{EVIL}[/]")
    shown = stream.getvalue()
    assert "\x1b[31m" in shown
    assert EVIL not in shown


def test_no_other_module_prints() -> None:
    """``Console`` for annotations is imported below ``TYPE_CHECKING`` alone, four spaces in at the top of a module."""
    for module in sorted(Path(cli.__file__).parent.glob("*.py")):
        text = module.read_text()
        if module.name != "terminal.py":
            assert "typer.echo" not in text, module.name
            assert not re.search(r"\bConsole\(", text), module.name
            assert not re.search(r"(?<![\w.])print\((?!settings_page)", text), module.name
