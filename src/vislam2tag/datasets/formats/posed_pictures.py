"""Pictures of walks with their poses in the building, as text of COLMAP, Kapture and LaMAR: metric truth for vision.

Each floor is a model of its own, in its BCS, with z above the building's zero level. A camera has x right, y down and z
ahead, as these programs expect. Poses are those of the labels at the times of the pictures. ``covariances.txt``
contains their horizontal covariances, for which the layouts have no place. Pictures are not copied: their names are
paths within the survey.

- ``colmap``: ``cameras.txt``, ``images.txt`` (world to camera) and an empty ``points3D.txt`` (COLMAP, "Output format").
- ``kapture``: ``sensors/sensors.txt``, ``trajectories.txt`` (world to camera) and ``records_camera.txt`` (Kapture 1.1).
- ``lamar``: ``sessions/SLUG/sensors.txt``, ``trajectories.txt`` (camera to world) and ``images.txt`` (LaMAR,
  CAPTURE.md).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote

import numpy as np
from PIL import Image, UnidentifiedImageError

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import DatasetError, SessionError, UsageError, first_line, import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import plain
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import has_position
from vislam2tag.core.transforms import multiply, rotated
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.datasets.writing import UNMAPPED, raw_session, refuse_changed_files, shared_labels
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY, trajectory_of
from vislam2tag.sessions.apps import HALF_TURN_ABOUT_X, AppFormat, Pictures
from vislam2tag.sessions.registry import FORMATS, at_hand, open_survey
from vislam2tag.site.model import SessionKey, SessionRef

HOLDS = {
    TRAJECTORY: (
        *("time_ns", "x", "y", "z", "qx", "qy", "qz", "qw", "cov_xx", "cov_xy", "cov_yy"),
        *("session", "device", "floor"),
    )
}
_INVERSE = np.array((-1.0, -1.0, -1.0, 1.0))
COVARIANCES_FILE = "covariances.txt"
_COVARIANCES = "# name, xx, xy, yy (m2, in the frame of the floor)"


@dataclass(frozen=True)
class PosedPictures:
    """Pictures of one walk on one floor, ``k`` of them.

    ``time_ns`` (k,) boot clock; ``position_bcs`` (k, 3) metres; ``orientation_bcs`` (k, 4) quaternion (x, y, z, w) of a
    camera with y down to the BCS; ``covariance_bcs`` (k, 2, 2) m^2; ``camera`` (k,) row of ``lens_px`` (c, 4): fx, fy,
    cx, cy. ``size_px``: width and height.
    """

    slug: str
    names: tuple[str, ...]
    size_px: tuple[int, int]
    time_ns: IntArray
    position_bcs: FloatArray
    orientation_bcs: FloatArray
    covariance_bcs: FloatArray
    camera: IntArray
    lens_px: FloatArray

    @property
    def cameras(self) -> list[str]:
        """Name of each camera (c,): one for each lens, because a phone that focuses changes it."""
        return [f"{self.slug}-camera{number}" for number in range(len(self.lens_px))]

    @property
    def lenses(self) -> list[str]:
        """Model, size and parameters of each camera (c,), as COLMAP names them."""
        width, height = self.size_px
        return [f"PINHOLE, {width}, {height}, " + _numbers(lens) for lens in self.lens_px]

    @property
    def to_world(self) -> FloatArray:
        """Rotation (w, x, y, z) and translation from the camera to the BCS (k, 7)."""
        return np.column_stack((self.orientation_bcs[:, (3, 0, 1, 2)], self.position_bcs))

    @property
    def from_world(self) -> FloatArray:
        """Rotation (w, x, y, z) and translation from the BCS to the camera (k, 7)."""
        turn = self.orientation_bcs * _INVERSE
        return np.column_stack((turn[:, (3, 0, 1, 2)], -rotated(turn, self.position_bcs)))


@dataclass
class _Counts:
    unmapped: int = 0
    without_pictures: int = 0
    without_pose: int = 0
    unreadable: dict[str, str] = field(default_factory=dict)
    """Reasons by session."""
    videos: list[str] = field(default_factory=list)


_Write = Callable[[Folder, Sequence[PosedPictures]], None]


def _writer(write: _Write) -> Callable[[Path, Folder, ExportContext], tuple[Finding, ...]]:
    def write_labels(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
        """Write the pictures of all walks, one folder for each floor.

        Raises UsageError without a survey, DatasetError if no picture has a pose.
        """
        if context.survey is None:
            raise UsageError("the pictures are in the survey: pass it with --survey")
        opened, left_out = shared_labels(labels, context)
        refs = {ref.key: ref for ref in open_survey(context.survey).sessions}
        counts, floors = _Counts(), defaultdict[int, list[PosedPictures]](list)
        for session in opened.sessions:
            for floor, posed in _of_session(session, refs, context.survey, counts):
                floors[floor].append(posed)
            context.progress(session.slug, len(opened.sessions))
        if not floors:
            raise DatasetError(f"{labels}: {_nothing(counts, len(opened.sessions))}")
        for floor, walks in floors.items():
            own = folder.folder(f"floor_{floor}")
            write(own, walks)
            _write_lines(own, COVARIANCES_FILE, [_COVARIANCES], _covariance_lines(walks))
        return (*left_out, *_findings(counts))

    return write_labels


def _nothing(counts: _Counts, sessions: int) -> str:
    if counts.unreadable and counts.without_pictures + len(counts.unreadable) == sessions:
        session, reason = next(iter(counts.unreadable.items()))
        return f"the pictures of {len(counts.unreadable)} of its sessions cannot be read, such as {session}: {reason}"
    if counts.without_pictures == sessions:
        return f"none of its sessions has pictures; apps that record pictures are listed in {page_of('how-to/iphone')}"
    if counts.without_pose:
        return (
            f"none of its {counts.without_pose} pictures has a pose with a height. Heights need the elevation of the "
            "floor: set it with `vislam2tag site set SURVEY --floor K --elevation-m METRES`, and run "
            "`vislam2tag process` again"
        )
    return "none of its sessions has a position; report.html gives the reason"


def _findings(counts: _Counts) -> tuple[Finding, ...]:
    return (
        *finding_if(counts.unmapped, "unmapped_sessions", UNMAPPED),
        *finding_if(counts.without_pictures, "sessions_without_pictures", "sessions without pictures are skipped"),
        *(
            Finding(
                kind="unreadable_pictures",
                file=session,
                count=1,
                message=f"the pictures cannot be read, so the session is skipped: {reason}",
            )
            for session, reason in counts.unreadable.items()
        ),
        *finding_if(
            counts.without_pose, "pictures_without_pose", "pictures without position, height or orientation are skipped"
        ),
        *finding_if(
            len(counts.videos),
            "pictures_in_video",
            "the pictures of these walks are frames of a video. Before you use them, extract them in the survey's "
            f"folder, for example with: {''.join(map(_extraction, counts.videos[:1]))}",
        ),
    )


def _extraction(video: str) -> str:
    """The command that writes the frames of a video into the files that the export names."""
    folder = Path(video).with_suffix("").as_posix()
    first = f"mkdir {quote(folder)} && ffmpeg -i {quote(video)} -vsync passthrough"
    return f"{first} -start_number 0 {quote(folder + '/%06d.jpg')}"


def _of_session(
    session: LabelledSession, refs: dict[SessionKey, SessionRef], survey: Path, counts: _Counts
) -> Iterator[tuple[int, PosedPictures]]:
    """Yield the pictures that have a pose, by floor."""
    result = session.result()
    ref = raw_session(refs, result, survey)
    try:
        found = _pictures(ref, result, survey, counts)
    except (SessionError, OSError, UnidentifiedImageError) as error:
        counts.unreadable[session.slug] = first_line(error)
        return
    if found is None:
        counts.without_pictures += 1
        return
    pictures, names, size_px = found
    trajectory = trajectory_of(session.table(TRAJECTORY, SCHEMAS[TRAJECTORY]))
    mapped = has_position(trajectory.status)
    if not mapped.any():
        counts.unmapped += 1
        return
    frame = np.searchsorted(trajectory.time_ns, pictures.time_ns).clip(0, len(trajectory.time_ns) - 1)
    posed = (trajectory.time_ns[frame] == pictures.time_ns) & mapped[frame]
    posed &= np.isfinite(trajectory.position_bcs[frame]).all(axis=1)
    posed &= np.isfinite(trajectory.orientation_bcs[frame]).all(axis=1)
    counts.without_pose += int((~posed).sum())
    floor = trajectory.floor[frame] if len(trajectory.floor) else np.full(len(frame), result.floor)
    for number in np.unique(floor[posed]).tolist():
        kept = np.flatnonzero(posed & (floor == number))
        lens_px, camera = np.unique(pictures.lens_px[kept], axis=0, return_inverse=True)
        turn = trajectory.orientation_bcs[frame[kept]]
        yield (
            number,
            PosedPictures(
                session.slug,
                tuple(names[each] for each in kept.tolist()),
                size_px,
                pictures.time_ns[kept],
                trajectory.position_bcs[frame[kept]],
                multiply(turn, np.broadcast_to(HALF_TURN_ABOUT_X, turn.shape)),
                trajectory.covariance_bcs[frame[kept]],
                camera.ravel().astype(np.int64),
                lens_px,
            ),
        )


def _pictures(
    ref: SessionRef, result: SessionResult, survey: Path, counts: _Counts
) -> tuple[Pictures, list[str], tuple[int, int]] | None:
    """Pictures of a session, their names within the survey and their size; None if it has none.

    Raises SessionError, OSError or UnidentifiedImageError if they cannot be read, UsageError if raw files have changed.
    """
    known = FORMATS.named(ref.format) if ref.format in FORMATS.names() else None
    if not isinstance(known, AppFormat):
        return None
    root = f"floor_{ref.key.floor}/{ref.key.device}/{ref.key.session}"
    with at_hand(ref, whole=True) as here:
        refuse_changed_files(here, result, survey)
        pictures = known.pictures(here.folder)
        if pictures is None or not len(pictures.time_ns):
            return None
        if pictures.video is not None and pictures.frame is not None:
            size_px = _of_video(pictures)
            video = f"{root}/{pictures.video.relative_to(here.folder).as_posix()}"
            counts.videos.append(video)
            stem = Path(video).with_suffix("").as_posix()
            return pictures, [f"{stem}/{frame:06d}.jpg" for frame in pictures.frame.tolist()], size_px
        names = [f"{root}/{file.relative_to(here.folder).as_posix()}" for file in pictures.files]
        with Image.open(plain(pictures.files[0])) as image:
            return pictures, names, image.size


def _of_video(pictures: Pictures) -> tuple[int, int]:
    """Width and height of a video's pictures as they were taken; raises SessionError if it cannot be opened."""
    cv2 = import_extra("cv2")
    video = cv2.VideoCapture(str(plain(pictures.video or Path())), cv2.CAP_FFMPEG)
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    try:
        size = int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT))
    finally:
        video.release()
    if 0 in size:
        raise SessionError(f"{pictures.video}: the file cannot be opened: it is not a video, or it is incomplete")
    return size


