"""What the program answers to first mistakes: each entry of first_mistakes.toml, tried in one made folder."""

from __future__ import annotations

import shutil
import tomllib
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from PIL import Image

from tests.cli.command import vislam2tag
from tests.site.plans import drawn_floor
from tests.surveys import make_survey

ROWS = Path(__file__).with_name("first_mistakes.toml")
Change = Callable[[Path], object]


class Mistake(NamedTuple):
    """An entry of the list: what somebody did, the command, how it ends, and a part of what it prints."""

    step: str
    did: str
    command: str
    code: int
    answer: str
    tried: bool
    """Whether it was found by trying."""


MISTAKES = [Mistake(**row) for row in tomllib.loads(ROWS.read_text(encoding="utf-8"))["mistake"]]
MARKS = "survey/floor_0/marker_dict.csv"
WALK = "survey/floor_0/LG/2021-12-20T09:14:00"
FILES = {
    "plan.dwg": "AC1032",
    "empty/floor_1/marker_dict.csv": "id,x,y\n",
    "other/floor_0/marker_dict.csv": "id,x,y\n1,1,1\n",
    "walk.zip": "PK",
    "notes.txt": "hello",
    "notes/a.txt": "hello",
    "settings.toml": "[labels]\nmax_sigma = 0.3\n",
    "s.yaml": "labels:\n  max_sigma_m: 0.3\n",
    "table.xlsx": "PK",
}
"""What lies beside the survey, its labels, the data set and the model, besides plans."""


def write(name: str, text: str) -> Change:
    """Put a file there, in place of what it is."""

    def run(world: Path) -> None:
        (world / name).parent.mkdir(parents=True, exist_ok=True)
        (world / name).write_text(text)

    return run


def edit(name: str, change: Callable[[str], str]) -> Change:
    """Change a file's text."""
    return lambda world: (world / name).write_text(change((world / name).read_text()))


def named(columns: str) -> Change:
    """Give the columns of the landmark table other names."""
    return edit(MARKS, lambda text: text.replace("id,x,y", columns))


def rows(change: Callable[[list[str]], list[str]]) -> Change:
    """Change the rows of the landmark table."""

    def run(text: str) -> str:
        head, *lines = text.splitlines()
        return "\n".join([head, *change(lines)]) + "\n"

    return edit(MARKS, run)


def coordinates(change: Callable[[float, float], tuple[float, float]]) -> Change:
    """Change x and y of all landmarks."""

    def run(lines: list[str]) -> list[str]:
        changed = []
        for line in lines:
            name, x, y, *others = line.split(",")
            changed.append(",".join([name, *(f"{value:.3f}" for value in change(float(x), float(y))), *others]))
        return changed

    return rows(run)


def german(text: str) -> str:
    """A table as German spreadsheets write it."""
    return text.replace(",", ";").replace(".", ",")


def national(line: str) -> str:
    """A landmark's row with coordinates of a national grid."""
    name, x, y, *_ = line.split(",")
    return f"{name},294405{x},5628801{y}"


def deviceless(world: Path) -> None:
    """Move the walk into its floor's folder."""
    (world / WALK).rename(world / "survey/floor_0/walk")
    shutil.rmtree(world / "survey/floor_0/LG")


def packed_on_windows(world: Path) -> None:
    """Pack a walk by a program that writes backslashes."""
    with zipfile.ZipFile(world / "walk.zip", "w") as archive:
        archive.writestr("2021-12-20T091400\\session.json", "{}")


def left_by_file_managers(world: Path) -> None:
    """Add what Windows and macOS leave in folders that they show, and in zips."""
    for folder in ("survey", "survey/floor_0", WALK):
        for name in ("Thumbs.db", "desktop.ini", ".DS_Store", "._poses.csv"):
            (world / folder / name).write_bytes(b"\0")
    (world / "survey/__MACOSX/floor_0").mkdir(parents=True)


