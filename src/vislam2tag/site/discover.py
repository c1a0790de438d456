"""A survey folder: its site files are read, its session folders only listed, and it is checked as a whole."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Container, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.whole_output import restore
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.folder_kinds import kind_of, survey_around, written_by
from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.extents import Box, floor_findings, landmark_findings, span_m
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, UNITS_M, Corrections
from vislam2tag.site.corrections.landmarks import corrected_landmarks
from vislam2tag.site.floors import (
    MASK_FILE,
    ROOMS_FILE,
    described_floors,
    file_in,
    ilc20_floors,
    ilc20_sessions,
    is_ilc20_site,
)
from vislam2tag.site.floors import SITE_FILES as ILC20_FILES
from vislam2tag.site.landmark_file import (
    landmarks_from,
    read_completed_file,
    read_control_points,
    read_site_landmarks,
    with_shared_errors,
)
from vislam2tag.site.landmark_states import SurveyedLandmark, names_shown
from vislam2tag.site.links import shared_site
from vislam2tag.site.model import Floor, SessionKey, Site
from vislam2tag.site.plans.load import check_image
from vislam2tag.site.settings import SurveySettings
from vislam2tag.site.site_file import FLOOR_FILE, SITE_FILE, FloorRow, has_site_file, read_floor_file, read_site_file
from vislam2tag.site.site_table import is_file, site_finding

PLAN_NAMES = ("floorplan.jpg", "floorplan.png", "floorplan.jpeg")
_SITE_FILES = (
    SITE_FILE,
    FLOOR_FILE,
    CORRECTIONS_FILE,
    *(f"floor_*/{name}" for name in ("*.csv", "*.xlsx", "floorplan.*")),
)
_ILC20_SITE_FILES = (CORRECTIONS_FILE, *ILC20_FILES)
_FLOOR_FOLDER = re.compile(r"floor_(-?\d{1,6})")


def read_site(
    root: Path,
    default_sigma_m: float = SurveySettings().landmark_sigma_m,
    landmark_file: Path | None = None,
    *,
    follow_links: bool = False,
) -> tuple[Site, tuple[Finding, ...]]:
    """Read floors, landmarks and control points of a survey folder: as its ``site.toml`` says, else as published.

    ``default_sigma_m`` is the standard deviation per axis of landmarks whose file gives none; ``landmark_file``
    replaces the floors' own landmark files. Missing and damaged site files are findings. What comes from outside the
    folder is left out, which is a finding, unless ``follow_links`` is given. Raises SurveyError where the folder is
    missing, no folder, or contains no floor, or where ``site.toml`` or ``landmark_file`` cannot be used.
    """
    restore(root)  # what `site write` makes is replaced whole
    rows, problems = list[SurveyedLandmark](), list[Finding]()
    if is_ilc20_site(root):
        floors, findings = ilc20_floors(root)
        if landmark_file is not None:
            numbers = {floor.number for floor in floors}
            rows, problems = read_completed_file(landmark_file, numbers, default_sigma_m)
    else:
        described = has_site_file(root)
        folders, findings = _numbered_folders(root) if described else floor_folders(root)
        floors, of_floors = described_floors(root, folders) if described else _published_floors(root, folders)
        findings += of_floors
        folders = {floor.number: folders.get(floor.number, root / f"floor_{floor.number}") for floor in floors}
        rows, problems = read_site_landmarks(root, folders, default_sigma_m, landmark_file)
    sides = {each.number: (each.width_m, each.height_m) for each in floors if each.width_m and each.height_m}
    findings += floor_findings(SITE_FILE if has_site_file(root) else FLOOR_FILE, sides)
    landmarks = landmarks_from(rows)
    if landmark_file is not None:
        landmarks = with_shared_errors(landmarks, landmark_file)
    return shared_site(root, Site(tuple(floors), landmarks), (*findings, *problems), follow_links=follow_links)


def _published_floors(root: Path, folders: dict[int, Path]) -> tuple[list[Floor], list[Finding]]:
    """Floors of the published layout, which are its folders, by number."""
    rows, findings = read_floor_file(root)
    findings += _without_size(folders, rows, findings)
    floors: list[Floor] = []
    for number, folder in folders.items():
        floor, floor_findings = _floor(root, folder, number, rows.get(number))
        floors.append(floor)
        findings += floor_findings
    return floors, findings


def floor_folders(root: Path) -> tuple[dict[int, Path], list[Finding]]:
    """List the ``floor_K`` folders by number; a second folder of the same number is a finding.

    Raises SurveyError where ``root`` is missing, no folder, cannot be listed, or contains no floor.
    """
    if not root.exists():
        raise SurveyError(f"{root}: no such folder; expected a survey folder with floor_K folders inside")
    if not root.is_dir():
        zipped = "; unpack it and pass the folder" if is_zipfile(root) else ""
        raise SurveyError(f"{root}: this is not a folder; expected a survey folder with floor_K folders inside{zipped}")
    folders, findings = _numbered_folders(root)
    if not folders:
        raise SurveyError(
            f"{root}: this is not a survey: it contains no folder named floor_0, floor_1, ...{_instead(root)}"
        )
    return folders, findings


def refuse_unknown_floors(site: Site, numbers: Iterable[int]) -> None:
    """Raise UsageError for the first number of a floor that a site does not have."""
    there = [floor.number for floor in site.floors]
    for number in numbers:
        if number not in there:
            raise UsageError(
                f"--floor {number}: the site does not have this floor; its floors are: {', '.join(map(str, there))}"
            )


def _instead(root: Path) -> str:
    """What a folder is that is not a survey, and what to give, where that is plain to see."""
    if survey := survey_around(root):
        return f"; it is a floor's folder, or inside one: pass the survey's folder, {survey}"
    kind = kind_of(root)
    if written_by(root) is not None or (root / "dataset.json").is_file():
        return f"; it is {kind}: pass the survey that it was made from"
    within = [path.parent for path in sorted(root.glob("*/floor_*")) if _FLOOR_FOLDER.fullmatch(path.name)]
    if within:
        return f"; pass the folder that contains them: {within[0]}"
    return f"; it is {kind}" if kind else ""


def _numbered_folders(root: Path) -> tuple[dict[int, Path], list[Finding]]:
    try:
        listed = subfolders(root)
    except OSError as error:
        raise SurveyError(f"{root}: cannot be listed: {error.strerror}") from error
    folders: dict[int, Path] = {}
    findings: list[Finding] = []
    for folder in sorted(listed, key=lambda folder: len(folder.name)):
        match = _FLOOR_FOLDER.fullmatch(folder.name)
        if match and folders.setdefault(int(match.group(1)), folder) is not folder:
            message = f"floor {int(match.group(1))} has two folders; this one is skipped: rename it"
            findings.append(site_finding("duplicate_floor", folder.name, message))
    findings += walks_in_no_floor([folder for folder in listed if not _FLOOR_FOLDER.fullmatch(folder.name)])
    return dict(sorted(folders.items())), findings


def site_files(root: Path) -> list[Path]:
    """Files that a site is made of, besides its sessions', sorted: what its labels may follow from."""
    if is_ilc20_site(root):
        found = {path for pattern in _ILC20_SITE_FILES for path in root.glob(pattern)}
    else:
        found = {path for pattern in _SITE_FILES for path in root.glob(pattern)}
    if has_site_file(root):
        plans = [root / floor.plan.file for floor in read_site_file(root).floors if floor.plan is not None]
        found |= {path for plan in plans for path in ([plan] if plan.is_file() else plan.rglob("*"))}
    return sorted(path for path in found if path.is_file())


