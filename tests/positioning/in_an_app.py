"""Asks the program that an app embeds (examples/locate_in_an_app), and compares its answers with a model's."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.radio_scans import RadioScans

APP = Path(__file__).parents[2] / "examples" / "locate_in_an_app" / "locate.mjs"


def question(scans: RadioScans) -> dict[str, Any]:
    """What goes to ``locate --serve``, or to the app; an access point that nobody knows is heard besides."""
    names = np.array([name.upper() for name in scans.access_points])
    asked = []
    for row, session in enumerate(scans.session.tolist()):
        own = slice(*scans.start[row : row + 2])
        heard = zip(names[scans.column[own]].tolist(), scans.rssi_dbm[own].tolist(), strict=True)
        asked.append({"scan_id": f"s{row}", "session": session, "readings": {**dict(heard), "stranger": -50.0}})
    return {"scans": asked}


def answered(model: Path, scans: RadioScans) -> list[dict[str, Any]]:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node.js is not installed")
    asked = model.with_suffix(".json")
    asked.write_text(json.dumps(question(scans)))
    ended = subprocess.run([node, APP, model, asked], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    positions: list[dict[str, Any]] = json.loads(ended.stdout)["positions"]
    return positions


def assert_same(positions: list[dict[str, Any]], found: Positions) -> None:
    unlike = np.zeros(len(found), dtype=bool) if found.unlike is None else found.unlike
    status = np.where(found.known, np.where(unlike, "unlike", "ok"), "unknown")
    assert [one["status"] for one in positions] == status.tolist()
    known = [one for one in positions if one["status"] != "unknown"]
    found = found[found.known]
    storeys = [found.storeys[at] for at in found.storey]
    assert [(one["building"], one["floor"]) for one in known] == [(at.building or None, at.floor) for at in storeys]
    numbers = {
        "x": found.xy[:, 0],
        "y": found.xy[:, 1],
        "z": found.z,
        "radius_68_m": found.radius_68_m,
        "radius_95_m": found.radius_95_m,
        "floor_probability": found.storey_probability[np.arange(len(found)), found.storey],
    }
    for name, values in numbers.items():
        stated = np.array([one[name] for one in known], dtype=np.float64)  # null: NaN
        np.testing.assert_allclose(stated, values, rtol=0, atol=1e-6, err_msg=name)
