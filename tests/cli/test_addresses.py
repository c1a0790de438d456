"""Commands whose folders are addresses in object storage: the same as on this machine, and what is refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.stores import Bucket
from tests.surveys import bytes_of, make_survey
from tests.undrawn import undrawn
from vislam2tag.common.files.stored_folder import MARK
from vislam2tag.common.files.table_files import read_parquet
from vislam2tag.site.corrections.edits import add_entries
from vislam2tag.site.corrections.file import CORRECTIONS_FILE

BUCKET = "s3://bucket/cli"


class Folders(NamedTuple):
    """A survey, its labels and a data set of them, as lie on disk; the first two are in the bucket, too."""

    s3: Bucket
    survey: Path
    labels: Path
    dataset: Path


@pytest.fixture(scope="module")
def folders(s3: Bucket, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Folders]:
    root = tmp_path_factory.mktemp("addresses")
    survey = make_survey(root / "survey")
    with undrawn():
        assert vislam2tag("process", survey, "--out", root / "labels", "--jobs", "1").returncode == 0
        made = vislam2tag("dataset", root / "labels", "--survey", survey, "--out", root / "set", "--jobs", "1")
        assert made.returncode == 0, made.stderr
        s3.upload(survey, "cli/survey")
        s3.upload(root / "labels", "cli/labels")
        yield Folders(s3, survey, root / "labels", root / "set")


def stored(folders: Folders, name: str, folder: Path) -> dict[str, str]:
    """What is stored below a name, by path."""
    found = bytes_of(folders.s3.download(f"cli/{name}", folder))
    found.pop(MARK, None)
    return found


def test_a_data_set_of_labels_in_a_bucket(folders: Folders, tmp_path: Path) -> None:
    folders.s3.seen()
    options = ("--survey", f"{BUCKET}/survey", "--jobs", "1")
    done = vislam2tag("dataset", f"{BUCKET}/labels", *options, "--out", f"{BUCKET}/set")
    assert done.returncode == 0, done.stderr
    assert f"page: {BUCKET}/set/" in done.stdout
    assert str(tmp_path.parent) not in done.stdout + done.stderr
    raw = [request for request in folders.s3.seen() if "poses" in request or "/sensors.csv" in request]
    assert not raw, "of the survey only the site is read"
    assert stored(folders, "set", tmp_path) == bytes_of(folders.dataset)


def test_a_data_set_of_a_survey_in_a_bucket(folders: Folders, tmp_path: Path) -> None:
    done = vislam2tag("dataset", f"{BUCKET}/survey", "--out", tmp_path / "set", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    same = vislam2tag("verify", tmp_path / "set", folders.dataset)
    assert same.returncode == 0, same.stdout


def test_check_and_diagnose(folders: Folders, tmp_path: Path) -> None:
    options = ("--device", "LG", "--jobs", "1")
    there = vislam2tag("check", f"{BUCKET}/survey", "--out", f"{BUCKET}/checked", *options)
    assert there.returncode == 0, there.stderr
    assert f"page: {BUCKET}/checked/check.html\nnext: vislam2tag dataset {BUCKET}/survey " in there.stdout
    vislam2tag("check", folders.survey, "--out", tmp_path / "checked", *options)
    assert stored(folders, "checked", tmp_path / "there") == bytes_of(tmp_path / "checked")
    told = [vislam2tag("diagnose", survey, "--json", "--jobs", "1") for survey in (f"{BUCKET}/survey", folders.survey)]
    assert (told[0].returncode, told[0].stdout) == (told[1].returncode, told[1].stdout)


def test_evaluate_and_label(folders: Folders, tmp_path: Path) -> None:
    options = ("--strategy", "local-corrected", "--device", "LG", "--jobs", "1")
    there = vislam2tag("evaluate", f"{BUCKET}/survey", "--out", f"{BUCKET}/evaluated", *options)
    here = vislam2tag("evaluate", folders.survey, "--out", tmp_path / "evaluated", *options)
    assert (there.returncode, here.returncode) == (0, 0), there.stderr
    assert stored(folders, "evaluated", tmp_path / "there") == bytes_of(tmp_path / "evaluated")
    (trajectory, *_) = sorted((folders.labels / "trajectory").glob("*LG*.parquet"))
    read_parquet(trajectory).select("time_ns").head(100).write_csv(tmp_path / "table.csv")
    folders.s3.store("cli").put("table.csv", tmp_path / "table.csv")
    options = ("--clock", "boot", "--unit", "ns", "--session", "LG")
    answers = []
    for table, labels in ((f"{BUCKET}/table.csv", f"{BUCKET}/labels"), (tmp_path / "table.csv", folders.labels)):
        done = vislam2tag("label", table, "--labels", labels, "--out", tmp_path / "labelled.csv", *options)
        assert done.returncode == 0, done.stderr
        answers.append((tmp_path / "labelled.csv").read_bytes())
    assert answers[0] == answers[1]


def test_run_goes_on_with_what_is_stored(folders: Folders, tmp_path: Path) -> None:
    command = ("run", f"{BUCKET}/survey", "--out", f"{BUCKET}/run", "--jobs", "1")
    with undrawn():
        first, again = vislam2tag(*command), vislam2tag(*command)
    assert (first.returncode, again.returncode) == (0, 0), first.stderr + again.stderr
    assert f"page: {BUCKET}/run/index.html" in first.stdout
    assert "unchanged and kept: diagnosis, check, dataset" in again.stdout
    there = stored(folders, "run/labels", tmp_path / "labels")
    assert there == bytes_of(folders.labels)
    assert vislam2tag("verify", f"{BUCKET}/run/dataset", f"{BUCKET}/run/dataset").returncode == 0


def test_corrections_change_in_the_bucket(folders: Folders, tmp_path: Path) -> None:
    store = folders.s3.store("cli/survey")
    mine = b"# mine\n"
    (tmp_path / CORRECTIONS_FILE).write_bytes(mine)
    add_entries(tmp_path, '[[exclude_session]]\nsession = "none"\nreason = "x"')
    store.put(CORRECTIONS_FILE, (tmp_path / CORRECTIONS_FILE).read_bytes())
    done = vislam2tag("diagnose", f"{BUCKET}/survey", "--revert")
    assert f"{BUCKET}/survey/{CORRECTIONS_FILE}: corrections removed" in done.stdout, done.stderr
    found = store.get(CORRECTIONS_FILE)
    store.delete([CORRECTIONS_FILE])
    assert found is not None
    assert found.data == mine


def test_what_reads_a_data_set_and_what_changes_it(folders: Folders, tmp_path: Path) -> None:
    folders.s3.upload(folders.dataset, "cli/read")
    at = f"{BUCKET}/read"
    done = [
        vislam2tag(*command)
        for command in (
            ("train", at, "--model", "weighted-knn", "--out", tmp_path / "model.v2t"),
            ("benchmark", at, "--model", "weighted-knn", "--seeds", "1", "--out", tmp_path / "benchmark"),
            ("radio-maps", at, "--out", f"{BUCKET}/maps", "--most", "1"),
            ("export", at, "--format", "uji", "--out", f"{BUCKET}/export"),
            ("split", at, "--by", "random", "--name", "second"),
            ("verify", folders.dataset, at),
        )
    ]
    assert [each.returncode for each in done] == [0, 0, 0, 0, 0, 1], [each.stderr for each in done]
    folders.s3.store("cli").put("model.v2t", tmp_path / "model.v2t")
    located = vislam2tag("locate", f"{BUCKET}/model.v2t", at, "--out", tmp_path / "there.csv")
    assert located.returncode == 0, located.stderr
    vislam2tag("locate", tmp_path / "model.v2t", folders.dataset, "--out", tmp_path / "here.csv")
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()
    assert vislam2tag("radio-maps", folders.dataset, "--out", tmp_path / "maps", "--most", "1").returncode == 0
    assert stored(folders, "maps", tmp_path / "there") == bytes_of(tmp_path / "maps")
    mine = shutil.copytree(folders.dataset, tmp_path / "set")
    vislam2tag("split", mine, "--by", "random", "--name", "second")
    assert stored(folders, "read", tmp_path / "read") == bytes_of(mine)


def test_in_azure_it_is_as_in_s3(folders: Folders, azure: Bucket, tmp_path: Path) -> None:
    at = f"{azure.address}/cli"
    azure.upload(folders.survey, "cli/survey")
    azure.upload(folders.labels, "cli/labels")
    shown = [vislam2tag("inspect", survey, "--json").stdout for survey in (f"{at}/survey", folders.survey)]
    assert shown[0].replace(f"{at}/survey", str(folders.survey)) == shown[1]
    made = vislam2tag("dataset", f"{at}/labels", "--survey", f"{at}/survey", "--jobs", "1", "--out", f"{at}/set")
    assert made.returncode == 0, made.stderr
    assert bytes_of(azure.download("cli/set", tmp_path / "set")).items() >= bytes_of(folders.dataset).items()
    added = vislam2tag("fleet", "add", f"{at}/fleet", f"{at}/survey", "--json")
    assert added.returncode == 0, added.stderr
    totals = {name: value for name, value in json.loads(added.stdout).items() if name != "changes"}
    assert totals == json.loads(vislam2tag("fleet", "status", f"{at}/fleet", "--json").stdout)
    nowhere = vislam2tag("fleet", "status", "az://nowhere/fleet")
    assert "the bucket does not exist: create it, or correct its name" in the_error(nowhere)


def test_what_no_command_of_ours_wrote_is_not_replaced(folders: Folders) -> None:
    folders.s3.store("cli/mine").put("notes.txt", b"mine")
    done = vislam2tag("dataset", f"{BUCKET}/labels", "--out", f"{BUCKET}/mine", "--jobs", "1")
    assert f"{BUCKET}/mine: is not empty and was not made by this command" in the_error(done)
    assert [file.name for file in folders.s3.store("cli/mine").list()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("run", f"{BUCKET}/survey", "--out", "x", "--landmarks", f"{BUCKET}/x"),
            "run` needs a local path; copy it to",
        ),
        (("site", "show", f"{BUCKET}/survey"), "`vislam2tag site show` needs a local path"),
        (
            ("dataset", f"{BUCKET}/labels", "--out", "out", "--labels", f"{BUCKET}/x"),
            f"{BUCKET}/x: `vislam2tag dataset",
        ),
        (("dataset", f"{BUCKET}/nothing", "--out", "out"), f"{BUCKET}/nothing: nothing is stored there"),
        (
            ("train", f"{BUCKET}/nothing", "--model", "weighted-knn", "--out", "x"),
            f"{BUCKET}/nothing: nothing is stored there",
        ),
        (("train", f"{BUCKET}/labels", "--model", "weighted-knn", "--out", "x"), f"{BUCKET}/labels: not a data set"),
    ],
)
def test_addresses_that_cannot_be_used_are_told(folders: Folders, arguments: tuple[str, ...], said: str) -> None:
    assert said in the_error(vislam2tag(*arguments))