def subfolders(folder: Path) -> list[Path]:
    """List the visible folders in a folder, sorted by name; raises OSError where it cannot be listed."""
    return sorted(entry for entry in folder.iterdir() if not entry.name.startswith(".") and entry.is_dir())


def session_folders(root: Path) -> tuple[list[tuple[SessionKey, Path]], list[Finding]]:
    """List every ``floor_K/DEVICE/SESSION`` folder, sorted by key, whatever it contains.

    Where there is a zip of that name, ``SESSION.zip``, it may contain the session in place of the folder. A floor's or
    device's folder that cannot be listed is a finding. A site of the Indoor Location Competition 2.0 has files in place
    of sessions' folders.
    """
    if is_ilc20_site(root):
        return ilc20_sessions(root), []
    found: list[tuple[SessionKey, Path]] = []
    findings: list[Finding] = []

    def inside(folder: Path) -> list[Path]:
        try:
            return subfolders(folder)
        except OSError as error:
            message = (
                f"the folder cannot be opened ({error.strerror}): nothing in it is processed; check its permissions"
            )
            name = folder.relative_to(root).as_posix()
            findings.append(site_finding("unreadable_folder", name, message, Severity.ERROR))
            return []

    for number, floor_folder in floor_folders(root)[0].items():
        for device in inside(floor_folder):
            zipped = {path.with_suffix("") for path in device.glob("[!.]*.zip") if path.is_file()}
            folders = sorted(zipped.union(inside(device)))
            found += [(SessionKey(number, device.name, folder.name), folder) for folder in folders]
    return found, findings


