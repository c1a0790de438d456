"""First mistakes of people who were never told how, and what the program must answer.

They are the rows of docs/how-to/first_mistakes.md, which `make docs-pages` makes.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from tests.site.plans import drawn_floor


@dataclass(frozen=True)
class Mistake:
    """What somebody did in a folder with ``survey``, ``labels``, ``set`` and plans, and a part of the answer."""

    step: str
    did: str
    command: str
    answer: str
    """A part of what the program prints."""
    code: int = 2
    before: Callable[[Path], object] = lambda _: None
    tried: bool = True
    """Whether it was found by trying."""


MARKS = "survey/floor_0/marker_dict.csv"
WALK = "survey/floor_0/LG/2021-12-20T09:14:00"


def write(name: str, text: str) -> Callable[[Path], object]:
    """Put a file there, in place of what it is."""

    def run(world: Path) -> None:
        (world / name).parent.mkdir(parents=True, exist_ok=True)
        (world / name).write_text(text)

    return run


def edit(name: str, change: Callable[[str], str]) -> Callable[[Path], object]:
    """Change a file's text."""
    return lambda world: (world / name).write_text(change((world / name).read_text()))


def remove(name: str) -> Callable[[Path], object]:
    """Remove a file or folder."""

    def run(world: Path) -> None:
        path = world / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()

    return run


def move(name: str, to: str) -> Callable[[Path], object]:
    """Rename a file or folder."""
    return lambda world: (world / name).rename(world / to)


def plans(world: Path) -> None:
    """Plans of several formats."""
    drawn_floor.png(world)
    drawn_floor.framed_pdf(world)
    drawn_floor.dxf(world, units=0)
    drawn_floor.svg(world, 'width="200mm" height="100mm"')


def described(world: Path) -> None:
    """Plans, and a survey whose site.toml has the floor."""
    plans(world)
    write("survey/site.toml", "[[floors]]\nnumber = 0\n")(world)


def deviceless(world: Path) -> None:
    """A walk that lies in its floor's folder."""
    move(WALK, "survey/floor_0/walk")(world)
    remove("survey/floor_0/LG")(world)


def rows(change: Callable[[list[str]], list[str]]) -> Callable[[str], str]:
    """Change the rows below a table's header."""

    def run(text: str) -> str:
        head, *lines = text.splitlines()
        return "\n".join([head, *change(lines)]) + "\n"

    return run


def white(world: Path) -> None:
    """A plan that shows nothing."""
    Image.new("RGB", (60, 30), "white").save(world / "white.png")


def coordinates(change: Callable[[float, float], tuple[float, float]]) -> Callable[[Path], object]:
    """Change x and y of all landmarks."""

    def run(lines: list[str]) -> list[str]:
        changed = []
        for line in lines:
            name, x, y, *others = line.split(",")
            changed.append(",".join([name, *(f"{value:.3f}" for value in change(float(x), float(y))), *others]))
        return changed

    return edit(MARKS, rows(run))


def zipped(world: Path) -> None:
    """The survey as a zip, as mail programs make one."""
    shutil.make_archive(str(world / "survey"), "zip", world, "survey")


def packed_on_windows(world: Path) -> None:
    """A walk packed again by a program that writes backslashes."""
    with zipfile.ZipFile(world / "walk.zip", "w") as archive:
        archive.writestr("2021-12-20T091400\\session.json", "{}")


def left_by_file_managers(world: Path) -> None:
    """What Windows and macOS leave in folders that they show, and in zips."""
    for folder in ("survey", "survey/floor_0", WALK):
        for name in ("Thumbs.db", "desktop.ini", ".DS_Store", "._poses.csv"):
            (world / folder / name).write_bytes(b"\0")
    (world / "survey/__MACOSX/floor_0").mkdir(parents=True)


