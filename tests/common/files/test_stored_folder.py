"""Folders of this machine that stand for folders in a store: fetched whole, put back whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.stores import Bucket, Fault
from vislam2tag.common.errors import OutputError, StoreConflictError, StoreError, UsageError
from vislam2tag.common.files import stored_folder as module
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.store import Store
from vislam2tag.common.files.stored_folder import (
    MARK,
    folder_at_hand,
    folder_to_add_to,
    folder_to_fill,
    is_safe_name,
    place_for,
    with_addresses,
)


@pytest.fixture
def store(s3: Bucket, request: pytest.FixtureRequest) -> Store:
    return s3.store(f"folders/{request.node.name}")


def fill(store: Store, **files: str) -> None:
    with folder_to_fill(Path(store.address)) as here:
        here.mkdir(exist_ok=True)
        for path in here.iterdir():
            path.unlink()
        for name, text in files.items():
            (here / name).write_text(text)


def content(store: Store) -> dict[str, str]:
    with folder_at_hand(Path(store.address)) as here:
        return {path.name: path.read_text() for path in here.iterdir()}


def test_names_that_would_leave_a_folder_are_not_safe() -> None:
    assert is_safe_name("floor_1/LG/2021-12-20T09:14:00/poses.csv")
    assert not any(map(is_safe_name, ("", "../x", "a/../b", ".hidden/x", "/etc/passwd")))


def test_a_folder_is_replaced_whole_and_only_what_changed_is_put(s3: Bucket, store: Store) -> None:
    fill(store, a="1", b="2", c="3")
    s3.seen()
    fill(store, a="1", b="4")
    folder = store.address.removeprefix("s3:/")
    assert [each for each in s3.seen() if each.startswith("PUT") and "probe" not in each] == [
        f"PUT {folder}/{name}" for name in (MARK, "b", MARK)
    ]
    assert content(store) == {"a": "1", "b": "4"}


def test_after_an_exception_nothing_is_stored_and_its_message_names_the_address(store: Store) -> None:
    def give_up_on(here: Path) -> None:
        (here / "a").write_text("2")
        raise OutputError(f"{here / 'b'}: no")

    fill(store, a="1")
    with pytest.raises(OutputError, match=rf"^{store.address}/b: no"), folder_to_fill(Path(store.address)) as here:
        give_up_on(here)
    assert content(store) == {"a": "1"}
    assert with_addresses(f"see {here / 'a'}") == f"see {store.address}/a"


def test_after_an_exception_what_is_unfinished_is_stored_where_it_is_of_use(store: Store) -> None:
    def be_interrupted(here: Path) -> None:
        here.mkdir()
        (here / "a").write_text("1")
        (here / ".lock").touch()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), folder_to_fill(Path(store.address), unfinished=True) as here:
        be_interrupted(here)
    assert content(store) == {"a": "1"}, "nothing that is hidden"


def test_of_many_folders_only_the_last_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_REMEMBERED", 3)
    places = []
    for number in range(6):
        with place_for(Store(f"s3://bucket/{number}")) as here:
            places.append(here)
    said = [with_addresses(str(place)) for place in places]
    assert said == [*map(str, places[:3]), *(f"s3://bucket/{number}" for number in (3, 4, 5))]


def test_one_that_is_half_written_is_not_read_and_is_made_again(s3: Bucket, store: Store) -> None:
    fill(store, a="1", b="1")
    s3.fail(Fault(f"PUT .*{store.address.removeprefix('s3:/')}/b", "403 AccessDenied"))
    with pytest.raises(StoreError, match="permission is denied"):
        fill(store, a="2", b="2")
    with pytest.raises(StoreError, match=r"is incomplete: .* run the command that makes it again"):
        content(store)
    fill(store, c="3")
    assert content(store) == {"c": "3"}


def test_a_file_that_was_changed_since_is_told(store: Store) -> None:
    fill(store, a="1")
    store.put("more", b"does not matter")
    assert content(store) == {"a": "1", "more": "does not matter"}
    store.put("a", b"2")
    with pytest.raises(StoreError, match="a file was changed"):
        content(store)


def test_of_two_programs_that_write_at_once_one_is_told(store: Store) -> None:
    def write_together() -> None:
        with folder_to_fill(Path(store.address)) as here:
            here.mkdir()
            (here / "a").write_text("mine")
            fill(store, a="theirs")

    with pytest.raises(StoreConflictError, match="another program is writing there; run the same command again"):
        write_together()
    assert content(store) == {"a": "theirs"}


def test_files_are_added_beside_what_is_there(store: Store) -> None:
    store.put("there", b"1")
    with folder_to_add_to(Path(store.address)) as here:
        (here / "sub").mkdir(parents=True)
        (here / "sub" / "new").write_text("2")
    assert sorted(file.name for file in store.list()) == ["sub/new", "there"]


def test_folders_of_this_machine_stay_where_they_are(tmp_path: Path) -> None:
    for stand_in in (folder_at_hand, folder_to_fill, folder_to_add_to):
        with stand_in(tmp_path) as here:
            assert here is tmp_path


def test_nothing_stored_is_told(store: Store) -> None:
    with pytest.raises(UsageError, match=rf"^{store.address}: nothing is stored there"):
        content(store)


def test_files_that_others_put_there_stay_even_after_half_a_write(s3: Bucket, store: Store) -> None:
    fill(store, a="1", **{OWN_FILES: OwnFiles.of(["a", "b"]).text()})
    s3.fail(Fault(f"PUT .*{store.address.removeprefix('s3:/')}/b", "403 AccessDenied"))
    with pytest.raises(StoreError, match="permission is denied"):
        fill(store, a="2", b="2", **{OWN_FILES: OwnFiles.of(["a", "b"]).text()})
    for name in ("notes.txt", "sub/notes.txt"):
        store.put(name, b"mine")
    fill(store, c="3", **{OWN_FILES: OwnFiles.of(["c"]).text()})
    names = {file.name for file in store.list()} - {MARK}
    assert names == {"c", OWN_FILES, "notes.txt", "sub/notes.txt"}
