"""Landmarks that a session may use: of its own floor, of floors where it went, and as other sessions place them.

Also whether the ids that walks logged are those of the tables: other names, or names shifted by a constant.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding, Severity, finding_if
from vislam2tag.core.arrays import FloatArray, IntArray, joint_columns
from vislam2tag.core.context import Storeys, ToldFloors
from vislam2tag.core.limits import MAX_DIAGNOSED_PASSES, MAX_LANDMARKS
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, longest_section
from vislam2tag.estimation.heights import vertical_span_m
from vislam2tag.estimation.observations import FEWEST_FRAMES, WalkObservations
from vislam2tag.estimation.settings import SmootherSettings
from vislam2tag.intake.ids import IdComparison, IdShift, compare_ids, shift_by_geometry
from vislam2tag.sessions.model import Session
from vislam2tag.site.corrections.file import Corrections, SetLandmarkFloor
from vislam2tag.site.model import SessionKey, Site

CLIMB_M = 1.5
"""One landmark of another floor is believed where the walk went up or down by this; two are believed anyway."""
SAME_PLACE_M = 1e-3
"""Two entries of one id this near each other are one landmark: files give millimetres."""


class AmbiguousLandmarksError(SessionError):
    """A session saw an id that two floors have at different places."""


def ids_of_other_floors(landmarks: Landmarks, own: int, logged: Sequence[str]) -> tuple[str, ...]:
    """Logged ids that only landmark files of other floors than a session's own have.

    None where no one surveyed the own floor: then other floors' ids say nothing.
    """
    here = {name for name, floor in zip(landmarks.ids, landmarks.floor.tolist(), strict=True) if floor == own}
    return tuple(name for name in logged if name not in here and name in landmarks.index) if here else ()


def candidate_landmarks(site: Site, own: int, logged: Sequence[str], told: Sequence[int] = ()) -> Landmarks:
    """All landmarks that matter to a session that logged these ids: its own floor's, or those of all floors.

    ``told`` are floors that the walker said to be on.

    Ids may repeat from floor to floor. ``storeys`` are filled accordingly.
    """
    landmarks = site.landmarks
    if ids_of_other_floors(landmarks, own, logged) or set(told) - {own}:
        numbers = np.unique(np.concatenate((landmarks.floor, [own, *told, *(floor.number for floor in site.floors)])))
        return replace(landmarks, storeys=_storeys(site, own, numbers.astype(np.int64)))
    return replace(landmarks.on_floor(own), storeys=_storeys(site, own, np.array([own], dtype=np.int64)))


def _storeys(site: Site, own: int, numbers: IntArray) -> Storeys:
    """The floors with these numbers (s,), sorted, and their elevations."""
    known = {floor.number: floor.elevation_m for floor in site.floors if floor.elevation_m is not None}
    return Storeys(own, numbers, np.array([known.get(number, np.nan) for number in numbers.tolist()]))


def with_fewer_landmarks(session: Session, surveyed: Collection[str]) -> Session:
    """A session with at most :data:`~vislam2tag.core.limits.MAX_LANDMARKS` landmarks in its log.

    Surveyed ones count first, then those that were logged most often.
    """
    log = session.landmarks
    if len(log.ids) <= MAX_LANDMARKS:
        return session
    unknown = np.array([name not in surveyed for name in log.ids])
    order = np.lexsort((-np.diff(log.offsets), unknown))
    kept = np.sort(order[:MAX_LANDMARKS]).tolist()
    name = next((file.name for file in session.files if file.role == "landmarks"), "")
    message = (
        f"{len(log.ids):,} landmarks are logged, but a session may have at most {MAX_LANDMARKS:,}; surveyed "
        "ones and those logged most often are used: remove those that do not exist"
    )
    left_out = len(log.ids) - len(kept)
    finding = Finding(kind="too_many_landmarks", file=name, count=left_out, message=message)
    return replace(session, landmarks=log.select(kept), findings=(*session.findings, finding))


def landmarks_of_session(
    considered: Landmarks, key: SessionKey, camera: CameraTrack, log: LandmarkLog, named: Sequence[str] = ()
) -> tuple[Landmarks, tuple[str, ...]]:
    """Choose among the considered landmarks (see :func:`candidate_landmarks`) those that the session may use.

    Their ids are unique; they come with the storeys that the session may be on, and with the logged ids that only other
    floors know and that nothing else speaks for.

    It went to other floors if the collector chose them (``camera.told_floors``) or if its corrections say so
    (``named``: what they call sheets of other floors). It also did if it logged two landmarks that only they have, or
    one and it went up or down by :data:`CLIMB_M`. Raises AmbiguousLandmarksError where it did and a logged id then is
    in two places.
    """
    elsewhere = ids_of_other_floors(considered, key.floor, log.ids)
    told = camera.told_floors is not None and bool((camera.told_floors.floor != key.floor).any())
    sure = told or len(elsewhere) > 1 or not set(elsewhere).isdisjoint(named)
    if not sure and not (elsewhere and vertical_span_m(camera, log) >= CLIMB_M):
        return _own_floor(considered, key.floor), elsewhere
    own = set(considered.on_floor(key.floor).ids)
    # If the collector logged the floors, an id that the own floor has was seen there: with_told_floors.
    _refuse_clashes(considered, key, [name for name in log.ids if not (told and name in own)], elsewhere)
    # Of an id with one place on several floors the own floor's entry counts, then the lowest floor's.
    order = np.lexsort((considered.floor, considered.floor != key.floor))
    first = {considered.ids[i]: i for i in reversed(order.tolist())}
    return considered.select(sorted(first.values())), ()


def ambiguous_landmarks(landmarks: Landmarks, own: int, logged: Sequence[str]) -> Landmarks:
    """Of all floors' landmarks those that make it doubtful on which floor a session was, in pairs.

    A landmark of the session's own floor that it logged is followed by one of the same id elsewhere on another floor.
    None where the session logged a landmark that only other floors have: then these show where it went.
    """
    if ids_of_other_floors(landmarks, own, logged):
        return landmarks.select([])
    own_first = landmarks.select(np.lexsort((landmarks.floor, landmarks.floor != own)).tolist())
    pairs = {name: (one, other) for name, one, other in clashes(own_first, logged) if own_first.floor[one] == own}
    return own_first.select([row for pair in pairs.values() for row in pair])


def ambiguous_floor(landmarks: Landmarks, key: SessionKey, camera: CameraTrack, log: LandmarkLog) -> list[Finding]:
    """Report a walk that went up or down by :data:`CLIMB_M` and logged only ids that its own floor shares with others.

    ``landmarks`` are all floors'. No error: ids repeat by layout, and a tracker's vertical axis may have drifted.
    """
    pairs = ambiguous_landmarks(landmarks, key.floor, log.ids)
    if not pairs.ids or (span_m := vertical_span_m(camera, log)) < CLIMB_M:
        return []
    message = (
        f"the walk went up or down by {span_m:.1f} m, but its landmarks do not show to which floor. For instance, "
        f"landmark {pairs.ids[0]} is on floor {pairs.floor[0]}{_line(pairs, 0)} and elsewhere on floor "
        f"{pairs.floor[1]}{_line(pairs, 1)}. All were assigned to floor {key.floor}. If the walk went to another "
        "floor, give the sheets ids that differ between floors, or exclude that time with [[exclude_span]] in "
        "corrections.toml"
    )
    return [Finding(kind="ambiguous_floor", file="", count=len(pairs.ids) // 2, message=message)]


def _own_floor(considered: Landmarks, own: int) -> Landmarks:
    """The landmarks and the storey of one floor alone."""
    storeys = considered.storeys
    if storeys is not None:
        here = storeys.number == own
        storeys = Storeys(own, storeys.number[here], storeys.elevation_m[here])
    return replace(considered.on_floor(own), storeys=storeys)


def _refuse_clashes(landmarks: Landmarks, key: SessionKey, logged: Sequence[str], elsewhere: Sequence[str]) -> None:
    """Raise AmbiguousLandmarksError where a logged id is on two floors at places that are not known to be one."""
    for name, one, other in clashes(landmarks, logged):
        raise AmbiguousLandmarksError(
            f"{key}: observed landmark {', '.join(elsewhere)}, which only other floors have, and landmark {name}, "
            f"which two floors have at different places: floor {landmarks.floor[one]}{_line(landmarks, one)} and "
            f"floor {landmarks.floor[other]}{_line(landmarks, other)}. Run `vislam2tag diagnose` to find which sheet "
            "it observed when, or exclude both with [[exclude_landmark]] in corrections.toml, and give one of them "
            f"another id for later walks. If the walk never left floor {key.floor}, add landmark "
            f"{', '.join(elsewhere)} to its marker_dict.csv"
        )


def clashes(landmarks: Landmarks, logged: Sequence[str]) -> Iterator[tuple[str, int, int]]:
    """Find logged ids whose first row and a further one lie at places that are not known to be one: id, both rows."""
    rows = defaultdict(list)
    for row, name in enumerate(landmarks.ids):
        rows[name].append(row)
    for name in logged:
        for other in rows[name][1:]:
            apart = np.abs(landmarks.position_bcs[other] - landmarks.position_bcs[rows[name][0]])
            if not (apart <= SAME_PLACE_M).all():
                yield name, rows[name][0], other


def _line(landmarks: Landmarks, row: int) -> str:
    return f" ({landmarks.source[row]})" if landmarks.source else ""


_REASON = "the collector chose this floor"


def floors_told(session: Session) -> tuple[int, ...]:
    """Numbers of the floors that the walker said to be on, sorted; none where no one said so."""
    told = session.camera.told_floors
    return () if told is None else tuple(np.unique(told.floor).tolist())


def on_known_floors(session: Session, site: Site) -> Session:
    """Leave out logged floors that the survey does not have, and report them."""
    told = session.camera.told_floors
    if told is None:
        return session
    known = np.isin(told.floor, [floor.number for floor in site.floors])
    if known.all():
        return session
    unknown = ", ".join(map(str, np.unique(told.floor[~known]).tolist()))
    message = (
        f"the collector chose floor {unknown}, which the survey does not have: the data after that is assigned to "
        f"the previous floor; add the floor ({page_of('how-to/site')}), or exclude this time with [[exclude_span]]"
    )
    finding = Finding(kind="unknown_told_floor", file="Events.csv", count=int((~known).sum()), message=message)
    kept = ToldFloors(told.time_ns[known], told.floor[known]) if known.any() else None
    return replace(session, camera=replace(session.camera, told_floors=kept), findings=(*session.findings, finding))


def with_told_floors(corrections: Corrections, session: Session, landmarks: Landmarks) -> Corrections:
    """Add an entry for each sheet on a floor that the collector logged, if another floor has the same id.

    ``landmarks`` are all floors'. From the logged moment to the next one, sightings of such an id are assigned to the
    logged floor. Entries of the file for an id and session take precedence.
    """
    told, camera = session.camera.told_floors, session.camera
    if told is None or not camera.usable.any():
        return corrections
    said = {entry.id for entry in corrections.set_landmark_floor if entry.applies(session.key)}
    floors_of = Counter(landmarks.ids)
    places = set(zip(landmarks.floor.tolist(), landmarks.ids, strict=True))
    key = {"floor": session.key.floor, "device": session.key.device, "session": session.key.session}
    start_ns = int(camera.time_ns[camera.usable][0])
    ends_ns = [*told.time_ns[1:].tolist(), None]
    entries = []
    for begin_ns, end_ns, floor in zip(told.time_ns.tolist(), ends_ns, told.floor.tolist(), strict=True):
        for name in _seen_within(session, begin_ns, end_ns) if floor != session.key.floor else ():
            if (floor, name) in places and floors_of[name] > 1 and name not in said:
                to_s = float("inf") if end_ns is None else (end_ns - start_ns) * 1e-9
                span = {"from_s": (begin_ns - start_ns) * 1e-9, "to_s": to_s}
                entries.append(
                    SetLandmarkFloor.model_validate({"id": name, "to": floor, **key, **span, "reason": _REASON})
                )
    added = (*corrections.set_landmark_floor, *entries)
    return corrections.model_copy(update={"set_landmark_floor": added}) if entries else corrections


def _seen_within(session: Session, begin_ns: int, end_ns: int | None) -> list[str]:
    """Ids that were logged from one moment to another (None: the end), boot-clock ns."""
    log: LandmarkLog = session.landmarks
    at_ns = session.camera.time_ns[log.frame]
    inside = (at_ns >= begin_ns) & (at_ns < (np.iinfo(np.int64).max if end_ns is None else end_ns))
    return [log.ids[number] for number in np.unique(log.landmark[inside]).tolist()]


@dataclass(frozen=True)
class ToldLandmarks:
    """``k`` landmarks by id and floor: ``position_bcs`` (k, 2) metres; ``heading_rad`` (k,), NaN where not known;
    ``joint_covariance`` (3k, 3k) of x, y of each, then of all headings (m^2, m rad, rad^2).
    """

    ids: tuple[str, ...]
    floor: IntArray
    position_bcs: FloatArray
    heading_rad: FloatArray
    joint_covariance: FloatArray
    sessions: int
    """How many other sessions observed them."""

    def onto(self, landmarks: Landmarks) -> Landmarks:
        """The landmarks of a session, ids unique, at the given positions; those that it does not list are added."""
        new = [i for i, name in enumerate(self.ids) if name not in landmarks.index]
        whole = _with_unsurveyed(landmarks, tuple(self.ids[i] for i in new), self.floor[new])
        rows = np.array([whole.index[name] for name in self.ids], dtype=np.int64)
        own = np.concatenate((whole.covariance_bcs[:, (0, 1), (0, 1)].ravel(), whole.heading_sigma_rad**2))
        joint = np.diag(own)
        x = 2 * np.arange(len(whole.ids))
        joint[x, x + 1], joint[x + 1, x] = whole.covariance_bcs[:, 0, 1], whole.covariance_bcs[:, 1, 0]
        column = joint_columns(rows, len(whole.ids))
        joint[column] = joint[:, column] = 0
        joint[np.ix_(column, column)] = self.joint_covariance
        headed = rows[np.isfinite(self.heading_rad)]
        position, heading, sigma = whole.position_bcs.copy(), whole.heading_rad.copy(), whole.heading_sigma_rad.copy()
        position[rows], heading[rows], sigma[rows] = self.position_bcs, self.heading_rad, np.nan
        variance = np.diag(joint)
        sigma[headed] = np.sqrt(variance[2 * len(whole.ids) + headed])
        covariance = whole.covariance_bcs.copy()
        covariance[rows] = joint[(2 * rows[:, None] + (0, 1))[:, :, None], (2 * rows[:, None] + (0, 1))[:, None, :]]
        placed = replace(whole, position_bcs=position, covariance_bcs=covariance, joint_covariance=joint)
        return replace(placed, heading_rad=heading, heading_sigma_rad=sigma)


def _with_unsurveyed(landmarks: Landmarks, ids: tuple[str, ...], floor: IntArray) -> Landmarks:
    """The landmarks and further ones on these floors (k,), as if no one had surveyed them."""
    unknown, infinite = np.full(len(ids), np.nan), np.tile(np.diag((np.inf, np.inf)), (len(ids), 1, 1))
    return replace(
        landmarks,
        ids=(*landmarks.ids, *ids),
        floor=np.concatenate((landmarks.floor, floor)),
        position_bcs=np.concatenate((landmarks.position_bcs, np.full((len(ids), 2), np.nan))),
        covariance_bcs=np.concatenate((landmarks.covariance_bcs, infinite)),
        z_m=np.concatenate((landmarks.z_m, unknown)),
        heading_rad=np.concatenate((landmarks.heading_rad, unknown)),
        heading_sigma_rad=np.concatenate((landmarks.heading_sigma_rad, unknown)),
        source=(*landmarks.source, *("" for _ in ids)) if landmarks.source else (),
    )


SAME_IDS = "use the ids of the table in the app, or write the logged ids into the first column of marker_dict.csv"
"""What to do."""


def compared_with_logs(landmarks: Landmarks, logged: Mapping[int, Iterable[str]]) -> dict[int, IdComparison]:
    """Compare the ids that all walks of each floor logged with the tables, for floors where they are of other kinds.

    Ids of other floors' tables count as known: a walk may go there. Floors without a table are left out.
    """
    every = set(landmarks.ids)
    found = {}
    for floor, names in sorted(logged.items()):
        table = landmarks.on_floor(floor).ids
        seen = tuple(name for name in sorted(set(names), key=_natural) if name not in every or name in table)
        if not table or not seen:
            continue
        elsewhere = len(seen) < len(set(names))
        one = compare_ids(table, seen, (f"the landmark table of floor {floor}", "the phones' log there"))
        if one.differ and (one.pattern is not None or not elsewhere):
            found[floor] = one
    return found


def other_ids_findings(landmarks: Landmarks, logged: Mapping[int, Iterable[str]]) -> list[Finding]:
    """Report floors whose walks logged ids of another kind than the table has."""
    found: list[Finding] = []
    for one in compared_with_logs(landmarks, logged).values():
        message = f"the ids do not match: {one.text}. Landmarks without a match are unsurveyed: {SAME_IDS}"
        found += finding_if(len(one.unknown), "other_ids", message, severity=Severity.ERROR)
    return found


def shifted_ids_findings(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> list[Finding]:
    """Report a walk whose ids are all shifted against the table's, by the distances between its landmarks."""
    if (found := walk_id_shift(camera, log, landmarks)) is None:
        return []
    message = (
        f"the ids seem to be shifted: {found.text}; the walk's labels are wrong. The phone logged landmarks "
        f"{', '.join(sorted(log.ids, key=_natural)[:5])}, ...: {SAME_IDS}"
    )
    return [*finding_if(len(log.ids), "shifted_ids", message, severity=Severity.ERROR)]


