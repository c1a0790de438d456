"""Every command with an output: repeated, killed and run in parts, it leaves what one run does, and all of the user's.

The whole tree is compared, hidden files and the user's own included.
"""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.cli.command import vislam2tag
from tests.outputs import CASES, EXEMPT, READ, UNCOVERED, Case, Inputs, commands, path_parameters
from tests.stores import Bucket
from tests.struck import Strike, struck
from tests.watched import watched
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.common.files.store import PROBE
from vislam2tag.pipeline.run.output import LOGS

TIMES = {"fit_s", "predict_s", "train_s", "predict_ms", "train_ratio", "predict_ratio", "seconds", "duration_of_run_s"}
"""Fields that record how long something took or when it was done: no two runs have the same."""
NOT_COMPARED = {"times.csv", ".vislam2tag.json"}
"""Files of nothing but such fields, and the sums of files in a store. A probe of a killed program stays there, too: no
other may remove it, as it cannot know that its writer has ended."""
NOTE = b"mine"
KILLS = 20
"""Of each command in the campaign; CI has five of all."""
Tree = dict[str, str]


@dataclass
class Place:
    """Where a command's output is: a folder of this machine or one in a store, with nothing else in it."""

    case: Case
    root: Path
    bucket: Bucket | None = None

    @property
    def out(self) -> Path:
        """The output as the command line names it."""
        folder = Path(f"{self.bucket.address}/{self.root.name}") if self.bucket else self.root
        return folder / "out" / self.case.output if "." in self.case.output else folder / "out"

    @property
    def watched(self) -> Path:
        """The folder below which all is that the command writes."""
        return self.out.parent if self.bucket else self.root

    def files(self) -> dict[str, bytes]:
        """All files by their paths."""
        if self.bucket is None:
            found = (path for path in self.root.rglob("*") if path.is_symlink() or path.is_file())
            return {path.relative_to(self.root).as_posix(): path.read_bytes() for path in found}
        store = self.bucket.store(self.root.name)
        names = [file.name for file in store.list() if f"/{LOGS}/" not in file.name]
        return {name: stored.data for name in names if (stored := store.get(name)) is not None}

    def tree(self) -> Tree:
        """What is compared of each file: its bytes, but for fields that record times."""
        return {
            name: hashlib.sha256(_without_times(name, content)).hexdigest()
            for name, content in self.files().items()
            if Path(name).name not in NOT_COMPARED and not Path(name).name.startswith(PROBE)
            if content == NOTE or not name.removeprefix("out/").startswith(self.case.counted)
        }

    def add_notes(self) -> Tree:
        """Add files as a user may: beside what the command wrote, in its folders and in one of the user's own."""
        names = {name for name in self.files() if name.startswith("out/")}
        folders = {"out", "out/mine", *(Path(name).parent.as_posix() for name in names if "/." not in name)}
        notes = {f"{folder}/{name}" for folder in folders for name in ("notes.txt", "floor_0_mine.parquet")}
        for note in notes:
            if self.bucket is None:
                (self.root / note).parent.mkdir(parents=True, exist_ok=True)
                (self.root / note).write_bytes(NOTE)
            else:
                self.bucket.store(self.root.name).put(note, NOTE)
        return dict.fromkeys(notes, hashlib.sha256(NOTE).hexdigest())


def _without_times(name: str, content: bytes) -> bytes:
    if not name.endswith(".json"):
        return content
    return json.dumps(_plain(json.loads(content))).encode()


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items() if key not in TIMES}
    return [_plain(each) for each in value] if isinstance(value, list) else value


@dataclass
class Whole:
    """What one uninterrupted run leaves, where, and how many steps of writing it took."""

    place: Place
    tree: Tree
    steps: int


@dataclass
class Bench:
    """The inputs, and what is known of each case so far."""

    inputs: Inputs
    folder: Path
    bucket: Bucket | None = None
    _known: dict[tuple[str, bool], Whole] = field(default_factory=dict)
    _places: int = 0

    def place(self, case: Case, stored: bool = False) -> Place:
        """A new place for an output of a case, ready for its first run."""
        self._places += 1
        place = Place(case, self.folder / f"{case}-{self._places}", self.bucket if stored else None)
        place.root.mkdir()
        if place.bucket is None:
            case.prepare(self.inputs, place.out)
        return place

    def place_after_a_run(self, case: Case, stored: bool = False) -> Place:
        """A new place with what one uninterrupted run left."""
        whole, place = self.whole(case, stored), self.place(case, stored)
        if stored:
            self.run(place)
        else:
            shutil.rmtree(place.root)
            shutil.copytree(whole.place.root, place.root, symlinks=True)
        return place

    def run(self, place: Place, *options: str | Path, code: int | None = None) -> int:
        """Run a case's command; return how many steps of writing it took."""
        case = place.case
        line = case.line(self.inputs, place.out, *options)
        with watched(place.watched) as watch:
            done = vislam2tag(*line)
        assert done.returncode == (case.code if code is None else code), (done.stdout, done.stderr)
        return watch.seen

    def whole(self, case: Case, stored: bool = False) -> Whole:
        """What one uninterrupted run leaves; found once."""
        key = str(case), stored
        if key not in self._known:
            place = self.place(case, stored)
            steps = self.run(place)
            self._known[key] = Whole(place, place.tree(), steps)
        return self._known[key]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(Inputs(tmp_path_factory.mktemp("inputs")), tmp_path_factory.mktemp("outputs"))


