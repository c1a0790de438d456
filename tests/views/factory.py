"""Hand-made surveys and results that look like real ones, without reading or mapping anything."""

from __future__ import annotations

import hashlib
import itertools
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.common.error_statistics import counts_of
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import EventKind
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import (
    CandidatePath,
    ContradictionMark,
    Drawing,
    ErrorRecord,
    EventMark,
    FileAccount,
    PlacingRecord,
    Polyline,
    ScanStatistics,
    SessionResult,
    SigmaStatistics,
    Stretch,
    VisitMark,
)
from vislam2tag.quality.evaluation.reliability import reduce_errors
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, SessionRef, Site, Survey

WIDTH_M, HEIGHT_M = 84.0, 42.0
MAPPED = ("ok", "uncertain")
DEVICES = ("Galaxy", "OnePlus", "Pixel 6")
START_NS = 88_000_000_000_000

_CORNERS = np.array([(8, 10), (76, 10), (76, 32), (42, 32), (42, 10), (8, 10), (8, 32), (42, 32), (60, 32), (60, 24)])
_SPOTS = np.array([(9, 11), (42, 9), (75, 11), (75, 31), (43, 31), (9, 31), (25, 33), (60, 25)], dtype=float)


def make_plan(path: Path) -> Path:
    """Draw corridors and rooms, 20 pixels a metre."""
    image = Image.new("RGB", (int(WIDTH_M * 20), int(HEIGHT_M * 20)), "white")
    draw = ImageDraw.Draw(image)
    for x in range(2, 82, 10):
        for bottom, top in ((1, 8), (12, 30), (34, 41)):
            draw.rectangle((x * 20, bottom * 20, (x + 10) * 20, top * 20), outline="#777777", width=5)
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, quality=90)
    return path


def make_survey(root: Path, floors: int = 2, sessions: int = 8, plan: bool = True) -> Survey:
    """Make a survey whose sessions are spread evenly over its floors."""
    sites = tuple(_floor(root, number, plan) for number in range(1, floors + 1))
    keys = [_key(floors, sessions, index) for index in range(sessions)]
    refs = tuple(SessionRef(key, root / str(key), "raw", slug_of(key)) for key in keys)
    finding = Finding(kind="missing_plan", file="floor_2/floorplan.jpg", count=1, message="The plan is missing.")
    return Survey(root, Site(sites, _landmarks(floors)), refs, (finding,))


def make_results(survey: Survey, points: int = 300) -> list[SessionResult]:
    """Make one result for each session; the last but one failed."""
    results = [make_result(ref, seed, points) for seed, ref in enumerate(survey.sessions)]
    if len(results) > 2:
        results[-2] = failed_result(survey.sessions[-2])
    return results


def slug_of(key: SessionKey) -> str:
    return f"{key.floor}_{key.device}_{key.session}".replace(":", "-").replace(" ", "-")


def make_result(ref: SessionRef, seed: int = 0, points: int = 300) -> SessionResult:
    """Make the result of a walk round the corridors in which some stretches were lost."""
    random = np.random.default_rng(seed)
    walk = _walk(random, points)
    lost = {"tracking_lost": 8.0 + seed % 5, "break": 6.0 * (seed % 3), "after_last_landmark": 11.0}
    seconds = {"ok": 170.0 + 5 * (seed % 7), "uncertain": 21.0, "before_first_landmark": 6.5, **lost}
    frames = {status: round(30 * value) for status, value in seconds.items()}
    return SessionResult(
        slug=ref.slug,
        fingerprint=hashlib.sha256(ref.slug.encode()).hexdigest(),
        floor=ref.key.floor,
        device=ref.key.device,
        session=ref.key.session,
        format=ref.format,
        strategy="local-corrected",
        version="0.1.0",
        error=None,
        files=_files(random),
        findings=_findings(seed),
        start_ns=START_NS,
        duration_s=sum(seconds.values()),
        distance_m=240.0 + 3 * seed,
        frame_rate_hz=29.9,
        pose_lag_s=0.042,
        frames=frames,
        frame_seconds=seconds,
        readings={
            "sensors": {"ok": 60_000 + seed, "gap": 40, "tracking_lost": 3_000, "outside_frames": 900},
            "wifi": {"ok": 1_800, "tracking_lost": 90, "duplicate": 140, "after_last_landmark": 120},
        },
        visits=_visits(walk),
        landmarks_logged=[str(1 + index + (ref.key.floor - 1) * len(_SPOTS)) for index in range(6)],
        scans=ScanStatistics(
            scans=61, median_interval_s=3.1 if seed % 4 else 30.2, readings=2_010, repeated=140, access_points=57
        ),
        events=_events(walk),
        contradictions=[_contradiction(ref.key.floor)] if seed % 2 == 0 else [],
        sigma=sigma_statistics(random.lognormal(-1.8, 0.6, 2000)),
        errors=_errors(random),
        drawing=_drawing(walk, random),
        corrections=["excluded 12.0 s to 15.5 s (corrections.toml, line 4)"] if seed == 1 else [],
    )


