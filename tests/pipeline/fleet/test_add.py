"""``fleet add`` only adds: another survey of the same name, and other versions of files, are refused; nothing goes."""

from __future__ import annotations

import json
import math
import shutil
import signal
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.fleet.trees import tree_of
from tests.stores import Bucket
from tests.struck import MAIN, Strike, moments, struck
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import StoreConflictError
from vislam2tag.common.files.stored_folder import any_store_at
from vislam2tag.pipeline.fleet.raw_copy import planned_copy

SESSION = "floor_0/LG/2021-12-20T09:14:00"
LATER = "floor_0/LG/2021-12-24T10:00:00"
POSES = f"{SESSION}/poses.csv"
COUNTING = f"import atexit\natexit.register(lambda: print(watch.seen))\n{MAIN}"
MOMENTS = 5


@pytest.fixture(scope="module")
def ward(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("north") / "ward", devices=("LG",), seconds=20.0)


@pytest.fixture(scope="module")
def other_ward(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another survey whose folder, floor and session have the same names."""
    return make_survey(tmp_path_factory.mktemp("south") / "ward", devices=("LG",), seconds=20.0, seed=9)


@pytest.fixture(params=["folder", "s3", "azure"])
def fleet(request: pytest.FixtureRequest, ward: Path, tmp_path: Path) -> Path:
    """A fleet of the one ward."""
    place = tmp_path / "fleet"
    if request.param != "folder":
        bucket: Bucket = request.getfixturevalue(request.param)
        place = Path(bucket.store(f"add/{tmp_path.name}").address)
    assert vislam2tag("fleet", "add", place, ward).returncode == 0
    return place


def named(folder: str, tree: dict[str, str]) -> dict[str, str]:
    """The part of a tree that is in a folder."""
    return {name.removeprefix(f"{folder}/"): sha256 for name, sha256 in tree.items() if name.startswith(f"{folder}/")}


def changes_of(done: CompletedProcess[str]) -> dict[str, list[str]]:
    assert done.returncode == 0, done.stderr
    (changes,) = json.loads(done.stdout)["changes"]
    return {kind: names for kind, names in changes.items() if kind != "survey" and names}


def copied(survey: Path, parent: Path) -> Path:
    return Path(shutil.copytree(survey, parent / "copy" / survey.name))


def test_another_survey_of_the_same_name_is_refused(fleet: Path, ward: Path, other_ward: Path, tmp_path: Path) -> None:
    before = tree_of(fleet, tmp_path / "before")
    error = the_error(vislam2tag("fleet", "add", fleet, other_ward))
    assert f"{other_ward}: " in error
    assert f"of the survey ward in the fleet, which was added from {ward}." in error
    assert "If it is another survey, use --name NAME" in error
    assert tree_of(fleet, tmp_path / "after") == before
    done = vislam2tag("fleet", "add", fleet, other_ward, "--name", "ward-south", "--json")
    assert changes_of(done) == {"added": sorted(bytes_of(other_ward))}
    tree = named("surveys", tree_of(fleet, tmp_path / "both"))
    assert (named("ward", tree), named("ward-south", tree)) == (bytes_of(ward), bytes_of(other_ward))


def test_a_survey_without_a_session_in_common_is_refused(fleet: Path, ward: Path, tmp_path: Path) -> None:
    later = copied(ward, tmp_path)
    (later / SESSION).rename(later / LATER)
    (later / LATER / "wifi.csv").unlink()
    assert "has no session in common with those of the survey ward" in the_error(
        vislam2tag("fleet", "add", fleet, later)
    )


def test_further_sessions_are_added_and_missing_ones_stay(fleet: Path, ward: Path, tmp_path: Path) -> None:
    grown = copied(ward, tmp_path)
    shutil.copytree(grown / SESSION, grown / LATER)
    done = vislam2tag("fleet", "add", fleet, grown, "--json")
    new = sorted(name for name in bytes_of(grown) if name.startswith(LATER))
    assert changes_of(done) == {"added": new, "unchanged": sorted(bytes_of(ward))}
    everything = bytes_of(grown)
    shutil.rmtree(grown / SESSION)
    (grown / "floor_dimensions.csv").unlink()
    done = vislam2tag("fleet", "add", fleet, grown)
    assert done.returncode == 0, done.stderr
    gone = len(everything) - len(bytes_of(grown))
    first = f"ward: files: 0 added, {len(bytes_of(grown))} unchanged, 0 replaced, {gone} left alone"
    assert done.stdout.splitlines()[0] == first
    assert "only in the fleet, not changed: floor_0/LG" in done.stdout
    assert named("surveys/ward", tree_of(fleet, tmp_path / "tree")) == everything


def test_changed_files_are_refused_and_replaced_only_on_request(fleet: Path, ward: Path, tmp_path: Path) -> None:
    changed = copied(ward, tmp_path)
    (changed / POSES).write_text("changed")
    assert f"{POSES} differ from the files of the survey ward" in the_error(vislam2tag("fleet", "add", fleet, changed))
    assert named("surveys/ward", tree_of(fleet, tmp_path / "before")) == bytes_of(ward)
    (changed / f"{SESSION}/wifi.csv").unlink()
    for number in range(2):
        done = vislam2tag("fleet", "add", fleet, changed, "--replace", "--json")
        assert changes_of(done).get("replaced", []) == [POSES][number:]
        assert changes_of(done)["left_alone"] == [f"{SESSION}/wifi.csv"]
    tree = tree_of(fleet, tmp_path / "after")
    assert named("surveys/ward", tree) == bytes_of(ward) | bytes_of(changed)
    former = bytes_of(ward)[POSES]
    assert named("replaced/ward", tree) == {f"{POSES}/{former}.csv": former}


def test_what_was_changed_in_the_fleet_is_never_lost(fleet: Path, ward: Path, tmp_path: Path) -> None:
    """Neither a change to a file of the survey nor a file that only the fleet has."""
    there = any_store_at(fleet / "surveys" / "ward")
    there.put("floor_0/marker_dict.csv", b"corrected in the fleet")
    there.put("corrections.toml", b"")
    assert "floor_0/marker_dict.csv differ" in the_error(vislam2tag("fleet", "add", fleet, ward))
    assert vislam2tag("fleet", "add", fleet, ward, "--replace").returncode == 0
    tree = tree_of(fleet, tmp_path / "tree")
    assert named("surveys/ward", tree).items() >= bytes_of(ward).items()
    assert "surveys/ward/corrections.toml" in tree
    kept = any_store_at(fleet / "replaced" / "ward")
    found = [kept.get(file.name) for file in kept.list()]
    assert [each.data for each in found if each is not None] == [b"corrected in the fleet"]


def test_a_fleet_of_an_earlier_version_is_read_instead_of_its_record(fleet: Path, ward: Path, other_ward: Path) -> None:
    any_store_at(fleet).delete(["sources/ward.json"])
    refused = the_error(vislam2tag("fleet", "add", fleet, other_ward))
    assert "which was added from " in refused
    done = vislam2tag("fleet", "add", fleet, ward, "--json")
    assert changes_of(done) == {"unchanged": sorted(bytes_of(ward))}


def test_two_programs_cannot_fill_one_survey(fleet: Path, ward: Path, other_ward: Path, tmp_path: Path) -> None:
    both = [planned_copy(fleet, survey, "new", replace=False) for survey in (ward, other_ward)]
    both[0].carry_out()
    with pytest.raises(StoreConflictError, match="another program is adding to the survey new; run the same command"):
        both[1].carry_out()
    assert named("surveys/new", tree_of(fleet, tmp_path / "tree")) == bytes_of(ward)


def test_nothing_is_added_if_one_of_several_is_refused(
    fleet: Path, ward: Path, other_ward: Path, tmp_path: Path
) -> None:
    before = tree_of(fleet, tmp_path / "before")
    fresh = copied(ward, tmp_path).rename(tmp_path / "fresh")
    assert "differ from the files" in the_error(vislam2tag("fleet", "add", fleet, fresh, other_ward))
    (tmp_path / "fresh").rename(tmp_path / "copy" / "ward")
    alike = the_error(vislam2tag("fleet", "add", fleet, other_ward, tmp_path / "copy" / "ward"))
    assert alike.endswith("would have the same name in the fleet; add each separately with --name")
    (tmp_path / "empty").mkdir()
    the_error(vislam2tag("fleet", "add", fleet, tmp_path / "empty"))
    assert "give exactly one SURVEY" in the_error(vislam2tag("fleet", "add", fleet, "--name", "x", ward, fresh))
    assert tree_of(fleet, tmp_path / "after") == before


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--replace"]])
@pytest.mark.parametrize("moment", moments(MOMENTS))
def test_killed_and_run_again_it_leaves_what_one_whole_run_leaves(
    ward: Path, other_ward: Path, tmp_path: Path, moment: int, options: list[str]
) -> None:
    def begun(name: str) -> Path:
        place = tmp_path / name
        if options:
            assert vislam2tag("fleet", "add", place, ward).returncode == 0
        return place

    arguments: list[str | Path] = [other_ward, *options]
    whole = begun("whole")
    counted = struck(whole, Strike(0), "fleet", "add", whole, *arguments, main=COUNTING)
    step = math.ceil(int(counted.stdout.splitlines()[-1]) * moment / MOMENTS)
    place = begun("killed")
    done = struck(place, Strike(step), "fleet", "add", place, *arguments)
    assert done.returncode == -signal.SIGKILL, done.stderr
    kept = bytes_of(place)
    if options:
        assert set(bytes_of(ward).values()) <= set(kept.values()), "a raw file is nowhere"
    again = vislam2tag("fleet", "add", place, *arguments)
    assert again.returncode == 0, again.stderr
    assert tree_of(place, tmp_path / "tree") == tree_of(whole, tmp_path / "tree-of-whole")
