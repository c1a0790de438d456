"""The output folder: whole files, one run at a time, nothing foreign touched."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.output import columns_name


def result(slug: str) -> str:
    return SessionResult(
        slug=slug, fingerprint="f", floor=1, device="d", session="s", format="published", strategy="local", version="1"
    ).model_dump_json()


def names(folder: Path) -> set[str]:
    """Paths below a folder, but for its record of own files."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*")} - {OWN_FILES}


def test_a_new_folder_is_made_and_only_whole_files_stay(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with claim(out, {"settings": {}}) as folder:
        folder.put_text("sessions/a.json", result("a"))
        assert folder.result("a") is not None
        assert folder.result("b") is None
    assert names(out) == {"run.json", "sessions", "sessions/a.json"}


def test_a_failing_writer_leaves_the_old_file(tmp_path: Path) -> None:
    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with claim(tmp_path / "out", {}) as folder:
        folder.put_text("sessions/a.json", "old")
        with pytest.raises(OutputError, match=r"a\.json: cannot be written \(No space left on device\); free space"):
            folder.write("sessions/a.json", fail)
        assert (tmp_path / "out/sessions/a.json").read_text() == "old"
    assert names(tmp_path / "out") == {"run.json", "sessions", "sessions/a.json"}


def test_a_foreign_folder_is_refused_and_untouched(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="vislam2tag did not create it"), claim(tmp_path, {}):
        pass
    (tmp_path / "run.json").write_text("[1]")
    with pytest.raises(OutputError, match="vislam2tag did not create it"), claim(tmp_path, {}):
        pass
    assert names(tmp_path) == {"thesis.txt", "run.json"}


@pytest.mark.parametrize(
    ("made_by", "opened_by", "named"),
    [
        ("vislam2tag evaluate", "vislam2tag", "vislam2tag evaluate"),
        ("vislam2tag", "vislam2tag evaluate", "vislam2tag process"),
    ],
)
def test_what_another_command_wrote_is_refused_by_its_name(
    tmp_path: Path, made_by: str, opened_by: str, named: str
) -> None:
    with claim(tmp_path / "out", {}, made_by):
        pass
    with pytest.raises(OutputError, match=f"contains files of `{named}`"), claim(tmp_path / "out", {}, opened_by):
        pass
    assert names(tmp_path / "out") == {"run.json"}


@pytest.mark.parametrize(
    ("file", "record"),
    [("run.json", '{"program": "vislam2tag evaluate"}'), ("dataset.json", '{"made_by": "import"}')],
)
def test_what_another_command_wrote_goes_when_told(tmp_path: Path, file: str, record: str) -> None:
    own = OwnFiles.of([file, "figures/errors.svg", "labels/.vislam2tag-files"], ["wifi"], ["floor_0_a"])
    nested = OwnFiles.of(["run.json"])
    ours = {file: record, "figures/errors.svg": "<svg/>", "wifi/floor_0_a.parquet": "", "labels/run.json": ""}
    users = ("notes.txt", "figures/mine.svg", "wifi/floor_0_mine.parquet", "old/run.json", "labels/notes.txt")
    for name, text in {**ours, **dict.fromkeys(users, "mine")}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / OWN_FILES).write_text(own.text())
    for folder in ("labels", "old"):
        (tmp_path / folder / OWN_FILES).write_text(nested.text())
    before = names(tmp_path)
    with (
        pytest.raises(OutputError, match=r"contains the output of `vislam2tag .*; pass --replace"),
        claim(tmp_path, {}, replace=False),
    ):
        pass
    assert names(tmp_path) == before
    with claim(tmp_path, {}, replace=True):
        pass
    assert {name for name in names(tmp_path) if (tmp_path / name).is_file()} == {
        *users,
        "run.json",
        "old/.vislam2tag-files",
    }
    assert OwnFiles.read(tmp_path) == OwnFiles.of(["run.json", "log.txt"])


def test_an_output_without_a_record_of_its_files_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"program": "vislam2tag"}')
    (tmp_path / "notes.txt").write_text("mine")
    for replace in (False, True):
        with (
            pytest.raises(
                OutputError, match="was written by an earlier version, which did not store a list of its files"
            ),
            claim(tmp_path, {}, replace=replace),
        ):
            pass
    assert names(tmp_path) == {"run.json", "notes.txt"}


def test_what_was_killed_before_it_wrote_goes_on_beside_files_of_the_user(tmp_path: Path) -> None:
    (tmp_path / OWN_FILES).write_text(OwnFiles.of(["run.json"]).text())
    (tmp_path / "notes.txt").write_text("mine")
    with claim(tmp_path, {}):
        pass
    assert names(tmp_path) == {"run.json", "notes.txt"}


def test_output_of_a_command_without_a_run_record_is_refused(tmp_path: Path) -> None:
    with whole_folder(tmp_path / "plan", lambda _: True) as folder:
        folder.write("landmarks.csv", "id,floor,x,y\n")
    with pytest.raises(OutputError, match="not empty and vislam2tag did not create it"), claim(tmp_path / "plan", {}):
        pass
    assert names(tmp_path / "plan") == {"landmarks.csv"}