def zip_of(session: Path) -> Path | None:
    """The zip that is beside a session's folder, or in its place; None where there is none."""
    path = session.with_name(f"{session.name}.zip")
    return path if is_file(path) else None


def _floor(root: Path, folder: Path, number: int, row: FloorRow | None) -> tuple[Floor, list[Finding]]:
    control_points, findings = read_control_points(root, folder)
    plan, plan_findings = _plan(folder)
    floor = Floor(
        number=number,
        name=row.name if row and row.name else f"Floor {number}",
        width_m=row.width_m if row else None,
        height_m=row.height_m if row else None,
        elevation_m=row.elevation_m if row else None,
        plan=plan,
        control_points=control_points,
        mask=file_in(folder, MASK_FILE),
        rooms=file_in(folder, ROOMS_FILE),
    )
    return floor, findings + plan_findings


def _without_size(folders: dict[int, Path], rows: Container[int], floor_findings: list[Finding]) -> list[Finding]:
    """Report floors without a row, unless the whole file is known not to have been read."""
    if any(finding.kind in ("missing_file", "unreadable_file") for finding in floor_findings):
        return []
    message = "floor {} has no usable row; its extent is taken from the data"
    return [
        site_finding("floor_without_size", FLOOR_FILE, message.format(number))
        for number in folders
        if number not in rows
    ]


def _plan(folder: Path) -> tuple[Path | None, list[Finding]]:
    """The image that a floor's folder has as its plan, checked."""
    try:
        plan = next((folder / name for name in PLAN_NAMES if is_file(folder / name)), None)
    except OSError:  # the folder's own finding reports it
        return None, []
    if plan is None:
        message = f"there is no plan ({' or '.join(PLAN_NAMES[:2])}); a metric grid is drawn instead"
        return None, [site_finding("missing_plan", f"{folder.name}/{PLAN_NAMES[0]}", message, Severity.INFO)]
    try:
        check_image(plan)
    except OSError as error:
        message = f"the plan {error}: replace it; until then, a metric grid is drawn"
        return plan, [site_finding("unreadable_plan", f"{folder.name}/{plan.name}", message)]
    return plan, []


BESIDE_M = 5.0
"""Landmarks further beside the plan than this hang on no wall of it."""
MIN_SPREAD = 0.2
"""Landmarks in their true unit are spread over at least this share of the plan's longer side."""
POSES = ("poses.csv", "CameraPose.csv")
"""Names of the file that distinguishes walks."""
LEAST_BYTES = 10_000
"""Poses of a walk of some seconds have more; less may be alike by chance."""


def landmarks_off_plan(site: Site, corrections: Corrections) -> list[Finding]:
    """Find floors whose landmarks, as corrected, span too little or too much, or lie far off the plan: they are in
    another unit or frame, or x and y are exchanged.
    """
    found: list[Finding] = []
    for floor in site.floors:
        any_session = SessionKey(floor.number, "", "")
        tables = (*corrections.landmark_units, *corrections.turn_landmarks)
        if any(entry.floor == floor.number and not entry.applies(any_session) for entry in tables):
            continue  # the table is another one for some sessions
        here, _ = corrected_landmarks(site.landmarks.on_floor(floor.number), corrections, any_session)
        extent_m = floor.extent_m
        sides = None if extent_m is None else (extent_m[1] - extent_m[0], extent_m[3] - extent_m[2])
        found += landmark_findings(floor.number, here.position_bcs, sides)
        if extent_m is None:
            continue
        left, right, low, high = extent_m
        x, y = here.position_bcs.T
        beside_m = np.maximum.reduce((left - x, x - right, low - y, y - high))
        off = [here.ids[i] for i in np.flatnonzero(here.surveyed & (beside_m > BESIDE_M)).tolist()]
        if off:
            found.append(_off_plan(floor.number, off, here.position_bcs[here.surveyed], extent_m))
    return found