def _numbers(values: Iterable[float], separator: str = ", ") -> str:
    return separator.join(f"{value:.9g}" for value in values)


def _covariance_lines(walks: Sequence[PosedPictures]) -> Iterator[str]:
    for walk in walks:
        entries = walk.covariance_bcs.reshape(-1, 4)[:, (0, 1, 3)]
        yield from (f"{name}, {_numbers(row)}" for name, row in zip(walk.names, entries.tolist(), strict=True))


def _write_lines(folder: Folder, name: str, head: Sequence[str], lines: Iterable[str]) -> None:
    folder.write(name, "".join(f"{line}\n" for line in (*head, *lines)))


def _refuse_names_with(mark: str, word: str, walks: Sequence[PosedPictures]) -> None:
    if wrong := next((name for walk in walks for name in walk.names if mark in name), None):
        raise DatasetError(f"{wrong}: the layout separates fields by {word}; rename this folder or picture")


def _colmap(folder: Folder, walks: Sequence[PosedPictures]) -> None:
    _refuse_names_with(" ", "blanks", walks)
    cameras, images = list[str](), list[str]()
    for walk in walks:
        first = len(cameras) + 1
        cameras += [f"{first + number} {lens.replace(',', '')}" for number, lens in enumerate(walk.lenses)]
        for name, pose, camera in zip(walk.names, walk.from_world.tolist(), walk.camera.tolist(), strict=True):
            images += [f"{len(images) // 2 + 1} {_numbers(pose, ' ')} {first + camera} {name}", ""]
    _write_lines(folder, "cameras.txt", ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"], cameras)
    head = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"]
    _write_lines(folder, "images.txt", head, images)
    _write_lines(
        folder, "points3D.txt", ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)"], ()
    )


