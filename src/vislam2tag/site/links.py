"""Links below a folder that others may have made (a survey, labels, a data set): where they lead.

Reading follows links, as shared disks, git-annex and DVC need it. What leaves the machine leaves out what comes from
outside the folder, unless ``--follow-links`` is given. Hard links cannot be distinguished from files. Commands that
write into a survey never follow a link.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.stored_folder import outline_of
from vislam2tag.common.findings import ROWS_NAMED, Finding, FindingKind, Severity, finding_if
from vislam2tag.common.records import Record
from vislam2tag.site.model import ControlPoints, Floor, Site, Survey
from vislam2tag.site.site_file import FLOOR_FILE, SITE_FILE, read_site_file

CURE = "pass --follow-links to include them"
_MAX_LINKS = 40
"""Links on the way of one path, as Linux allows them: more are a loop."""


class Link(Record):
    """A link below a folder."""

    name: str
    """Path below the folder."""
    target: str
    """As the link says it."""
    outside: bool
    """It leads outside the folder, or passes a link outside it."""
    broken: bool
    """Nothing is at its end, or it leads to itself."""


def _followed(root: Path, path: Path) -> tuple[Path, bool, bool]:
    """Follow a path link by link: where it leads, whether that or a link on the way is outside, whether it is broken.

    Neither ``root`` nor what is above it is a link.
    """
    at, outside, links = Path(path.anchor), False, 0
    parts = list(path.parts[1:][::-1])
    while parts:
        part = parts.pop()
        here = at.parent if part == ".." else at / part
        if part == ".." or not os.path.islink(here):  # nor are files without permission  # noqa: PTH114
            at = here
            continue
        outside |= not here.is_relative_to(root)
        links += 1
        if links > _MAX_LINKS:
            return here, outside, True
        target = here.readlink()
        if target.anchor:
            at = Path(at.anchor, target.anchor)
        parts += target.parts[bool(target.anchor) :][::-1]
    return at, outside or not at.is_relative_to(root), not os.path.lexists(at)


def links_in(root: Path) -> Iterator[Link]:
    """All links below a folder, folder by folder; one in a store has none."""
    if outline_of(root) is not None:
        return
    top = root.resolve()
    waiting = [top]
    while waiting:
        for entry in _entries(waiting.pop()):
            path = Path(entry.path)
            if entry.is_symlink():
                _, outside, broken = _followed(top, path)
                name, target = (_text(str(one)) for one in (path.relative_to(top).as_posix(), path.readlink()))
                yield Link(name=name, target=target, outside=outside, broken=broken)
            elif entry.is_dir(follow_symlinks=False):
                waiting.append(path)


def outside_link(root: Path, path: Path) -> str | None:
    """The part of a path below ``root`` that leads outside it, ``floor_0/floorplan.png``; None where none does."""
    if outline_of(root) is not None:
        return None
    top = root.resolve()
    try:
        name = path.relative_to(root)
    except ValueError:
        return _text(str(path))
    for part in (*list(name.parents)[-2::-1], name):
        if ".." not in part.parts and _followed(top, top / part)[1]:
            return _text(part.as_posix())
    return _text(name.as_posix()) if _followed(top, top / name)[1] else None


def is_from_outside(root: Path, paths: Iterable[Path]) -> bool:
    """Whether one of these files or folders, or anything within them, comes from outside ``root`` by a link."""
    if outline_of(root) is not None:
        return False
    top = root.resolve()
    looked_at: set[Path] = set()
    waiting = []
    for path in paths:
        if outside_link(root, path) is not None:
            return True
        waiting.append(_followed(top, top / path.relative_to(root))[0])
    while waiting:
        folder = waiting.pop()
        if folder in looked_at:
            continue
        looked_at.add(folder)
        for entry in _entries(folder):
            if entry.is_symlink():
                end, outside, _ = _followed(top, Path(entry.path))
                if outside:
                    return True
                waiting.append(end)
            elif entry.is_dir(follow_symlinks=False):
                waiting.append(Path(entry.path))
    return False


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    """What is in a folder, sorted; nothing where it is a file or cannot be listed (which findings report)."""
    try:
        with os.scandir(folder) as found:
            return sorted(found, key=lambda entry: entry.name)
    except OSError:
        return []


def _text(name: str) -> str:
    return os.fsencode(name).decode("utf-8", errors="replace")


def link_findings(links: Sequence[Link]) -> list[Finding]:
    """Say of a survey's links how many there are, which lead outside it and which are broken."""
    outside = (
        "links lead outside the survey; their files are read, but pages, exports and data sets exclude them unless "
        "you pass --follow-links"
    )
    broken = "links lead to missing files or to themselves; fetch the files, or remove the links"
    kinds: tuple[tuple[FindingKind, Severity, Sequence[Link], str], ...] = (
        ("links", Severity.INFO, links, "links are followed"),
        ("links_outside", Severity.WARNING, [link for link in links if link.outside], outside),
        ("broken_links", Severity.WARNING, [link for link in links if link.broken], broken),
    )
    findings: list[Finding] = []
    for kind, severity, found, message in kinds:
        shown = ", ".join(f"{one.name} -> {one.target}" for one in found[:ROWS_NAMED])
        more = ", ..." if len(found) > ROWS_NAMED else ""
        findings += finding_if(len(found), kind, f"{message}: {shown}{more}", severity=severity)
    return findings