def _off_plan(number: int, off: list[str], position_bcs: FloatArray, extent_m: Box) -> Finding:
    """Report landmarks of a floor, whose landmarks are at positions (k, 2), outside its plan, and the likely cause."""
    unit = next((unit for unit, metres in UNITS_M.items() if _on_plan(position_bcs * metres, extent_m)), None)
    left, right, low, high = extent_m
    if _on_plan(position_bcs[:, ::-1], extent_m):
        message = (
            f"landmarks of floor {number} ({names_shown(off)}) are outside its plan, and all would be on it with x and "
            "y exchanged: correct the table, or run vislam2tag diagnose"
        )
    elif unit is not None:
        message = (
            f"landmarks of floor {number} ({names_shown(off)}) are outside its plan, and all would be on it in {unit}: "
            f"write them in metres, or add [[landmark_units]] with floor = {number} and unit = '{unit}' to "
            "corrections.toml"
        )
    else:
        message = (
            f"{len(off)} of {len(position_bcs)} landmarks of floor {number} ({names_shown(off)}) are more than "
            f"{BESIDE_M:g} m outside its plan, which has x from {left:g} to {right:g} and y from {low:g} to {high:g} "
            "m. Check that they are in metres, from the plan's origin, x before y. To detect wrong units and "
            "mirrored tables from the walks, run vislam2tag diagnose"
        )
    return Finding(kind="landmarks_off_plan", file="", count=len(off), message=message)


def _on_plan(position_bcs: FloatArray, extent_m: Box) -> bool:
    """Whether all positions (k, 2) are on a plan, and are spread over it."""
    left, right, low, high = extent_m
    least, greatest = np.array((left, low)) - BESIDE_M, np.array((right, high)) + BESIDE_M
    on = bool(((position_bcs >= least) & (position_bcs <= greatest)).all())
    return on and span_m(position_bcs) >= MIN_SPREAD * max(right - left, high - low)


def walks_in_no_floor(folders: Sequence[Path]) -> list[Finding]:
    """Find folders with walks (DEVICE/SESSION) whose names are not those of floors, and which nothing reads."""
    message = (
        "it contains walks, but only folders named floor_1, floor_2, ... are floors, so it is skipped: rename it, "
        "or, if it is another building, make it a survey of its own"
    )
    with_walks = [folder for folder in folders if any(next(folder.glob(f"*/*/{name}"), None) for name in POSES)]
    return [site_finding("unrecognised_folder", folder.name, message) for folder in with_walks]


def walks_twice(root: Path, sessions: Sequence[tuple[SessionKey, Path]]) -> list[Finding]:
    """Find sessions that are copies of others: their poses are the same to the byte."""
    sizes = defaultdict(list)
    for _, folder in sessions:
        for path in (folder / name for name in POSES):
            with suppress(OSError):  # what cannot be read has a finding of its own
                if path.is_file() and (size := path.stat().st_size) >= LEAST_BYTES:
                    sizes[size].append(path)
    found = []
    for paths in sizes.values():
        contents: dict[bytes, Path] = {}
        for path in paths if len(paths) > 1 else ():
            try:
                first = contents.setdefault(read_bytes(path), path)
            except OSError:
                continue
            if first is not path:
                message = (
                    f"contains the same walk as {first.parent.relative_to(root).as_posix()}: it would count twice; "
                    "remove one of the two, or exclude it with [[exclude_session]] in corrections.toml"
                )
                name = path.parent.relative_to(root).as_posix()
                found.append(site_finding("walk_twice", name, message))
    return found