def walk_id_shift(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> IdShift | None:
    """The constant by which a walk's ids are shifted, by where the tracker's continuous path puts each landmark passed.

    None if they are not shifted, or the walk cannot show it.
    """
    camera, log = longest_section(camera, log)
    if np.count_nonzero(camera.usable) < FEWEST_FRAMES or not len(log.frame):
        return None
    walk = WalkObservations.of(camera, log, SmootherSettings().sighting_range_m).first(MAX_DIAGNOSED_PASSES)
    at = walk.odometry.path[walk.passes.at]
    way_m = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(at))))) if len(at) else np.empty(0)
    return shift_by_geometry(
        [walk.ids[i] for i in walk.passes.landmark.tolist()], at + walk.passes.offset, way_m, _own_places(landmarks)
    )


def _own_places(landmarks: Landmarks) -> dict[str, complex]:
    """Where surveyed landmarks are, those of the walk's own floor if there are several floors."""
    known = landmarks.surveyed
    if landmarks.storeys is not None:
        known = known & (landmarks.floor == landmarks.storeys.own)
    return {landmarks.ids[i]: complex(*landmarks.position_bcs[i]) for i in np.flatnonzero(known).tolist()}


def _natural(name: str) -> tuple[int, int, str]:
    """Numbers by their value, then names."""
    return (0, int(name), "") if name.isdecimal() else (1, 0, name)
