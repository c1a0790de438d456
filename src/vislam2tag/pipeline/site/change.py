"""Second thoughts about a site: what a floor is called and where its plan is, its number, and a floor less."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, read_json
from vislam2tag.common.files.toml_file import first_problem
from vislam2tag.common.findings import counted
from vislam2tag.common.tabular import TabularResult
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.transforms import Similarity2
from vislam2tag.pipeline.site.floor_fit import floor_fit_notes
from vislam2tag.pipeline.site.init import NewFloor, check_plan, write_site
from vislam2tag.pipeline.site.register import RECORD_FILE
from vislam2tag.site.corrections.edits import ReplaceEntry, change_text, changed_text, corrections_text, entries_of
from vislam2tag.site.corrections.file import CORRECTIONS_FILE
from vislam2tag.site.discover import floor_folders, read_site, session_folders
from vislam2tag.site.landmark_file import LANDMARK_FILE, table_path
from vislam2tag.site.landmark_states import LandmarkCounts
from vislam2tag.site.links import survey_output, write_in_survey
from vislam2tag.site.model import landmark_id
from vislam2tag.site.plans.load import plan_called, plan_moved
from vislam2tag.site.plans.source import PlanSource, Point
from vislam2tag.site.site_file import SITE_FILE, FloorPart, Relation, SiteFile, read_site_file
from vislam2tag.site.site_table import LANDMARKS, read_site_table


@dataclass(frozen=True)
class FloorChanges:
    """Other properties of a floor; None: as before."""

    name: str | None = None
    elevation_m: float | None = None
    plan: PlanSource | None = None
    """How its plan is read and placed."""
    lower_left_m: Point | None = None
    """Where the plan's lower left corner is, BCS metres; its size stays."""
    exclude_rooms: tuple[str, ...] = ()
    """Names of further rooms that tours and coverage leave out."""
    include_rooms: tuple[str, ...] = ()
    """Names of excluded rooms that count again."""


@dataclass(frozen=True, repr=False)
class SiteChange(TabularResult):
    """What was changed, and what follows from it."""

    done: tuple[str, ...]
    """Sentences, the result first."""
    notes: tuple[str, ...] = ()
    """What to check or to do again."""
    restart: bool = False
    """Whether landmarks have to be planned again."""


def change_site(root: AnyPath, number: int | None, changes: FloorChanges, building: str | None = None) -> SiteChange:
    """Change a floor of a site (the only one without a number), or the name of its building.

    Landmarks, control points and recordings stay as they are. Raises SurveyError or UsageError if the site has no such
    floor or its plan cannot be used so, OutputError if nothing can be written.
    """
    root = Path(root)
    original = site = read_site_file(root)
    done, notes, restart = list[str](), list[str](), False
    if building is not None:
        site = site.model_copy(update={"name": building})
        done.append(f"the building is called {building} now" if building else "the building has no name now")
    if changes != FloorChanges():
        before = floor_part(root, site, number)
        after = _changed(root, site, before, changes)
        excluded = _excluded(root, before, changes)
        after = after.model_copy(update={"excluded_rooms": excluded})
        site = _with_part(site, before.number, after)
        if names := [name for name, value in before if value != getattr(after, name)]:
            done.append(f"floor {after.number}: {', '.join(names)} changed")
        number = after.number
        notes, restart = _after_placing(root, before, after)
    elif building is None:
        raise UsageError("nothing to change is given; pass --name, --elevation-m, --building, or a size or place")
    if site == original:
        return SiteChange(("nothing changed, because the site has these properties already",))
    write_site(root, site)
    if number is not None and changes.plan is None and changes.lower_left_m is not None:
        notes = [*notes, *floor_fit_notes(root, number)]
    return SiteChange((*done, *_size_and_place(root, number), f"written: {root / SITE_FILE}"), tuple(notes), restart)


def _size_and_place(root: Path, number: int | None) -> list[str]:
    """Where the plan of a floor is and how large, if that is known."""
    floors = read_site(root, follow_links=True)[0].floors
    extent_m = next((each.extent_m for each in floors if each.number == number), None)
    if extent_m is None:
        return []
    left, right, low, high = extent_m
    return [
        f"floor {number} is {right - left:.2f} m x {high - low:.2f} m, with its lower left corner at ({left:.2f}, "
        f"{low:.2f}) m"
    ]


