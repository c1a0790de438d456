"""README as a new user follows it: its commands and its Python run one after the other, and its claims are current."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import vislam2tag as package
from tests.cli.command import vislam2tag
from tests.docs.named_tests import ROOT

README = (ROOT / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_readme_is_short_and_has_no_placeholder() -> None:
    assert len(README.splitlines()) <= 120
    assert not re.search(r"<[a-z ]+>|TODO|example\.(?:com|org)", README)


def test_the_wheel_that_it_installs_is_of_this_version() -> None:
    wheels = set(re.findall(r"vislam2tag-(.+?)-py3-none-any\.whl", README))
    assert wheels == {package.__version__}


def test_its_commands_and_its_python_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(line) for block in blocks("sh") for line in block.splitlines()]
    ours = [words for program, *words in commands if program == "vislam2tag"]
    assert [words[0] for words in ours] == ["simulate", "process", "evaluate"]
    for words in ours:
        done = vislam2tag(*words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
    (code,) = blocks("python")
    done_python = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=dict(os.environ), capture_output=True, text=True, check=False
    )
    assert done_python.returncode == 0, done_python.stderr
    assert "rssi_dbm" in done_python.stdout


def test_the_changelog_of_a_release_is_short() -> None:
    _, _, released = (ROOT / "CHANGELOG.md").read_text("utf-8").partition("\n## Unreleased\n")
    releases = re.split(r"\n(?=## )", released)[1:]
    assert {lines[0]: len(lines) for text in releases if len(lines := text.splitlines()) > 60} == {}
