"""A change of corrections.toml is undone in a file that others changed meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.site.corrections.conflicts import Conflict, ConflictError, merged
from vislam2tag.site.corrections.edits import AddEntry, Change, RemoveEntry, ReplaceEntry, changed_text, entries_of

START = """# of the winter survey
[[swap_landmarks]]  # on the stairs
ids = ["1", "2"]

# measured again by tape
[[move_landmark]]
id = "4"  # near the lift
x = 1.0
y = 2.0
"""
MINE = '[[exclude_landmark]]\nid = "mine"\n'
THEIRS = '[[exclude_landmark]]\nid = "theirs"\n'


def add(name: str) -> AddEntry:
    return AddEntry(table="exclude_landmark", values={"id": name})


def undone(before: str, after: str, current: str) -> str:
    return merged(after, before, current)


Step = tuple[str, int]
steps = st.lists(st.tuples(st.sampled_from(["add", "replace", "remove", "comment"]), st.integers(0, 50)), max_size=6)


def others_edit(text: str, chosen: Sequence[Step], mine: str) -> str:
    """Edits by others, by page and by text editor, of all entries except ``mine``."""
    for count, (kind, at) in enumerate(chosen):
        name = f"theirs {count}"
        entries = [entry for entry in entries_of(text) if mine not in entry.values.values()]
        if kind == "comment":
            text += f"# {name}\n"
        elif kind == "add" or not entries:
            text = changed_text(text, [add(name)])
        else:
            entry = entries[at % len(entries)]
            text = changed_text(text, [changed_or_removed(kind, entry.table, entry.number, dict(entry.values), name)])
    return text


def changed_or_removed(kind: str, table: str, number: int, values: dict[str, Any], name: str) -> Change:
    if kind == "remove":
        return RemoveEntry(table=table, number=number)
    return ReplaceEntry(table=table, number=number, values=values | {"reason": name})


def content(text: str) -> list[str]:
    """Lines of a text without blank ones, whose number differs after a removal at the end of a file."""
    return [line for line in text.splitlines() if line]


@given(st.sampled_from(["", START, MINE + "\n" + START, START + "\n" + THEIRS]), steps, steps)
def test_a_file_without_my_entry_is_left_whatever_others_changed(
    start: str, earlier: list[Step], later: list[Step]
) -> None:
    before = others_edit(start, earlier, "k")
    after = changed_text(before, [add("k")])
    current = others_edit(after, later, "k")
    assert content(undone(before, after, current)) == content(others_edit(before, later, "k"))


@given(steps, steps, st.integers(0, 50))
def test_a_removed_entry_is_there_again_whatever_others_changed(
    earlier: list[Step], later: list[Step], at: int
) -> None:
    before = others_edit(START, earlier, "k")
    before = (
        before.replace("# measured", '[[exclude_landmark]]\nid = "k"  # fell down\n\n# measured')
        if at % 2
        else (changed_text(before, [add("k")]))
    )
    number = next(entry.number for entry in entries_of(before) if entry.values.get("id") == "k")
    after = changed_text(before, [RemoveEntry(table="exclude_landmark", number=number)])
    current = others_edit(after, later, "k")
    assert sorted(content(undone(before, after, current))) == sorted(content(others_edit(before, later, "k")))


@given(steps, steps)
def test_a_replaced_entry_has_its_values_again_whatever_others_changed(earlier: list[Step], later: list[Step]) -> None:
    before = others_edit(changed_text(START, [add("k")]), earlier, "k")
    number = next(entry.number for entry in entries_of(before) if entry.values.get("id") == "k")
    change = ReplaceEntry(table="exclude_landmark", number=number, values={"id": "k", "reason": "fell down"})
    after = changed_text(before, [change])
    current = others_edit(after, later, "k")
    assert content(undone(before, after, current)) == content(others_edit(before, later, "k"))


@pytest.mark.parametrize("before", ["", "# mine\n", START, START + "\n\n", "\n" + START, THEIRS])
def test_undo_and_redo_alone_give_the_same_bytes(before: str) -> None:
    after = changed_text(before, [add("k")])
    assert undone(before, after, after) == before
    assert undone(after, before, before) == after


@pytest.mark.parametrize("before", ["", "# mine\n", START, THEIRS])
def test_blank_lines_are_as_if_my_entry_had_not_been_there(before: str) -> None:
    after = changed_text(before, [add("k")])
    assert undone(before, after, changed_text(after, [add("o")])) == changed_text(before, [add("o")])


def test_an_entry_that_someone_else_changed_is_a_conflict_with_both_values() -> None:
    after = changed_text(START, [add("mine")])
    current = THEIRS + "\n" + after.replace('"mine"', '"mine"\nfloor = 2')
    with pytest.raises(ConflictError, match="changed in the same place by someone else") as raised:
        undone(START, after, current)
    assert raised.value.conflicts == (Conflict("exclude_landmark", MINE, MINE + "floor = 2\n"),)


def test_an_entry_that_someone_else_removed_is_a_conflict() -> None:
    after = changed_text(START, [add("mine")])
    with pytest.raises(ConflictError) as raised:
        undone(START, after, START + "\n" + THEIRS)
    assert raised.value.conflicts == (Conflict("exclude_landmark", MINE, None),)


def test_an_entry_that_was_moved_in_the_file_is_found() -> None:
    after = changed_text(START, [add("mine")])
    assert undone(START, after, MINE + "\n" + START) == START


def test_what_both_added_is_there_once() -> None:
    assert merged(START, START + "\n" + MINE, START + "\n" + MINE) == START + "\n" + MINE


def test_other_line_ends_are_no_conflict() -> None:
    after = changed_text(START, [add("mine")])
    assert undone(START, after, after.replace("\n", "\r\n")) == START.replace("\n", "\r\n")


def test_a_typed_comment_is_applied_to_what_others_changed() -> None:
    typed = START.replace("by tape", "by total station")
    assert merged(START, typed, START + "\n" + THEIRS) == typed + "\n" + THEIRS