def test_a_file_of_the_users_with_the_name_of_a_page_stays(tmp_path: Path) -> None:
    with claim(tmp_path / "out", {}):
        pass
    (tmp_path / "out" / "conflicts.html").write_text("mine")
    with claim(tmp_path / "out", {}):
        pass
    assert names(tmp_path / "out") == {"run.json", "conflicts.html"}


@pytest.mark.parametrize("record", ["", '{"program": "another"}', '{"program": "vislam2tagger"}', "[]"])
def test_what_is_not_ours_stays_whatever_is_told(tmp_path: Path, record: str) -> None:
    (tmp_path / "run.json").write_text(record)
    (tmp_path / "dataset.json").write_text(record)
    with pytest.raises(OutputError, match="and vislam2tag did not create it"), claim(tmp_path, {}, replace=True):
        pass
    assert names(tmp_path) == {"run.json", "dataset.json"}


def test_a_survey_stays_whatever_is_told(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"program": "vislam2tag evaluate"}')
    (tmp_path / "floor_1" / "LG" / "first").mkdir(parents=True)
    with pytest.raises(OutputError, match="contains the floor folders of a survey"), claim(tmp_path, {}, replace=True):
        pass
    assert (tmp_path / "floor_1" / "LG" / "first").is_dir()


def test_a_file_or_a_place_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "out"):
        with pytest.raises(OutputError, match="cannot be used as the output folder"), claim(place, {}):
            pass


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_an_unwritable_folder_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match=r"cannot be (written|used as the output folder)"), claim(tmp_path, {}):
        pass
    tmp_path.chmod(0o700)


def test_two_runs_at_once_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with claim(out, {}), pytest.raises(OutputError, match="another run"), claim(out, {}):
        pass
    with claim(out, {}):
        pass


def test_sessions_that_are_not_to_be_kept_go_by_the_record(tmp_path: Path) -> None:
    out = tmp_path / "out"
    own = OwnFiles.of(["wifi/floor_1.d.parquet"], ["sessions", "wifi"], ["floor_1.a", "floor_1.b", "floor_1.c"])
    with claim(out, {}, own=own) as folder:
        for slug in ("floor_1.a", "floor_1.b", "floor_1.d", "floor_1.mine"):
            folder.put_text(f"sessions/{slug}.json", result(slug))
            folder.put_text(f"wifi/{slug}.parquet", "")
        (out / "backup").mkdir()
        (out / "backup" / "floor_1.b.parquet").write_text("mine")
        assert folder.drop(lambda slug: slug == "floor_1.a") == ["floor_1.b", "floor_1.d"]
        assert folder.own().stems == ("floor_1.a",)
        assert folder.drop(lambda slug: slug == "floor_1.a") == []
    kept = {f"{name}/{slug}" for slug in ("floor_1.a", "floor_1.mine") for name in ("sessions", "wifi")}
    kept = {f"{name}.{'json' if name.startswith('sessions') else 'parquet'}" for name in kept}
    # What no record names is the user's, whatever it is called.
    users = {"sessions/floor_1.d.json", "backup", "backup/floor_1.b.parquet"}
    assert names(out) == {"run.json", "sessions", "wifi", *kept, *users}


def test_how_columns_were_read_goes_with_the_session(tmp_path: Path) -> None:
    slugs = ["floor_1.a", "floor_1.b"]
    files = [columns_name(slug) for slug in slugs]
    with claim(tmp_path / "out", {}, own=OwnFiles.of(files, ["sessions", "columns"], slugs)) as folder:
        for slug in slugs:
            folder.put_text(f"sessions/{slug}.json", result(slug))
            folder.put_text(columns_name(slug), "[poses]\n")
        folder.drop(lambda slug: slug == "floor_1.a")
        assert (folder.has(files[0]), folder.has(files[1])) == (True, False)
        assert files[1] not in folder.own().files
        folder.forget("floor_1.a")
        assert not folder.has(files[0])


def test_what_an_interrupted_run_was_writing_goes(tmp_path: Path) -> None:
    def interrupted(partial: Path) -> None:
        partial.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), claim(tmp_path / "out", {}) as folder:
        folder.write("wifi/a.parquet", interrupted)
    assert names(tmp_path / "out") == {"run.json", "wifi"}


def test_a_done_mark_that_is_no_file_is_no_result(tmp_path: Path) -> None:
    with claim(tmp_path / "out", {}) as folder:
        (tmp_path / "out/sessions/a.json").mkdir(parents=True)
        assert folder.result("a") is None
        with pytest.raises(OutputError, match=r"a\.json: cannot be removed"):
            folder.forget("a")


def test_leftovers_of_a_killed_run_are_cleared(tmp_path: Path) -> None:
    left = tmp_path / "out/.vislam2tag-0123456789abcdef.part"
    left.mkdir(parents=True)
    (left / "a.parquet").write_text("half")
    with claim(tmp_path / "out", {}):
        pass
    assert names(tmp_path / "out") == {"run.json"}