def unplaced(reason: str = "ambiguous") -> PlacingRecord:
    """A walk that the plan does not place. Unless it fits nowhere, a tap at 2:10 of a walk from START_NS would help."""
    moments = [START_NS, START_NS + 200_000_000_000]
    paths = ((0.6, [(0.0, 1.0), (4.0, 1.0)]), (0.38, [(9.0, 2.0), (9.0, 6.0)]), (0.015, [(5.0, 5.0), (6.0, 6.0)]))
    return PlacingRecord(
        labelled_share=0.0,
        reason=reason,
        way_m=80.0,
        misfit=0.1,
        mirror=7.0,
        exchanged=7.0,
        time_ns=moments,
        candidates=[CandidatePath(weight=weight, points=points) for weight, points in paths],
        best_tap_ns=None if reason == "fits_nowhere" else START_NS + 130_000_000_000,
    )


def failed_result(ref: SessionRef, error: str = "poses.csv: empty; expected one pose a line") -> SessionResult:
    """Make the result of a session that could not be read."""
    nothing = Drawing(mapped=[], discarded=[], raw=[], wifi=[])
    whole = make_result(ref)
    update: dict[str, object] = {
        "error": error,
        "start_ns": None,
        "duration_s": 0.0,
        "distance_m": 0.0,
        "frame_rate_hz": None,
        "pose_lag_s": None,
        "frames": {},
        "frame_seconds": {},
        "readings": {},
        "visits": [],
        "events": [],
        "contradictions": [],
        "sigma": None,
        "errors": None,
        "scans": None,
        "drawing": nothing,
    }
    return whole.model_copy(update=update)