SITE, MARK, RECORD, PROCESS, CHECK, SET, LOCATE = (
    "site", "landmarks", "record, import", "process", "check, evaluate", "dataset", "train, locate"
)  # fmt: skip
MISTAKES = (
    # --- site
    Mistake(
        SITE,
        "gave a plan without its size",
        "site init new --plan plan.png",
        "tells no scale; give --width-m or",
        2,
        plans,
        False,
    ),
    Mistake(
        SITE,
        "gave a width and height that contradict the plan",
        "site init new --plan plan.png --width-m 20 --height-m 14",
        "give --width-m 20 alone (the height is then 10.00 m)",
        2,
        plans,
        False,
    ),
    Mistake(
        SITE,
        "gave centimetres for metres",
        "site init new --plan plan.png --width-m 2000",
        "note: floor 1 is 2000 m wide: were its sizes in metres?",
        0,
        plans,
    ),
    Mistake(
        SITE,
        "gave an SVG in millimetres without its scale",
        "site init new --plan plan.svg",
        "(200 mm x 100 mm on paper: --scale 1:100",
        2,
        plans,
        False,
    ),
    Mistake(
        SITE,
        "took a framed page for the building",
        "site init new --plan framed.pdf --scale 1:100",
        "note: the page has a frame: only the drawing between",
        0,
        plans,
        False,
    ),
    Mistake(
        SITE,
        "named a page that the PDF has not",
        "site init new --plan framed.pdf --page 2 --scale 1:100",
        "has no page 2: it has 1; correct page",
        2,
        plans,
    ),
    Mistake(
        SITE,
        "gave a DWG",
        "site init new --plan plan.dwg --width-m 20",
        "is a DWG, which only its maker's programs read; save it as DXF",
        2,
        write("plan.dwg", "AC1032"),
    ),
    Mistake(
        SITE, "gave a DXF without units", "site init new --plan plan.dxf", "tells no scale; give --width-m or", 2, plans
    ),
    Mistake(
        SITE,
        "gave a layer that the DXF has not",
        "site init new --plan plan.dxf --unit-m 0.001 --layer WALLS",
        "has no layer WALLS; there are: A-DIM, A-WALL",
        2,
        plans,
    ),
    Mistake(
        SITE,
        "gave a plan of one colour",
        "site init new --plan white.png --width-m 20",
        "shows nothing: all its pixels have one colour; replace it",
        2,
        white,
    ),
    Mistake(
        SITE,
        "added a floor twice",
        "site init survey --plan plan.png --floor 0 --width-m 20",
        "has that floor already; edit it there",
        2,
        described,
    ),
    Mistake(
        SITE,
        "misspelt an entry of site.toml",
        "inspect survey",
        "[[floors]] number 1, elevation: not known, look for a typing error",
        2,
        write("survey/site.toml", "[[floors]]\nnumber = 0\nelevation = 3.0\n"),
    ),
    Mistake(
        SITE,
        "planned landmarks without a plan",
        "plan empty --out p",
        "floor 1: has no plan; add floor_1/floorplan.jpg or a site.toml",
        2,
        write("empty/floor_1/marker_dict.csv", "id,x,y\n"),
    ),
    # --- landmarks
    Mistake(
        MARK,
        "saved the table with ; and decimal commas",
        "inspect survey",
        "fields are separated by ;; numbers have a decimal comma",
        0,
        edit(MARKS, lambda text: text.replace(",", ";").replace(".", ",")),
        False,
    ),
    Mistake(
        MARK,
        "gave the columns other names",
        "inspect survey",
        "Rechtswert was taken for x; Hochwert was taken for y",
        0,
        edit(MARKS, lambda text: text.replace("id,x,y", "Nr,Rechtswert,Hochwert")),
        False,
    ),
    Mistake(
        MARK,
        "measured in feet",
        "inspect survey",
        "x_ft was taken for x (a unit is 0.3048 m)",
        0,
        edit(MARKS, lambda text: text.replace("id,x,y", "id,x_ft,y_ft")),
        False,
    ),
    Mistake(
        MARK,
        "left out the header",
        "inspect survey",
        "looks like data; put id,x,y or the like above it",
        1,
        edit(MARKS, lambda text: text.split("\n", 1)[1]),
    ),
    Mistake(
        MARK,
        "gave columns names that nobody can guess",
        "inspect survey",
        "it lacks x and y and is: id,left,top",
        1,
        edit(MARKS, lambda text: text.replace("id,x,y", "id,left,top")),
        False,
    ),
    Mistake(
        MARK,
        "gave national coordinates",
        "inspect survey",
        "(those of a national grid are brought to the plan by vislam2tag register --control)",
        1,
        edit(
            MARKS,
            rows(
                lambda lines: [
                    f"{line.split(',')[0]},294405{line.split(',')[1]},5628801{line.split(',')[2]}" for line in lines
                ]
            ),
        ),
    ),
    Mistake(
        MARK,
        "wrote an id twice",
        "inspect survey",
        "an id may appear once on a floor; the first row counts: remove the others",
        0,
        edit(MARKS, rows(lambda lines: [*lines, lines[0]])),
    ),
    Mistake(
        MARK,
        "wrote a word for a number",
        "inspect survey",
        "these rows are left out: correct them",
        0,
        edit(MARKS, rows(lambda lines: [lines[0].rpartition(",")[0] + ",door", *lines[1:]])),
    ),
    Mistake(
        MARK, "left the file out", "inspect survey", "the floor's landmarks are unknown: add the file", 1, remove(MARKS)
    ),
    Mistake(
        MARK,
        "put the landmarks of all floors into a file without floors",
        "process survey --out out --landmarks all.csv --jobs 1",
        "cannot be opened (No such file or directory); expected a landmark file",
        2,
    ),
    Mistake(
        MARK,
        "registered a station's shots without known points",
        "register survey --station shots.csv",
        "--station needs known points: --control FILE, or --known ID",
        2,
    ),
    Mistake(
        MARK,
        "asked for sheets of a folder without landmarks",
        "sheets empty --out s",
        "holds no landmark; add rows to marker_dict.csv, or name them with --ids",
        2,
        write("empty/floor_1/marker_dict.csv", "id,x,y\n"),
    ),
    # --- record, import
    Mistake(
        RECORD,
        "gave the folder of a floor for the survey",
        "inspect survey/floor_0",
        "it lies in a floor's folder: give the survey's, ",
        2,
    ),
    Mistake(
        RECORD,
        "gave a walk's folder for the survey",
        f"inspect {WALK}",
        "it lies in a floor's folder: give the survey's, ",
        2,
    ),
    Mistake(
        RECORD,
        "gave the labels for the survey",
        "inspect labels",
        "it contains the output of another command: give the survey that this output was made from",
        2,
    ),
    Mistake(
        RECORD,
        "misspelt the survey",
        "inspect survy",
        "survy: no such folder; expected a survey folder with floor_K folders inside",
        2,
    ),
    Mistake(
        RECORD,
        "forgot the folder of the device",
        "inspect survey",
        "no session (a folder floor_K/DEVICE/SESSION with poses.csv) in it",
        2,
        deviceless,
    ),
    Mistake(
        RECORD,
        "called the floor's folder otherwise",
        "inspect survey",
        "no folder named floor_1, floor_2, ... in it",
        2,
        move("survey/floor_0", "survey/Ground floor"),
    ),
    Mistake(
        RECORD,
        "took over the phone's zip as it is",
        "inspect walk.zip",
        "not a folder; expected a survey folder",
        2,
        write("walk.zip", "PK"),
    ),
    Mistake(
        RECORD,
        "lost the poses",
        "inspect survey",
        "no camera poses; the session cannot be mapped",
        1,
        remove(f"{WALK}/poses.csv"),
    ),
    Mistake(RECORD, "lost the Wi-Fi", "inspect survey", "missing_file wifi.csv", 0, remove(f"{WALK}/wifi.csv")),
    Mistake(
        RECORD,
        "opened a recording in a spreadsheet and saved it",
        "inspect survey",
        "these lines do not have the expected fields; they are left out: look at the first ones",
        1,
        edit(f"{WALK}/poses.csv", lambda text: text.replace("; ", ",")),
    ),
    Mistake(
        RECORD,
        "imported a file of an unknown kind",
        "import notes.txt --out new",
        "is none of the formats known (comford,",
        2,
        write("notes.txt", "hello"),
    ),
    Mistake(RECORD, "imported what is not there", "import gone.csv --out new", "gone.csv: no such file or folder", 2),
    # --- process
    Mistake(PROCESS, "forgot --out", "process survey", "Missing option '-o' / '--out'", 2),
    Mistake(
        PROCESS,
        "wrote labels into a folder with other things",
        "process survey --out survey --jobs 1",
        "choose an empty or new folder for --out",
        2,
    ),
    Mistake(
        PROCESS,
        "misspelt the strategy",
        "process survey --out out --strategy smother",
        "no mapping strategy is called 'smother'; there are:",
        2,
    ),
    Mistake(
        PROCESS,
        "asked for a floor that is not there",
        "process survey --out out --floor 7 --jobs 1",
        "--floor 7: the survey has no session of it; there are: 0",
        2,
    ),
    Mistake(
        PROCESS,
        "asked for a phone that is not there",
        "process survey --out out --device Pixel --jobs 1",
        "--device Pixel: the survey has no session of it; there are: LG",
        2,
    ),
    Mistake(
        PROCESS,
        "misspelt a setting",
        "process survey --out out --config settings.toml",
        "no such setting; the nearest is labels.max_sigma_m",
        2,
        write("settings.toml", "[labels]\nmax_sigma = 0.3\n"),
    ),
    Mistake(
        PROCESS,
        "misspelt an entry of corrections.toml",
        "process survey --out out --jobs 1",
        "[[swap_landmark]]: not known, look for a typing error",
        2,
        write("survey/corrections.toml", "[[swap_landmark]]\nids = ['1', '2']\n"),
    ),
    Mistake(
        PROCESS,
        "corrected a walk that is not there",
        "process survey --out out --jobs 1",
        "has no effect: no session matches; correct or remove it",
        0,
        write("survey/corrections.toml", "[[exclude_session]]\ndevice = 'Pixel'\n"),
    ),
    Mistake(
        PROCESS,
        "gave a decimal comma to an option",
        "process survey --out out --max-sigma-m 0,3",
        "Invalid value for '--max-sigma-m': Input should be a valid number",
        2,
    ),
    Mistake(PROCESS, "misspelt the command", "proces survey --out out", "Did you mean 'process'?", 2),
    # --- check, evaluate
    Mistake(
        CHECK,
        "checked the labels, not the survey",
        "check labels",
        "it contains the output of another command: give the survey that this output was made from",
        2,
    ),
    Mistake(
        CHECK,
        "evaluated without any truth",
        "evaluate survey --out out --jobs 1",
        "there is no truth to compare labels with: neither control points",
        2,
        remove(f"{WALK}/truth.csv"),
    ),
    Mistake(
        CHECK,
        "evaluated with a folder of truth that is not there",
        "evaluate survey --out out --truth gone --jobs 1",
        "--truth gone: is no folder; it holds a file for each session",
        2,
    ),
    Mistake(
        CHECK,
        "checked with one landmark",
        "check survey --jobs 1",
        "it needs two surveyed landmarks seen half a metre apart",
        1,
        edit(MARKS, rows(lambda lines: lines[:1])),
    ),
    Mistake(
        CHECK,
        "evaluated into the labels",
        "evaluate survey --out labels --jobs 1",
        "holds what `vislam2tag process` wrote",
        2,
    ),
    Mistake(
        CHECK,
        "checked a floor that is not there",
        "check survey --floor 3 --jobs 1",
        "--floor 3: the survey has no session of it; there are: 0",
        2,
    ),
    Mistake(
        CHECK,
        "diagnosed the labels, not the survey",
        "diagnose labels",
        "it contains the output of another command: give the survey that this output was made from",
        2,
    ),
    # --- dataset
    Mistake(
        SET,
        "made a data set of a folder with something else",
        "dataset notes --out new",
        "notes: not a survey: no folder named floor_1, floor_2, ... in it",
        2,
        write("notes/a.txt", "hello"),
    ),
    Mistake(
        SET,
        "wrote a data set into the labels",
        "dataset labels --out labels",
        "holds what `vislam2tag process` wrote",
        2,
    ),
    Mistake(
        SET,
        "gave the plans of another survey",
        "dataset labels --survey other --out new",
        "is not the one that",
        2,
        lambda world: write("other/floor_0/marker_dict.csv", "id,x,y\n1,1,1\n")(world),
    ),
    Mistake(
        SET,
        "gave a window without its unit",
        "dataset labels --out new --window 1",
        "with its unit, such as 500ms, 2s or 1.5min",
        2,
    ),
    Mistake(SET, "gave the labels twice", "dataset labels labels --out new", "give each walk once", 2),
    Mistake(
        SET,
        "exported in a format that is not there",
        "export set --format excel --out new",
        "no format called 'excel' can be written; there are:",
        2,
    ),
    Mistake(
        SET,
        "made radio maps of an access point that is not there",
        "radio-maps set --out new --ap aa:bb",
        "--ap aa:bb: is no access point of this data set",
        2,
        lambda _: None,
        False,
    ),
    Mistake(
        SET,
        "joined a data set with a survey",
        "join set survey --out new",
        "give a folder that `vislam2tag dataset` or `vislam2tag import` wrote",
        2,
    ),
    Mistake(
        SET,
        "labelled a table without times",
        "label table.csv --labels labels",
        "no column is called as times are",
        2,
        write("table.csv", "when;co2\n1;400\n"),
    ),
    # --- train, locate
    Mistake(
        LOCATE,
        "trained a model that is not there",
        "train set --model nearest --out m.v2t",
        "no positioning model is called 'nearest'; there are:",
        2,
    ),
    Mistake(
        LOCATE,
        "trained on the survey",
        "train survey --model weighted-knn --out m.v2t",
        "give a folder that `vislam2tag dataset` or `vislam2tag import` wrote",
        2,
    ),
    Mistake(
        LOCATE,
        "trained on the labels",
        "train labels --model weighted-knn --out m.v2t",
        "give a folder that `vislam2tag dataset` or `vislam2tag import` wrote",
        2,
    ),
    Mistake(
        LOCATE,
        "named a split that is not there",
        "train set --model weighted-knn --split rooms --out m.v2t",
        "--split rooms: the data set has no such split; there are: block, random",
        2,
    ),
    Mistake(
        LOCATE,
        "located with a file that is no model",
        "locate notes.txt scans.csv",
        "give a file that `vislam2tag train` wrote",
        2,
        write("notes.txt", "hello"),
    ),
    Mistake(
        LOCATE,
        "gave scans without a column of levels",
        "locate m.v2t scans.csv",
        "line 1: no column rssi_dbm; the first line must name scan_id, bssid, rssi_dbm",
        2,
        write("scans.csv", "scan_id,bssid\n1,aa\n"),
    ),
    Mistake(
        LOCATE,
        "gave scans that hear nothing known",
        "locate m.v2t scans.csv",
        "take a model of the building where the scans were taken",
        1,
        write("scans.csv", "scan_id,bssid,rssi_dbm\n1,aa,-50\n"),
    ),
    Mistake(
        LOCATE,
        "gave scans that are not there",
        "locate m.v2t gone.csv",
        "gone.csv: cannot be read (No such file or directory)",
        2,
    ),
    Mistake(
        SITE, "gave the plan's folder", "site init new --plan survey", "is a folder; give the file of the floor's plan"
    ),
    Mistake(
        SITE,
        "wrote the unit behind the number",
        "site init new --plan plan.png --width-m 20m",
        "Invalid value for '--width-m': Input should be a valid number",
        2,
        plans,
    ),
    Mistake(
        SITE,
        "gave the scale of a picture",
        "site init new --plan plan.png --scale 1:100",
        "tells no size on paper, which a scale such as 1:100 needs",
        2,
        plans,
    ),
    Mistake(
        SITE,
        "gave a scale without 1:",
        "site init new --plan framed.pdf --scale 100",
        "give 1:N as the drawing says, such as 1:100",
        2,
        plans,
    ),
    Mistake(
        MARK,
        "measured in pixels of the plan",
        "inspect survey",
        "12 of 12 landmarks of floor 0 (1, 2, 3, 4, 5, ...) lie more than 5 m off its plan",
        0,
        coordinates(lambda x, y: (20 * x + 200, 20 * y + 200)),
    ),
    Mistake(
        MARK,
        "wrote y before x",
        "diagnose survey --jobs 1",
        "The landmark table of floor 0 is mirrored.",
        1,
        coordinates(lambda x, y: (y, x)),
    ),
    Mistake(
        MARK,
        "measured in feet under a header without unit",
        "diagnose survey --jobs 1",
        "The landmark table of floor 0 is in ft, not in metres.",
        1,
        coordinates(lambda x, y: (x / 0.3048, y / 0.3048)),
    ),
    Mistake(
        MARK,
        "saved a spreadsheet under the name of a CSV file",
        "inspect survey",
        "it is a spreadsheet (XLSX), not text: save it as CSV, or name it .xlsx",
        1,
        write(MARKS, "PK\x03\x04"),
    ),
    Mistake(
        MARK,
        "saved the table as Unicode text (UTF-16)",
        "inspect survey",
        "numbers have a decimal comma",
        0,
        lambda world: (world / MARKS).write_bytes(
            (world / MARKS).read_text().replace(",", ";").replace(".", ",").encode("utf-16")
        ),
    ),
    Mistake(
        RECORD,
        "gave the folder that the survey lies in",
        "inspect outer",
        "give the folder that holds them: outer/survey",
        2,
        lambda world: shutil.move(world / "survey", world / "outer/survey"),
    ),
    Mistake(RECORD, "gave a zip of the survey", "inspect survey.zip", "unpack it and give the folder", 2, zipped),
    Mistake(
        RECORD,
        "packed a phone's zip again",
        "receive survey walk.zip",
        "give the zip as the phone wrote it, not packed again",
        1,
        packed_on_windows,
    ),
    Mistake(
        RECORD,
        "left a copy of a walk beside it",
        "inspect survey",
        "holds the same walk as floor_0/LG/2021-12-20T09:14:00: it would count twice",
        0,
        lambda world: shutil.copytree(world / WALK, world / f"{WALK} - Copy"),
    ),
    Mistake(
        RECORD,
        "put another building's floor into the survey",
        "inspect survey",
        "make that a survey of its own",
        0,
        lambda world: shutil.copytree(world / "survey/floor_0", world / "survey/Building B"),
    ),
    Mistake(
        RECORD,
        "copied what Windows and macOS leave in folders",
        "inspect survey",
        "sessions: 1, findings: 0",
        0,
        left_by_file_managers,
    ),
    Mistake(
        RECORD,
        "imported the survey",
        "import survey --out new",
        "it is a survey: `vislam2tag dataset` makes a data set of it",
    ),
    Mistake(
        RECORD,
        "imported a data set of ours",
        "import set --out new",
        "it is a data set of ours already, which every command takes as it is",
    ),
    Mistake(
        PROCESS,
        "named a new survey's folder by --out",
        "simulate --out new",
        "give the folder without it: vislam2tag simulate new",
    ),
    Mistake(
        PROCESS,
        "gave the survey for OUT",
        "run survey --out survey --jobs 1",
        "choose an empty or new folder for --out",
    ),
    Mistake(
        PROCESS,
        "wrote labels among the walks",
        "process survey --out survey/floor_0/labels --jobs 1",
        "lies among the survey's sessions, which stay as they are; choose another --out",
    ),
    Mistake(
        PROCESS,
        "spelled --out otherwise",
        "process survey --output out",
        "No such option: --output (Possible options: --out)",
    ),
    Mistake(
        PROCESS,
        "gave settings as YAML",
        "process survey --out out --config s.yaml",
        "--config s.yaml: not a TOML file",
        2,
        write("s.yaml", "labels:\n  max_sigma_m: 0.3\n"),
    ),
    Mistake(
        CHECK,
        "gave a file of truth for its folder",
        f"evaluate survey --out out --truth {WALK}/truth.csv --jobs 1",
        "is no folder; it holds a file for each session",
    ),
    Mistake(
        SET,
        "labelled by the survey, not its labels",
        "label table.csv --labels survey",
        "it is a survey: run `vislam2tag process` on it first",
        2,
        write("table.csv", "time_s\n5\n"),
    ),
    Mistake(
        SET,
        "labelled dates as German spreadsheets write them",
        "label table.csv --labels labels --zone Europe/Berlin",
        "give numbers, or ISO 8601 such as 2021-12-20T09:14:05+01:00",
        2,
        write("table.csv", "time;co2\n20.12.2021 09:14:05;400\n"),
    ),
    Mistake(
        SET,
        "gave a time zone by its short name",
        "label table.csv --labels labels --zone CEST",
        "--zone CEST: is no time zone; give one such as Europe/Berlin or UTC",
        2,
        write("table.csv", "time,co2\n2021-12-20T09:14:05,400\n"),
    ),
    Mistake(
        SET,
        "labelled a spreadsheet",
        "label table.xlsx --labels labels",
        "is a spreadsheet (XLSX) or a zip; save the table as CSV and give that",
        2,
        write("table.xlsx", "PK"),
    ),
    Mistake(
        SET,
        "made radio maps of a network's name",
        "radio-maps set --out new --ap eduroam",
        "it is the name of 6 of them, such as 02:",
    ),
    Mistake(
        LOCATE,
        "gave the model and the scans the other way round",
        "locate scans.csv m.v2t",
        "scans.csv: is no model, or damaged",
        2,
        write("scans.csv", "scan_id,bssid,rssi_dbm\n1,aa,-50\n"),
    ),
    Mistake(
        LOCATE,
        "gave scans as German spreadsheets write them",
        "locate m.v2t scans.csv",
        "must name scan_id, bssid, rssi_dbm and have commas between fields, not ;",
        2,
        write("scans.csv", "scan_id;bssid;rssi_dbm\n1;aa;-50,5\n"),
    ),
    Mistake(
        LOCATE,
        "wrote levels without their sign",
        "locate m.v2t scans.csv",
        "Negate the levels",
        1,
        write("scans.csv", "scan_id,bssid,rssi_dbm\n1,aa,50\n"),
    ),
    Mistake(
        LOCATE,
        "wrote the model into a folder that is not there",
        "train set --model weighted-knn --out models/m.v2t",
        "models/m.v2t: cannot be written (is a folder, or in none); choose another name",
    ),
)


_HEAD = """# First mistakes

For whoever begins: what people do who were never told how, and what the program answers. Each is a test through the
command line (`tests/cli/test_first_mistakes.py`); this page is made of its table by `make docs-pages`. Those
with an asterisk were found by trying. Where
a command ends with 0 the answer is a finding or a note, and it goes on.
"""


def page() -> str:
    """docs/how-to/first_mistakes.md."""
    lines = [_HEAD]
    for step in dict.fromkeys(mistake.step for mistake in MISTAKES):
        lines += [f"## {step.capitalize()}", "", "| somebody | command | ends with | answer, a part of it |"]
        lines += ["| --- | --- | ---: | --- |"]
        for each in (each for each in MISTAKES if each.step == step):
            star = " *" if each.tried else ""
            answer = each.answer.replace("|", "\\|")
            lines.append(f"| {each.did}{star} | `{each.command}` | {each.code} | {answer} |")
        lines.append("")
    return "\n".join(lines)
