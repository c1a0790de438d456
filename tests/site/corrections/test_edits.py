from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.site.corrections.edits import (
    AddEntry,
    ChangedMeanwhileError,
    RemoveEntry,
    ReplaceEntry,
    add_entries,
    changed_text,
    corrections_text,
    difference,
    entries_of,
    remove_added,
    save_text,
)
from vislam2tag.site.corrections.file import Corrections, read_corrections

TEXT = """# of the winter survey
[[swap_landmarks]]  # on the stairs
ids = ["1", "2"]
floor = 1

# measured again by tape
[[move_landmark]]
id = "4"  # near the lift
x = 1.0   # +- 2 cm
y = 2.0
from = 2022-01-10T00:00:00
# as told by the caretaker

[[swap_landmarks]]
ids = [
  "7",
  "8",
]
"""


def test_entries_are_told_with_their_lines() -> None:
    assert [(e.table, e.number, e.first_line, e.last_line) for e in entries_of(TEXT)] == [
        ("swap_landmarks", 1, 2, 4),
        ("move_landmark", 1, 7, 11),
        ("swap_landmarks", 2, 14, 18),
    ]
    assert entries_of(TEXT)[2].values == {"ids": ["7", "8"]}
    assert entries_of("") == ()


def test_a_removed_entry_leaves_every_other_line() -> None:
    changed = changed_text(TEXT, [RemoveEntry(table="swap_landmarks", number=1)])
    assert changed == TEXT.replace('[[swap_landmarks]]  # on the stairs\nids = ["1", "2"]\nfloor = 1\n', "")


def test_a_replaced_value_keeps_the_comment_of_its_line() -> None:
    values = {"id": "4", "x": 1.25, "y": 2.0, "from": "2022-01-10T00:00:00", "floor": 1}
    changed = changed_text(TEXT, [ReplaceEntry(table="move_landmark", number=1, values=values)])
    assert "x = 1.25   # +- 2 cm\ny = 2.0\nfrom = 2022-01-10T00:00:00\nfloor = 1\n# as told" in changed
    lines = ["@@ -8,5 +8,6 @@", ' id = "4"  # near the lift', "-x = 1.0   # +- 2 cm", "+x = 1.25   # +- 2 cm"]
    assert difference(TEXT, changed).split("\n")[:4] == lines


def test_values_on_several_lines_and_values_that_go() -> None:
    values = {"ids": ["7", "#9"]}
    changed = changed_text(TEXT, [ReplaceEntry(table="swap_landmarks", number=2, values=values)])
    assert changed.endswith('[[swap_landmarks]]\nids = ["7", "#9"]\n')
    changed = changed_text(TEXT, [ReplaceEntry(table="swap_landmarks", number=1, values={"ids": ["1", "2"]})])
    assert "floor" not in changed


def test_several_changes_mean_the_numbers_of_the_text_before() -> None:
    changes: list[AddEntry | ReplaceEntry | RemoveEntry] = [
        RemoveEntry(table="swap_landmarks", number=1),
        AddEntry(table="exclude_landmark", values={"id": "3", "floor": None}),
        ReplaceEntry(table="swap_landmarks", number=2, values={"ids": ["7", "9"]}),
        AddEntry(table="exclude_session", values={"session": "a", "reason": "dropped"}),
    ]
    changed = changed_text(TEXT, changes)
    assert [entry.values for entry in entries_of(changed) if entry.table != "move_landmark"] == [
        {"ids": ["7", "9"]},
        {"id": "3"},
        {"session": "a", "reason": "dropped"},
    ]
    assert "# of the winter survey" in changed


def test_windows_line_ends_and_a_missing_last_one_stay_usable() -> None:
    text = '[[exclude_landmark]]\r\nid = "7"  # fell\r\nfloor = 1'
    changed = changed_text(text, [ReplaceEntry(table="exclude_landmark", number=1, values={"id": "8", "floor": 2})])
    assert changed == '[[exclude_landmark]]\r\nid = "8"  # fell\nfloor = 2\n'


@pytest.mark.parametrize(
    ("text", "change", "message"),
    [
        (TEXT, RemoveEntry(table="swap_landmarks", number=3), "no .* number 3"),
        (TEXT, AddEntry(table="swap_landmarks", values={"ids": ["1"]}), "number 3, ids"),
        (TEXT, AddEntry(table="swap", values={"ids": ["1", "2"]}), "unknown name"),
        ('exclude_landmark = [{id = "7"}]\n', AddEntry(table="exclude_landmark", values={"id": "8"}), "one by one"),
        ("[[", AddEntry(table="exclude_landmark", values={"id": "8"}), "not a TOML file"),
    ],
)
def test_what_cannot_be_is_refused(text: str, change: AddEntry | RemoveEntry, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        changed_text(text, [change])


def test_text_that_only_looks_like_an_entry() -> None:
    text = '[[exclude_landmark]]\nid = "7"\nreason = """\n[[exclude_landmark]]\nid = "8"\n"""\n'
    with pytest.raises(SurveyError, match="one by one"):
        entries_of(text)


def test_an_entry_of_each_table_can_be_written() -> None:
    samples: dict[str, dict[str, object]] = {
        "exclude_session": {"floor": 1},
        "exclude_span": {"session": "a", "from_s": 1.5, "to_s": 2.5},
        "exclude_landmark": {"id": "7"},
        "swap_landmarks": {"ids": ["1", "2"]},
        "move_landmark": {"id": "1", "x": 1.5, "y": 2.5, "until": "2022-01-10T00:00:00"},
        "move_control_point": {"floor": 1, "id": "0", "x": 1.5, "y": 2.5},
        "shift_clock": {"table": "wifi", "offset_s": -0.5},
        "rename_landmark": {"id": "1", "to": "2"},
        "set_landmark_floor": {"id": "1", "to": 2, "session": "a", "from_s": 1.5},
        "landmark_units": {"floor": 1, "unit": "ft"},
        "turn_landmarks": {"floor": 1, "mirrored": True, "shift_m": [1.0, 2.0]},
        "set_floor": {"session": "a", "to": 2},
        "set_device": {"session": "a", "to": "LG"},
        "drop_repeated_scans": {"device": "LG"},
        "set_tap": {"session": "a", "at_s": 12.5, "x": 1.5, "y": 2.5},
        "ignore_fault": {"kind": "swapped", "landmarks": ["1", "2"], "reason": "known"},
    }
    assert samples.keys() == Corrections.model_fields.keys()
    text = changed_text("", [AddEntry(table=table, values=values) for table, values in samples.items()])
    assert {entry.table: dict(entry.values) for entry in entries_of(text)} == samples


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
    with pytest.raises(ChangedMeanwhileError, match="changed by someone else"):
        save_text(tmp_path, "# mine\n", "")
    add_entries(tmp_path, LINES.replace("1", "3"))
    with pytest.raises(ChangedMeanwhileError):
        save_text(tmp_path, "# mine\n", first)
    with pytest.raises(SurveyError, match="unknown name"):
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