def floor_part(root: Path, site: SiteFile, number: int | None) -> FloorPart:
    """A floor of a site, or its only one without a number; raises UsageError if there is none."""
    there = ", ".join(str(part.number) for part in site.floors)
    if number is None and len(site.floors) > 1:
        raise UsageError(f"--floor: the site has several floors ({there}); choose one")
    for part in site.floors:
        if number in (None, part.number):
            return part
    raise UsageError(f"--floor {number}: {root / SITE_FILE} does not have this floor; its floors are: {there}")


def _with_part(site: SiteFile, number: int, part: FloorPart | None) -> SiteFile:
    """The site with another floor in place of one, or without it."""
    floors = [each for each in site.floors if each.number != number] + ([] if part is None else [part])
    return site.model_copy(update={"floors": tuple(sorted(floors, key=lambda each: each.number))})


def _changed(root: Path, site: SiteFile, part: FloorPart, changes: FloorChanges) -> FloorPart:
    update: dict[str, object] = {"name": changes.name, "elevation_m": changes.elevation_m}
    source = changes.plan or part.plan
    if changes.plan is not None or changes.lower_left_m is not None:
        if source is None:
            raise UsageError(f"--floor {part.number}: this floor has no plan to place; name it in {root / SITE_FILE}")
        if changes.lower_left_m is not None:
            with plan_called(source.file):
                source = plan_moved(root / source.file, source, changes.lower_left_m)
        update["plan"] = source
    values = part.model_dump() | {name: value for name, value in update.items() if value is not None}
    after = _valid_part(values)
    if after.plan != part.plan and after.plan is not None:
        check_plan(NewFloor(root / after.plan.file, after), site.georeference)
    return after


def _valid_part(values: Mapping[str, object]) -> FloorPart:
    try:
        return FloorPart.model_validate(values)
    except ValidationError as error:
        raise UsageError(first_problem(error, FloorPart)) from error


def _excluded(root: Path, part: FloorPart, changes: FloorChanges) -> tuple[str, ...]:
    """The excluded rooms of a floor; raises SurveyError or UsageError for a name that is none."""
    for name in changes.include_rooms:
        if name not in part.excluded_rooms:
            there = ", ".join(part.excluded_rooms) or "no room"
            raise UsageError(f"--include-room {name}: this room is not excluded; excluded are: {there}")
    kept = [name for name in part.excluded_rooms if name not in changes.include_rooms]
    excluded = tuple(dict.fromkeys((*kept, *changes.exclude_rooms)))
    if changes.exclude_rooms:
        from vislam2tag.site.rooms import rooms_of  # packages of extras

        rooms_of(read_site(root, follow_links=True)[0].floor(part.number)).called(excluded)
    return excluded


def _after_placing(root: Path, before: FloorPart, after: FloorPart) -> tuple[list[str], bool]:
    """What a plan at another place or of another size leaves to do, and whether that is to plan again."""
    if before.plan == after.plan:
        return [], False
    marks = read_site(root, follow_links=True)[0].landmarks.on_floor(after.number)
    counts, notes = LandmarkCounts.of(marks), []
    if counts.planned:
        notes.append(
            f"{counted(counts.planned, 'landmark')} of floor {after.number} {'was' if counts.planned == 1 else 'were'} "
            "planned for the plan as it was: plan again with --restart"
        )
    if counts.measured:
        notes.append(
            f"measured landmarks of floor {after.number} keep their coordinates: check that they fit the plan "
            "(vislam2tag site show)"
        )
    return notes, bool(counts.planned)


def renumber_floor(root: AnyPath, old: int, new: int) -> SiteChange:
    """Give a floor another number in all files of a site that name it.

    Raises UsageError if the site has no such floor, has the new one, or walks were recorded, OutputError if something
    cannot be written.
    """
    root = Path(root)
    site = read_site_file(root)
    part = floor_part(root, site, old)
    folder, target = _folder(root, old), root / f"floor_{new}"
    if new == old:
        raise UsageError(f"floor {old} already has this number: pass another one")
    if target.exists() or any(each.number == new for each in site.floors):
        raise UsageError(f"{root}: already has a floor {new}; renumber or remove that one first")
    _refuse_walks(root, old, f", renumber the floor, then move them into floor_{new}")
    texts = _renumbered_texts(root, old, new)
    corrections = _renumbered_corrections(corrections_text(root)[0], old, new)
    plan = part.plan
    if plan is not None and folder is not None and (root / plan.file).is_relative_to(folder):
        inside = (root / plan.file).relative_to(folder).as_posix()
        plan = plan.model_copy(update={"file": f"{target.name}/{inside}"})
    after = _valid_part(part.model_dump() | {"number": new, "plan": plan})
    for path, text in texts.items():
        write_in_survey(root, path, text)
    _move(root, folder, target.name)
    write_site(root, _with_part(site, old, after))
    changed = [SITE_FILE]
    changed += [f"{(target if path.parent == folder else path.parent).name}/{path.name}" for path in texts]
    if corrections != corrections_text(root)[0]:
        change_text(root, lambda _: corrections)
        changed.append(CORRECTIONS_FILE)
    note = f"sheets and plans that were made before say floor {old}: make and print them again"
    return SiteChange((f"floor {old} is floor {new} now", f"changed: {', '.join(changed)}"), (note,))


