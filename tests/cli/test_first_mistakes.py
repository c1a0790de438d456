"""What the program answers to first mistakes; all of them use one made survey."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.cli.first_mistakes import MISTAKES, Mistake
from tests.surveys import make_survey


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a survey, its labels, a data set and a model."""
    world = tmp_path_factory.mktemp("first_mistakes")
    make_survey(world / "survey", devices=("LG",))
    for command in (
        ("process", world / "survey", "--out", world / "labels", "--jobs", "1"),
        ("dataset", world / "labels", "--out", world / "set", "--jobs", "1"),
        ("train", world / "set", "--model", "weighted-knn", "--out", world / "m.v2t"),
    ):
        assert vislam2tag(*command).returncode == 0
    return world


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.did)
def test_a_first_mistake_is_answered(
    mistake: Mistake, prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = tmp_path / "world"
    shutil.copytree(prepared, world)
    mistake.before(world)
    monkeypatch.chdir(world)
    done = vislam2tag(*mistake.command.split())
    said = " ".join((done.stdout + done.stderr).split())
    assert mistake.answer in said
    assert done.returncode == mistake.code
    assert "Traceback" not in said


def test_there_are_sixty_and_six_a_step_and_half_were_found_by_trying() -> None:
    assert len(MISTAKES) >= 60
    assert min(Counter(mistake.step for mistake in MISTAKES).values()) >= 6
    assert 2 * sum(mistake.tried for mistake in MISTAKES) >= len(MISTAKES)
    assert len({mistake.did for mistake in MISTAKES}) == len(MISTAKES)