def _sensor_lines(walk: PosedPictures) -> list[str]:
    return [f"{name}, , camera, {lens}" for name, lens in zip(walk.cameras, walk.lenses, strict=True)]


def _pose_lines(walk: PosedPictures, poses: FloatArray) -> Iterator[str]:
    for time_ns, camera, pose in zip(walk.time_ns.tolist(), walk.camera.tolist(), poses.tolist(), strict=True):
        yield f"{time_ns}, {walk.cameras[camera]}, {_numbers(pose)}"


def _image_lines(walk: PosedPictures) -> Iterator[str]:
    for time_ns, camera, name in zip(walk.time_ns.tolist(), walk.camera.tolist(), walk.names, strict=True):
        yield f"{time_ns}, {walk.cameras[camera]}, {name}"


_SENSORS = "# sensor_device_id, name, sensor_type, [sensor_params]+"
_POSES = "# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz"
_IMAGES = "# timestamp, device_id, image_path"


def _kapture(folder: Folder, walks: Sequence[PosedPictures]) -> None:
    _refuse_names_with(",", "commas", walks)
    version, sensors = "# kapture format: 1.1", folder.folder("sensors")
    lines = {
        "sensors.txt": (_SENSORS, [line for walk in walks for line in _sensor_lines(walk)]),
        "trajectories.txt": (_POSES, [line for walk in walks for line in _pose_lines(walk, walk.from_world)]),
        "records_camera.txt": (_IMAGES, [line for walk in walks for line in _image_lines(walk)]),
    }
    for name, (head, content) in lines.items():
        _write_lines(sensors, name, [version, head], content)


def _lamar(folder: Folder, walks: Sequence[PosedPictures]) -> None:
    _refuse_names_with(",", "commas", walks)
    for walk in walks:
        session = folder.folder(f"sessions/{walk.slug}")
        _write_lines(session, "sensors.txt", [_SENSORS], _sensor_lines(walk))
        _write_lines(session, "trajectories.txt", [_POSES], _pose_lines(walk, walk.to_world))
        _write_lines(session, "images.txt", [_IMAGES], _image_lines(walk))


for _name, _layout in (("colmap", _colmap), ("kapture", _kapture), ("lamar", _lamar)):
    register(writes=ExportFormat(_name, HOLDS, takes=("survey",), write_labels=_writer(_layout)))