def _renumbered_texts(root: Path, old: int, new: int) -> dict[Path, str]:
    """Files of the site's floors that name the floor, with its other number."""
    texts = {}
    for folder in _folders(root).values():
        path = folder / LANDMARK_FILE
        if table_path(path).is_file() and (text := _renumbered_landmarks(root, path, old, new)) is not None:
            texts[path] = text
    record = (_folder(root, old) or root) / RECORD_FILE
    if record.is_file():
        texts[record] = json.dumps(read_json(record) | {"floor": new}, indent=1, ensure_ascii=False) + "\n"
    return texts


def _renumbered_landmarks(root: Path, path: Path, old: int, new: int) -> str | None:
    """A landmark file with the other number in its column floor; None if it does not name the floor."""
    table = read_site_table(root, table_path(path), columns=LANDMARKS)
    rows = [list(fields) for _, fields in table.rows]
    at = table.header.index("floor") if "floor" in table.header else None
    named = [row for row in rows if at is not None and at < len(row) and landmark_id(row[at]) == str(old)]
    for row in named:
        row[table.header.index("floor")] = str(new)
    return csv_rows([table.header, *rows]) if named else None


def _renumbered_corrections(text: str, old: int, new: int) -> str:
    changes = []
    for entry in entries_of(text):
        names = ("floor", "to") if entry.table in ("set_floor", "set_landmark_floor") else ("floor",)
        values: dict[str, Any] = {
            name: value.isoformat() if isinstance(value, date) else value for name, value in entry.values.items()
        }
        named = {name: new for name in names if values.get(name) == old}
        if named:
            changes.append(ReplaceEntry(table=entry.table, number=entry.number, values=values | named))
    return changed_text(text, changes) if changes else text


MAX_SCALE_DIFFERENCE = 0.03
"""Sizes of plans are rounded, and clicks are not exact; a larger difference is a wrong size or another point."""


_USUAL_TURN_DEG = 5.0
MIN_PAIRS = 2
"""So many common points determine turn and shift."""


def align_floor(root: AnyPath, number: int, onto: int, pairs: Sequence[tuple[Point, Point]]) -> SiteChange:
    """Lay a floor on top of another one by common points, each in the BCS of both, metres.

    Only the relation of the two frames changes (``site_T_bcs``): coordinates on the floor stay. Raises UsageError for
    fewer than two points, or if their distances differ between the floors.
    """
    root = Path(root)
    site = read_site_file(root)
    part, base = floor_part(root, site, number), floor_part(root, site, onto)
    if number == onto:
        raise UsageError(f"--onto {onto}: this is the same floor; choose another one")
    here, there = (np.array([pair[side] for pair in pairs], dtype=np.float64).reshape(-1, 2) for side in (0, 1))
    try:
        found = Similarity2.fit(here, there)
    except ValueError as error:
        raise UsageError("two common points at different places are needed; pass --pair twice") from error
    _refuse_other_scale(part, base, found.scale)
    turn = found.a / found.scale
    shift = complex(*(there.mean(axis=0) - Similarity2(turn, 0j) @ here.mean(axis=0)).tolist())
    fit = Similarity2(turn, shift)
    apart_m = float(np.linalg.norm(fit @ here - there, axis=1).max())
    frame = base.site_T_bcs.similarity().compose(fit)
    x_m, y_m, angle_deg = (round(value, 4) for value in (frame.b.real, frame.b.imag, math.degrees(frame.rotation_rad)))
    moved = part.model_copy(update={"site_T_bcs": Relation(x_m=x_m, y_m=y_m, angle_deg=angle_deg)})
    write_site(root, _with_part(site, number, moved))
    checked = (
        f"the points fit to {apart_m:.2f} m" if len(pairs) > MIN_PAIRS else "a third --pair would check the points"
    )
    return SiteChange(
        (
            f"floor {number} is laid on floor {onto}: turned by {math.degrees(fit.rotation_rad):.2f}°, moved by "
            f"({shift.real:.2f}, {shift.imag:.2f}) m",
            f"{checked}; lengths differ by {abs(found.scale - 1):.1%}",
            f"written: {root / SITE_FILE}",
        ),
        (
            *_turn_notes(fit, part, base, len(pairs)),
            *(f"check that each --pair is FLOOR=ONTO: {note}" for note in floor_fit_notes(root, number)),
        ),
    )


