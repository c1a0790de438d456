"""Answers of a served model: positions of scans, what the model knows, and plans of a data set.

They go over HTTP, scans in, positions out; limits are part of the messages, so that OpenAPI tells them.
"""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.intake.readings import SIGNAL_STRENGTH, is_masked
from vislam2tag.pipeline.positioning.locate import located_table, namer
from vislam2tag.positioning.model_files import SavedModel, model_bytes
from vislam2tag.positioning.radio_scans import scans_from_readings

MOST_SCANS = 500
MOST_READINGS = 1000
"""Of a scan."""
_LONGEST_NAME = 200

Level = Annotated[float, Field(ge=SIGNAL_STRENGTH.least, le=SIGNAL_STRENGTH.greatest)]
Name = Annotated[str, Field(min_length=1, max_length=_LONGEST_NAME)]


class _Message(FiniteRecord, use_attribute_docstrings=True):
    """A record whose fields OpenAPI describes by their docstrings."""


class Scan(_Message):
    """What a phone heard at one place."""

    scan_id: Name
    """Comes back with the position."""
    readings: Annotated[dict[Name, Level], Field(max_length=MOST_READINGS)]
    """Level in dBm of each access point, by its address."""
    session: Annotated[str, Field(max_length=_LONGEST_NAME)] = ""
    """Walk; scans of one that are asked for at once tell together how large their circles are. Empty: none."""

    @field_validator("readings")
    @classmethod
    def _has_addresses(cls, readings: dict[str, float]) -> dict[str, float]:
        if masked := sorted(name for name in readings if is_masked(name)):
            raise ValueError(f"{masked[0]} is no address; Android gives it to apps without the location permission")
        return readings


class LocateRequest(_Message):
    """Scans to locate."""

    scans: Annotated[list[Scan], Field(min_length=1, max_length=MOST_SCANS)]


class Position(_Message):
    """Where a scan was taken, as `vislam2tag locate` writes it; all but id and status are null where it is unknown."""

    scan_id: str
    status: Literal["ok", "unlike", "unknown"]
    """``unlike``: nothing like the scan was learned, so that no radius can be relied on."""
    building: str | None
    floor: int | None
    x: float | None
    """Metres in the frame of the floor (BCS), as y."""
    y: float | None
    z: float | None
    """Metres above the building's zero; null where the data set knows no heights."""
    radius_68_m: float | None
    """The true place lies within so many metres in the plane with 68 % probability."""
    radius_95_m: float | None
    floor_probability: float | None
    """What the model gives this floor."""


class LocateAnswer(_Message):
    """Positions in the order of the scans."""

    positions: list[Position]


class ServedFloor(_Message):
    """A floor that the model knows; the plan's extent in metres where a plan is served."""

    building: str
    floor: int
    plan: str | None
    """Address of the picture."""
    width_m: float | None = None
    height_m: float | None = None
    lower_left_m: tuple[float, float] = (0.0, 0.0)


class ServedModel(_Message):
    """What answers."""

    model: str
    dataset: str
    frame: str
    scans: int
    """How many it learned from."""
    access_points: int
    hashed_with: str | None
    """Name of the key that addresses must be hashed with; null: they are plain."""
    floors: list[ServedFloor]


class Refusal(_Message):
    """Why a request was not answered."""

    message: str


MOST_LATEST = 100


class ServedAnswers:
    """One model that answers; the latest positions are kept for the page."""

    def __init__(self, saved: SavedModel, plans: Path | None = None) -> None:
        """Take a model, and the data set whose plans are shown; raises DatasetError where there is none."""
        self._saved = saved
        self._name = namer(saved, None)
        self._latest: deque[Position] = deque(maxlen=MOST_LATEST)
        dataset = None if plans is None else open_dataset(plans)
        infos = {} if dataset is None else {(info.building, info.number): info for info in dataset.info.floors}
        self.plans: list[Path] = []
        floors = []
        for storey in saved.model.storeys_:
            info = infos.get((storey.building, storey.floor))
            file = None if dataset is None or info is None or info.plan is None else dataset.files.get(info.plan)
            shown = ServedFloor(building=storey.building, floor=storey.floor, plan=None)
            if info is not None and file is not None:
                plan = {"plan": f"/plans/{len(self.plans)}", "lower_left_m": info.lower_left_m}
                size = {"width_m": info.width_m, "height_m": info.height_m}
                shown = shown.model_copy(update=plan | size)
                self.plans.append(Path(file))
            floors.append(shown)
        self.model = ServedModel(
            model=saved.name,
            dataset=saved.origin.dataset,
            frame=saved.origin.frame,
            scans=saved.origin.scans,
            access_points=len(saved.model.access_points_),
            hashed_with=saved.origin.bssid_key,
            floors=floors,
        )

    def locate(self, request: LocateRequest) -> LocateAnswer:
        """Locate scans, and keep the positions as the latest."""
        scans = request.scans
        counts = [len(scan.readings) for scan in scans]
        heard = scans_from_readings(
            np.repeat(np.arange(len(scans)), counts),
            np.array([self._name(bssid) for scan in scans for bssid in scan.readings], dtype=np.str_),
            np.array([level for scan in scans for level in scan.readings.values()], dtype=np.float64),
            len(scans),
            session=np.array([scan.session for scan in scans], dtype=np.str_),
        )
        ids = np.array([scan.scan_id for scan in scans], dtype=np.str_)
        table = located_table(ids, self._saved.model.predict(heard))
        positions = [Position(**row) for row in table.rows(named=True)]
        self._latest.extend(positions)
        return LocateAnswer(positions=positions)

    def file(self) -> bytes:
        """Return the model's file."""
        return model_bytes(self._saved)

    def latest(self) -> LocateAnswer:
        """Return the latest positions, the newest last."""
        return LocateAnswer(positions=list(self._latest))
