"""Answers of a served model: positions of scans, what the model knows, and plans of a data set."""

from __future__ import annotations

from collections import deque
from pathlib import Path

import numpy as np

from vislam2tag.dataset.folder import open_dataset
from vislam2tag.pipeline.positioning.locate import located_table, namer
from vislam2tag.pipeline.positioning.serving.messages import (
    LocateAnswer,
    LocateRequest,
    Position,
    ServedFloor,
    ServedModel,
)
from vislam2tag.positioning.model_file import SavedModel, model_bytes
from vislam2tag.positioning.radio_scans import scans_from_readings

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
            if info is None or file is None:
                floors.append(ServedFloor(building=storey.building, floor=storey.floor, plan=None))
                continue
            floors.append(
                ServedFloor(
                    building=storey.building,
                    floor=storey.floor,
                    plan=f"/plans/{len(self.plans)}",
                    width_m=info.width_m,
                    height_m=info.height_m,
                    lower_left_m=info.lower_left_m,
                )
            )
            self.plans.append(Path(file))
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