def _turn_notes(fit: Similarity2, part: FloorPart, base: FloorPart, pairs: int) -> list[str]:
    """Report two points that turn a plan: most plans of a building are drawn the same way up."""
    turn_deg = abs(math.degrees(fit.rotation_rad))
    if pairs > MIN_PAIRS or turn_deg <= _USUAL_TURN_DEG:
        return []
    return [
        f"floor {part.number} is turned by {turn_deg:.0f}° against floor {base.number}: if both plans are drawn the "
        "same way up, the points of a --pair are not the same place, or x and y are exchanged"
    ]


def _refuse_other_scale(part: FloorPart, base: FloorPart, scale: float) -> None:
    if abs(scale - 1) > MAX_SCALE_DIFFERENCE:
        raise UsageError(
            f"the points are {scale:.3f} times as far apart on floor {base.number} as on floor {part.number}: one of "
            "the plans has a wrong size, or the points are not the same places. Correct the size with vislam2tag "
            "site set --width-m, then measure the points again"
        )


REMOVED = "removed_floor_"
"""Begins the name of the folder that keeps the files of a removed floor."""


def remove_floor(root: AnyPath, number: int) -> SiteChange:
    """Take a floor out of a site. Its files are kept in a folder of another name.

    Raises UsageError if the site has no such floor or no other one, or walks were recorded on it, OutputError if
    something cannot be written.
    """
    root = Path(root)
    site = read_site_file(root)
    part = floor_part(root, site, number)
    if len(site.floors) == 1:
        raise UsageError(f"--floor {number}: it is the only floor of the site; delete the folder {root} instead")
    _refuse_walks(root, number, " first")
    folder, kept = _folder(root, number), _free_name(root, f"{REMOVED}{number}")
    _move(root, folder, kept)
    write_site(root, _with_part(site, number, None))
    done = [f"floor {number} is removed from {root / SITE_FILE}"]
    if folder is not None:
        done.append(f"its files are kept in {root / kept}; delete them if you do not need them")
    if part.plan is not None and (root / part.plan.file).exists():
        done.append(f"its plan is kept: {root / part.plan.file}")
    entries = entries_of(corrections_text(root)[0])
    notes = [f"{CORRECTIONS_FILE} still names floor {number}: remove these entries"]
    return SiteChange(tuple(done), tuple(notes if any(one.values.get("floor") == number for one in entries) else ()))


def _refuse_walks(root: Path, number: int, then: str) -> None:
    """Raise UsageError if walks were recorded on a floor, because recordings are never changed."""
    if not _folders(root):
        return
    walks = [folder for key, folder in session_folders(root)[0] if key.floor == number]
    if walks:
        devices = sorted({str(folder.parent) for folder in walks})
        raise UsageError(
            f"floor {number} has {counted(len(walks), 'recorded walk')}, and recordings are never changed: move "
            f"{', '.join(devices)} out of the survey yourself{then}"
        )


def _folders(root: Path) -> dict[int, Path]:
    try:
        return floor_folders(root)[0]
    except SurveyError:  # no floor has a folder yet
        return {}


def _folder(root: Path, number: int) -> Path | None:
    return _folders(root).get(number)


def _free_name(root: Path, name: str) -> str:
    names: Sequence[str] = [name, *(f"{name}_{count}" for count in range(2, 1000))]
    return next(each for each in names if not (root / each).exists())


def _move(root: Path, folder: Path | None, name: str) -> None:
    if folder is None:
        return
    with survey_output(root / name):
        try:
            Folder.at(root).move(folder.name, Folder.at(root), name)
        except FileExistsError as error:
            raise OutputError(f"{root / name}: is there already; rename it") from error
