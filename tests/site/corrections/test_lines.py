from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.site.corrections.edits import (
    ChangedMeanwhileError,
    add_entries,
    corrections_text,
    remove_added,
    save_text,
)
from vislam2tag.site.corrections.file import read_corrections

LINES = '[[swap_landmarks]]\nids = ["1", "2"]'


@pytest.mark.parametrize(
    "before",
    [
        b"# mine\n[[exclude_landmark]]\nid = 7  # fell down\n",
        b"[[exclude_landmark]]\r\nid = 7",
        b"\xef\xbb\xbf# with a mark\n\n\n",
    ],
)
def test_added_entries_count_and_go_without_a_trace(tmp_path: Path, before: bytes) -> None:
    path = tmp_path / "corrections.toml"
    path.write_bytes(before)
    add_entries(tmp_path, LINES)
    add_entries(tmp_path, LINES.replace("1", "3"))
    assert [entry.ids for entry in read_corrections(tmp_path).swap_landmarks] == [["1", "2"], ["3", "2"]]
    assert path.read_bytes().startswith(before)
    assert remove_added(tmp_path) == 2
    assert path.read_bytes() == before
    assert remove_added(tmp_path) == 0


def test_a_file_that_was_not_there_is_gone_again(tmp_path: Path) -> None:
    add_entries(tmp_path, LINES)
    assert remove_added(tmp_path) == 1
    assert not (tmp_path / "corrections.toml").exists()


def test_entries_that_cannot_be_added_leave_the_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "corrections.toml"
    path.write_text('swap_landmarks = [{ids = ["1", "2"]}]\n')
    with pytest.raises(SurveyError, match="double brackets"):
        add_entries(tmp_path, LINES)
    assert path.read_text() == 'swap_landmarks = [{ids = ["1", "2"]}]\n'


def test_a_text_is_saved_only_where_the_file_is_what_it_was_made_from(tmp_path: Path) -> None:
    first = save_text(tmp_path, LINES, "")
    assert corrections_text(tmp_path) == (LINES, first)
    with pytest.raises(ChangedMeanwhileError, match="changed meanwhile"):
        save_text(tmp_path, "# mine\n", "")
    add_entries(tmp_path, LINES.replace("1", "3"))
    with pytest.raises(ChangedMeanwhileError):
        save_text(tmp_path, "# mine\n", first)
    with pytest.raises(SurveyError, match="not known"):
        save_text(tmp_path, "[[swap]]\n", corrections_text(tmp_path)[1])
    assert save_text(tmp_path, "", corrections_text(tmp_path)[1]) == ""
    assert list(tmp_path.iterdir()) == []


def test_planted_links_are_not_written_through(tmp_path: Path) -> None:
    survey, victim = tmp_path / "survey", tmp_path / "authorized_keys"
    survey.mkdir()
    victim.write_text("precious\n")
    (survey / "corrections.toml.part").symlink_to(victim)
    version = save_text(survey, LINES, "")
    add_entries(survey, LINES.replace("1", "3"))
    assert remove_added(survey) == 1
    assert corrections_text(survey) == (LINES, version)
    (survey / "corrections.toml").unlink()
    (survey / "corrections.toml").symlink_to(victim)
    with pytest.raises(OutputError, match="it is a link"):
        save_text(survey, LINES, hashlib.sha256(b"precious\n").hexdigest())
    assert victim.read_text() == "precious\n"
