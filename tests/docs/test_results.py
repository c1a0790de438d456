"""Figures of the documentation have one source: ``benchmarks/results``."""

from __future__ import annotations

import argparse
import os
import re
import runpy
import shlex
import sys
from pathlib import Path
from typing import Any, NoReturn

import pytest
from typer.main import get_command

import vislam2tag
from tests.docs.figures import PLACE, RESULTS, ROOT, digest, figures_in, results, stale
from tests.docs.pages import DOCS
from vislam2tag.cli.app import app

COMMANDS = {result["made_by"]: name for name, result in results().items()}
METRES = re.compile(r"\b\d+\.\d+ m\b")
TEMPLATES = sorted(RESULTS.glob("*.md"))


class UnderstoodError(Exception):
    """A program has understood its arguments."""


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_of_a_result_can_run_as_printed(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def parse(parser: argparse.ArgumentParser) -> NoReturn:
        _, unknown = parser.parse_known_args()
        raise UnderstoodError if not unknown else AssertionError(unknown)

    program, *words = shlex.split(command)
    if program == "vislam2tag":
        group: Any = get_command(app)
        assert group.get_command(None, words[0]).make_context(words[0], words[1:])
    elif program == "make":
        assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    elif words[:2] == ["-m", "pytest"]:
        assert all((ROOT / word).is_file() for word in words if word.endswith(".py"))
    else:
        monkeypatch.setattr(os, "environ", dict(os.environ))
        monkeypatch.setattr(sys, "argv", words)
        monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse)
        with pytest.raises(UnderstoodError):
            runpy.run_path(str(ROOT / words[0]), run_name="__main__")


def test_every_result_says_what_made_it_when_and_of_what() -> None:
    for name, result in results().items():
        assert result["figures"], name
        assert result["depends_on"], name
        assert result["data"], name
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", result["date"]), name


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_a_template_states_no_figure_itself_and_shows_the_source_of_each(template: Path) -> None:
    text = template.read_text("utf-8")
    assert METRES.findall(PLACE.sub("", re.sub("`[^`]+`", "", text))) == []
    used, shown = ({place[1] for place in PLACE.finditer(text) if bool(place[2]) == of} for of in (True, False))
    assert used == shown


@pytest.mark.parametrize("page", [ROOT / "README.md", DOCS / "index.md"], ids=lambda path: path.name)
def test_errors_on_front_pages_are_those_of_the_results(page: Path) -> None:
    known = set(re.findall(r"\b\d+\.\d+\b", (DOCS / "results" / "how-good.md").read_text("utf-8")))
    stated = {figure.removesuffix(" m") for figure in METRES.findall(page.read_text("utf-8"))}
    assert stated
    assert stated <= known


def test_figures_are_those_of_the_tables_that_are_printed() -> None:
    printed = (
        "real: 3 walks (metres)\n\n| way | kept | error | error |\n| --- | --- | --- | --- |\n"
        "| a | all | 0.50 / 1.20 | 68 %: 70% |\n| a | some | -0.1 m ± 2 | - |\n\n"
        "Split x\n  model   mean   p95   in 68 %\n ─────\n  knn   7.7   9   62 %\n"
    )
    assert figures_in(printed) == {
        "real": "3",
        "real / a / all / error": "0.50",
        "real / a / all / error (2)": "1.20",
        "real / a / all / error 2": "70",
        "real / a / some / error": "-0.1",
        "real / a / some / error (2)": "2",
        "Split x / knn / mean": "7.7",
        "Split x / knn / p95": "9",
        "Split x / knn / in 68 %": "62",
    }


def test_only_code_outdates_a_figure(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text('"""Old words."""\nX = 1  # old\nraise ValueError("an old message")\n')
    before = digest(tmp_path)
    (tmp_path / "a.py").write_text('"""New words."""\n\nX = 1\nraise ValueError("a new message")\n')
    assert digest(tmp_path) == before
    (tmp_path / "a.py").write_text("X = 2\n")
    assert digest(tmp_path) != before
    assert digest(tmp_path / "gone") == ""


def test_figures_without_a_known_digest_are_listed_as_stale() -> None:
    assert any(line.startswith("diagnosis (") for line in stale())
    assert vislam2tag.__version__ in {result["version"] for result in results().values()}