def left_out_sessions(names: Sequence[str], *, named: bool) -> Finding:
    """Say that sessions are left out of what is shared; ``named`` for the user alone, not for what is shared."""
    message = "sessions are excluded, because links lead to their files outside the survey"
    which = f": {', '.join(names)}" if named else ""
    return Finding(kind="from_outside", file="", count=len(names), message=f"{message}{which}; {CURE}")


def left_out_files(names: Sequence[str]) -> Finding:
    """Say which files of a survey are left out of what is shared."""
    message = f"files are excluded, because links lead to them outside the survey: {', '.join(names)}; {CURE}"
    return Finding(kind="from_outside", file="", count=len(names), message=message)


def refuse_outside_plan(root: Path, floor: Floor) -> None:
    """Raise SurveyError for a floor whose plan comes from outside the survey, where all that is made would show it."""
    if floor.plan is not None and outside_link(root, floor.plan) is not None:
        raise SurveyError(f"{floor.plan}: a link leads to this plan outside the survey; pass --follow-links to use it")


def site_name(root: Path, *, follow_links: bool = False) -> str:
    """What ``site.toml`` calls the building; empty where there is none, or where it comes from outside."""
    path = root / SITE_FILE
    own = path.is_file() and (follow_links or outside_link(root, path) is None)
    return read_site_file(root).name if own else ""


def left_out_of(findings: Iterable[Finding]) -> list[Finding]:
    """Those of a site's findings that name what is left out."""
    return [finding for finding in findings if finding.kind == "from_outside"]


def shared_site(
    root: Path, site: Site, findings: Sequence[Finding], *, follow_links: bool = False
) -> tuple[Site, tuple[Finding, ...]]:
    """Leave out what comes from outside the survey's folder: plans, masks, rooms, landmarks and control points.

    The findings are those that are not about files from outside, and one that names what was left out. Where the
    file that describes all floors comes from outside, their names and georeferences are left out.
    """
    if follow_links or outline_of(root) is not None:
        return site, tuple(findings)
    links = _OutsideLinks(root)
    unnamed = _described_from_outside(root, links)
    marks = site.landmarks
    rows = [i for i, source in enumerate(marks.source) if not links.lead_to(_file_of(source))]
    landmarks = marks.select(rows) if len(rows) < len(marks.source) else marks
    floors = [_shared_floor(floor, links) for floor in site.floors]
    if unnamed:
        floors = [replace(floor, name=f"Floor {floor.number}", georeference=None) for floor in floors]
    left_out = links.found
    kept = [finding for finding in findings if not (finding.file and links.lead_to(finding.file))]
    if left_out:
        kept.append(left_out_files(left_out))
    return replace(site, floors=tuple(floors), landmarks=landmarks), tuple(kept)


def is_described_from_outside(root: Path) -> bool:
    """Whether the file that describes all floors of a survey comes from outside."""
    return _described_from_outside(root, _OutsideLinks(root))


def _described_from_outside(root: Path, links: _OutsideLinks) -> bool:
    return any([links.lead_to(name) for name in (SITE_FILE, FLOOR_FILE) if (root / name).exists()])  # noqa: C419 - each is noted


def shared_survey(survey: Survey, *, follow_links: bool = False) -> Survey:
    """The survey as :func:`shared_site` leaves it; its sessions stay."""
    site, findings = shared_site(survey.root, survey.site, survey.findings, follow_links=follow_links)
    return replace(survey, site=site, findings=findings)


class _OutsideLinks:
    """Which files of a survey come from outside, each looked at once."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._links: dict[Path, str | None] = {}

    def lead_to(self, file: Path | str) -> bool:
        """Whether a file comes from outside; a path includes the survey's folder, a name is relative to it."""
        path = file if isinstance(file, Path) else self._root / file
        if path not in self._links:
            self._links[path] = outside_link(self._root, path)
        return self._links[path] is not None

    @property
    def found(self) -> tuple[str, ...]:
        """Names of the links so far."""
        return tuple(dict.fromkeys(link for link in self._links.values() if link is not None))


def _shared_floor(floor: Floor, links: _OutsideLinks) -> Floor:
    plan, mask, rooms = (
        None if path is None or links.lead_to(path) else path for path in (floor.plan, floor.mask, floor.rooms)
    )
    return replace(floor, plan=plan, mask=mask, rooms=rooms, control_points=_shared_points(floor.control_points, links))


def _shared_points(points: ControlPoints, links: _OutsideLinks) -> ControlPoints:
    rows = [i for i, source in enumerate(points.source) if not links.lead_to(_file_of(source))]
    if len(rows) == len(points.source):
        return points
    ids, sources = (tuple(names[i] for i in rows) for names in (points.ids, points.source))
    return ControlPoints(ids, points.position_bcs[rows], sources)


def _file_of(source: str) -> str:
    """``floor_1/marker_dict.csv`` of ``floor_1/marker_dict.csv:3``."""
    return source.rpartition(":")[0]


def write_in_survey(root: Path, path: Path, content: bytes | str) -> None:
    """Write a file below a survey's folder, whole; links below ``root`` are never followed.

    Raises OutputError if it cannot be written, which names the link if one is in the way.
    """
    with survey_output(path):
        Folder.at(root).write(path.relative_to(root).as_posix(), content)


@contextmanager
def survey_output(path: Path) -> Iterator[None]:
    """Raise OutputError for OSError in the block; it names the link that is in the way, or else ``path``."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OutputError(f"{error.filename}: {error.strerror}") from error
        cure = "; check its permissions" if isinstance(error, PermissionError) else ""
        raise OutputError(f"{path}: cannot be written ({error.strerror}){cure}") from error