def _key(floors: int, sessions: int, index: int) -> SessionKey:
    per_floor = -(-sessions // floors)
    number, rank = index // per_floor, index % per_floor
    return SessionKey(
        number + 1, DEVICES[rank * len(DEVICES) // per_floor], f"2021-12-20T{10 + rank // 60:02d}:{rank % 60:02d}:23"
    )


def _floor(root: Path, number: int, plan: bool) -> Floor:
    points = ControlPoints(("A", "B", "C"), np.array([(20.0, 10.0), (55.0, 32.0), (76.0, 20.0)]))
    image = make_plan(root / f"floor_{number}" / "floorplan.jpg") if plan else None
    return Floor(number, f"Storey {number}", WIDTH_M, HEIGHT_M, 3.5 * number, image, points)


def _landmarks(floors: int) -> Landmarks:
    """Eight landmarks a floor; of the last two one was never surveyed and one has only a guessed place."""
    count = floors * len(_SPOTS)
    position = np.tile(_SPOTS, (floors, 1))
    covariance = np.tile(np.eye(2) * 4e-4, (count, 1, 1))
    for floor in range(floors):
        last = (floor + 1) * len(_SPOTS) - 1
        covariance[last - 1 : last + 1] = np.diag((np.inf, np.inf))
        position[last] = np.nan
    nothing = np.full(count, np.nan)
    return Landmarks(
        ids=tuple(str(index + 1) for index in range(count)),
        floor=np.repeat(np.arange(1, floors + 1), len(_SPOTS)),
        position_bcs=position,
        covariance_bcs=covariance,
        z_m=nothing,
        heading_rad=nothing,
        heading_sigma_rad=nothing,
    )


def _walk(random: np.random.Generator, points: int) -> FloatArray:
    """Walk along the corridors with a little sway, (points, 2) metres."""
    steps = np.linalg.norm(np.diff(_CORNERS, axis=0), axis=1)
    at = np.linspace(0, steps.sum(), points)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    line = np.column_stack([np.interp(at, along, _CORNERS[:, axis]) for axis in (0, 1)])
    sway = np.convolve(random.normal(0, 1.2, points + 14), np.ones(15) / 15, mode="valid")
    return np.asarray(line + sway[:, None] * (0.6, 1.0))


def _line(xy: FloatArray) -> Polyline:
    return [(float(x), float(y)) for x, y in np.round(xy, 2)]


def _drawing(walk: FloatArray, random: np.random.Generator) -> Drawing:
    n = len(walk)
    cuts = [0, n // 30, n // 3, n // 3 + n // 20, n // 2, 2 * n // 3, 2 * n // 3 + n // 25, n - n // 15, n]
    statuses = ["before_first_landmark", "ok", "tracking_lost", "ok", "uncertain", "break", "ok", "after_last_landmark"]
    sigma = 0.1 + 1.2 * np.exp(-(((np.arange(n) / n - 0.6) / 0.08) ** 2))
    drift = np.cumsum(random.normal(0, 0.02, (n, 2)), axis=0) * np.linspace(0, 5, n)[:, None]
    spans = [(status, slice(a, b)) for status, (a, b) in zip(statuses, itertools.pairwise(cuts), strict=True)]
    return Drawing(
        mapped=[
            Stretch(status=status, points=_line(walk[span]), sigma_m=np.round(sigma[span], 3).tolist())
            for status, span in spans
            if status in MAPPED
        ],
        discarded=[
            Stretch(status=status, points=_line((walk + drift)[span])) for status, span in spans if status not in MAPPED
        ],
        raw=_line(walk + drift),
        wifi=_line(walk[n // 20 : -n // 10 : max(n // 60, 1)]),
    )


def _visits(walk: FloatArray) -> list[VisitMark]:
    marks = []
    for index, spot in enumerate(_SPOTS[:6]):
        away = np.linalg.norm(walk - spot, axis=1)
        nearest = int(away.argmin())
        position = None if index == 4 else _line(walk[nearest : nearest + 1])[0]
        time_ns = START_NS + nearest * 700_000_000
        marks.append(
            VisitMark(landmark=str(index + 1), time_ns=time_ns, distance_m=float(away.min()), position=position)
        )
    return sorted(marks, key=lambda mark: mark.time_ns)


def _events(walk: FloatArray) -> list[EventMark]:
    """One event of each kind; the last one where nothing is mapped."""
    count = len(EventKind)
    return [
        EventMark(
            time_ns=START_NS + (index + 1) * 9_000_000_000,
            kind=kind,
            size_m=0.15 * (index + 1),
            turn_rad=None if kind is EventKind.LOSS else 0.1 * index,
            position=None if index == count - 1 else _line(walk[(index + 1) * len(walk) // (count + 2)][None])[0],
        )
        for index, kind in enumerate(EventKind)
    ]


def _contradiction(floor: int) -> ContradictionMark:
    """The third landmark of a floor, two metres to the left of its place."""
    surveyed = (float(_SPOTS[2][0]), float(_SPOTS[2][1]))
    landmark = str(3 + (floor - 1) * len(_SPOTS))
    return ContradictionMark(
        floor=floor,
        landmark=landmark,
        size_m=2.0,
        sigma_m=0.14,
        passes=2,
        surveyed_m=surveyed,
        offset_m=(-2.0, 0.1),
    )


def sigma_statistics(sigma_m: FloatArray, limit_m: float = 0.5) -> SigmaStatistics:
    return SigmaStatistics(
        median_m=float(np.median(sigma_m)),
        p95_m=float(np.quantile(sigma_m, 0.95)),
        uncertain_share=float(np.mean(sigma_m > limit_m)),
        frames=counts_of(sigma_m),
    )


def _errors(random: np.random.Generator) -> ErrorRecord:
    """Errors of a strategy that is a little too sure."""
    sigma_m = random.lognormal(-1.8, 0.6, 400)
    covariance = np.eye(2) * sigma_m[:, None, None] ** 2
    errors = 1.2 * sigma_m[:, None] * random.normal(size=(400, 2))
    return reduce_errors("truth.csv", errors, covariance, np.zeros_like(covariance))


def _files(random: np.random.Generator) -> list[FileAccount]:
    sizes = {"poses.csv": 6_200, "initPoses.csv": 40_000, "sensors.csv": 64_000, "wifi.csv": 2_150}
    return [
        FileAccount(
            name=name,
            role=name.removesuffix(".csv"),
            size_bytes=lines * 84,
            sha256=random.bytes(32).hex(),
            lines=lines,
            rows=lines,
        )
        for name, lines in sizes.items()
    ]


def _findings(seed: int) -> list[Finding]:
    stale = Finding.at_lines(
        "stale_wifi_rows",
        "wifi.csv",
        list(range(40, 180)),
        "Rows repeated from the scan before; counted once.",
        Severity.INFO,
    )
    gap = Finding(kind="frame_gap", file="poses.csv", count=2, message="No frame for more than 1 s.", lines=(812, 2044))
    cut = Finding(
        kind="malformed_lines",
        file="sensors.csv",
        count=1,
        lines=(64_001,),
        severity=Severity.ERROR,
        message="The last line is cut off: expected 8 fields, found 5. It is left out.",
    )
    return [stale, gap, cut][: 1 + seed % 3]