BEFORE: dict[str, Change] = {
    "added a floor twice": write("survey/site.toml", "[[floors]]\nnumber = 0\n"),
    "misspelt an entry of site.toml": write("survey/site.toml", "[[floors]]\nnumber = 0\nelevation = 3.0\n"),
    "saved the table with ; and decimal commas": edit(MARKS, german),
    "gave the columns other names": named("Nr,Rechtswert,Hochwert"),
    "measured in feet": named("id,x_ft,y_ft"),
    "gave columns names that nobody can guess": named("id,left,top"),
    "left out the header": edit(MARKS, lambda text: text.split("\n", 1)[1]),
    "gave national coordinates": rows(lambda lines: [national(line) for line in lines]),
    "wrote an id twice": rows(lambda lines: [*lines, lines[0]]),
    "wrote a word for a number": rows(lambda lines: [lines[0].rpartition(",")[0] + ",door", *lines[1:]]),
    "checked with one landmark": rows(lambda lines: lines[:1]),
    "measured in pixels of the plan": coordinates(lambda x, y: (20 * x + 200, 20 * y + 200)),
    "wrote y before x": coordinates(lambda x, y: (y, x)),
    "measured in feet under a header without unit": coordinates(lambda x, y: (x / 0.3048, y / 0.3048)),
    "saved a spreadsheet under the name of a CSV file": write(MARKS, "PK\x03\x04"),
    "saved the table as Unicode text (UTF-16)": lambda world: (world / MARKS).write_bytes(
        german((world / MARKS).read_text()).encode("utf-16")
    ),
    "left the file out": lambda world: (world / MARKS).unlink(),
    "lost the poses": lambda world: (world / WALK / "poses.csv").unlink(),
    "lost the Wi-Fi": lambda world: (world / WALK / "wifi.csv").unlink(),
    "evaluated without any truth": lambda world: (world / WALK / "truth.csv").unlink(),
    "forgot the folder of the device": deviceless,
    "called the floor's folder otherwise": lambda world: (world / "survey/floor_0").rename(
        world / "survey/Ground floor"
    ),
    "opened a recording in a spreadsheet and saved it": edit(f"{WALK}/poses.csv", lambda text: text.replace("; ", ",")),
    "gave the folder that the survey lies in": lambda world: shutil.move(world / "survey", world / "outer/survey"),
    "gave a zip of the survey": lambda world: shutil.make_archive(str(world / "survey"), "zip", world, "survey"),
    "packed a phone's zip again": packed_on_windows,
    "left a copy of a walk beside it": lambda world: shutil.copytree(world / WALK, world / f"{WALK} - Copy"),
    "put another building's floor into the survey": lambda world: shutil.copytree(
        world / "survey/floor_0", world / "survey/Building B"
    ),
    "copied what Windows and macOS leave in folders": left_by_file_managers,
    "misspelt an entry of corrections.toml": write("survey/corrections.toml", "[[swap_landmark]]\nids = ['1', '2']\n"),
    "corrected a walk that is not there": write("survey/corrections.toml", "[[exclude_session]]\ndevice = 'Pixel'\n"),
    "labelled a table without times": write("table.csv", "moment;co2\n1;400\n"),
    "labelled by the survey, not its labels": write("table.csv", "time_s\n5\n"),
    "labelled dates as German spreadsheets write them": write("table.csv", "time;co2\n20.12.2021 09:14:05;400\n"),
    "gave a time zone by its short name": write("table.csv", "time,co2\n2021-12-20T09:14:05,400\n"),
    "gave scans without a column of levels": write("scans.csv", "scan_id,bssid\n1,aa\n"),
    "gave scans that hear nothing known": write("scans.csv", "scan_id,bssid,rssi_dbm\n1,06:00:00:00:00:01,-50\n"),
    "gave the model and the scans the other way round": write("scans.csv", "scan_id,bssid,rssi_dbm\n1,aa,-50\n"),
    "gave scans as German spreadsheets write them": write("scans.csv", "scan_id;bssid;rssi_dbm\n1;aa;-50,5\n"),
    "wrote levels without their sign": write("scans.csv", "scan_id,bssid,rssi_dbm\n1,aa,50\n"),
}
"""What is different before the mistake with this name."""


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a survey, its labels, a data set, a model, plans of several formats and other files."""
    world = tmp_path_factory.mktemp("first_mistakes")
    make_survey(world / "survey", devices=("LG",))
    for command in (
        ("process", world / "survey", "--out", world / "labels", "--jobs", "1"),
        ("dataset", world / "labels", "--out", world / "set", "--jobs", "1"),
        ("train", world / "set", "--model", "weighted-knn", "--out", world / "m.v2t"),
    ):
        assert vislam2tag(*command).returncode == 0
    for name, text in FILES.items():
        write(name, text)(world)
    drawn_floor.png(world)
    drawn_floor.framed_pdf(world)
    drawn_floor.dxf(world, units=0)
    drawn_floor.svg(world, 'width="200mm" height="100mm"')
    Image.new("RGB", (60, 30), "white").save(world / "white.png")
    return world


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.did)
def test_a_first_mistake_is_answered(
    mistake: Mistake, prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = tmp_path / "world"
    shutil.copytree(prepared, world)
    if change := BEFORE.get(mistake.did):
        change(world)
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
    assert BEFORE.keys() <= {mistake.did for mistake in MISTAKES}