@pytest.fixture(scope="module")
def stores(bench: Bench, s3: Bucket) -> Iterator[Bench]:
    """The same with a store."""
    bench.bucket = s3
    yield bench
    bench.bucket = None


def _param(case: Case, *more: object, slow: bool) -> Any:
    marks = [pytest.mark.campaign] * slow
    return pytest.param(case, *more, marks=marks, id="-".join(map(str, (case, *more))))


STORED_IN_CI = ("process", "export")


def test_every_command_that_writes_is_covered_or_exempt() -> None:
    covered = {
        case.command: {name for each in CASES if each.command == case.command for name in each.writes} for case in CASES
    }
    there = dict(commands())
    assert covered.keys() | EXEMPT.keys() == there.keys()
    assert not covered.keys() & EXEMPT.keys()
    unknown = {
        (name, parameter)
        for name in covered
        for parameter in path_parameters(there[name]) - covered[name] - READ
        if (name, parameter) not in UNCOVERED
    }
    assert not unknown, "say whether they name what is read or what is written"


@pytest.mark.parametrize("case", [_param(case, slow=case.slow) for case in CASES])
def test_a_second_run_leaves_the_same_and_what_the_user_added(bench: Bench, case: Case) -> None:
    second_run(bench, case, stored=False)


@pytest.mark.parametrize(
    "case",
    [_param(case, slow=case.slow or case.command not in STORED_IN_CI) for case in CASES if case.stored],
)
def test_a_second_run_into_a_store_leaves_the_same_and_what_the_user_added(stores: Bench, case: Case) -> None:
    second_run(stores, case, stored=True)


def second_run(bench: Bench, case: Case, stored: bool) -> None:
    """Run again over what is there and files of the user; all of it stays."""
    place = bench.place_after_a_run(case, stored)
    notes = place.add_notes()
    bench.run(place, code=case.again)
    assert place.tree() == bench.whole(case, stored).tree | notes


@pytest.mark.parametrize("case", [_param(case, slow=case.slow) for case in CASES if case.selections])
def test_one_selection_and_then_another(bench: Bench, case: Case) -> None:
    in_parts(bench, case, stored=False)


@pytest.mark.parametrize("case", [_param(case, slow=True) for case in CASES if case.selections and case.stored])
def test_one_selection_and_then_another_in_a_store(stores: Bench, case: Case) -> None:
    in_parts(stores, case, stored=True)


def in_parts(bench: Bench, case: Case, stored: bool) -> None:
    """Parts add up to the whole; a part that is refused changes nothing."""
    assert case.selections is not None
    whole, place = bench.whole(case, stored), bench.place(case, stored)
    bench.run(place, *case.selections[0])
    first, notes = place.tree(), place.add_notes()
    bench.run(place, *case.selections[1], code=2 if case.refused else None)
    if case.refused:
        assert place.tree() == first | notes
        bench.run(place)
    assert place.tree() == whole.tree | notes


def kills() -> Iterator[Any]:
    """Twenty kills of each command, at a first run and at a second one in turn; a few of all are for CI."""
    drawn = [(case, stored, number) for case in CASES for stored in {False, case.stored} for number in range(KILLS)]
    drawn.sort(key=lambda one: (str(one[0]), *one[1:]))
    cheap = [one for one in drawn if not one[0].slow and (not one[1] or one[0].command in STORED_IN_CI)]
    quick = [*Random(39).sample(cheap, 4), next(one for one in cheap if one[1])]
    for case, stored, number in drawn:
        if case.killed:
            yield _param(case, "store" if stored else "here", number, slow=(case, stored, number) not in quick)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "where", "number"), list(kills()))
def test_killed_before_any_write_the_next_run_leaves_the_same(
    request: pytest.FixtureRequest, bench: Bench, case: Case, where: str, number: int
) -> None:
    stored = where == "store"
    if stored:
        bench = request.getfixturevalue("stores")
    whole, steps = bench.whole(case, stored), bench.whole(case, stored).steps
    second = bool(number % 2)
    if second:
        steps = bench.run(bench.place_after_a_run(case, stored), code=case.again)
    place = bench.place_after_a_run(case, stored) if second else bench.place(case, stored)
    step = math.ceil(Random(f"{case}{where}{number}").random() * steps)
    if step == 0:
        return  # it writes nothing
    done = struck(place.watched, Strike(step), *case.line(bench.inputs, place.out))
    assert done.returncode == -signal.SIGKILL, (done.stdout, done.stderr)
    # A folder without a record belongs to no command yet and is refused if it contains files of the user.
    recorded = "." in case.output or any(Path(name).name == OWN_FILES for name in place.files())
    notes = place.add_notes() if recorded else {}
    bench.run(place, code=case.again if second else None)
    assert place.tree() == whole.tree | notes
