"""The picture of README and of the start page: a sheet, a phone, and a walk that moves into the plan.

The sheet, the walk, the plan and the readings are made by the program: it simulates one walk, maps and labels it.

    python benchmarks/front_picture.py docs/images/front.svg
"""

from __future__ import annotations

import argparse
import base64
import io
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from PIL import Image

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Similarity2
from vislam2tag.pipeline.labels.process import process
from vislam2tag.preparation.sheets.images import dead_leaves_picture
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.survey import simulate

SEED = 3
DURATION_S = 150.0
WIDTH, HEIGHT = 720, 364
HEAD_Y = 26
PLAN_BOX = (300.0, 62.0, 410.0)
"""Left, top and width of the plan."""
SCREEN_BOX = (176.0, 90.0, 84.0, 196.0)
"""Left, top, width and height of the phone's screen."""
SHEET_BOX = (20.0, 72.0, 104.0, 148.0)
SHEET_PX = 100
GREY_LEVELS = 8
THINNED = 30
"""One point is drawn of so many frames."""
SECONDS = 9
REPEATS = 2
LEAST_DBM, LARGEST_DBM = -85.0, -40.0
WEAK, STRONG = (68, 1, 84), (253, 211, 37)
"""Colours of the weakest and the strongest reading."""
STYLE = (
    "text{font:600 20px sans-serif;fill:#24292f}.note{font-weight:400;font-size:18px;fill:#57606a}"
    "path{fill:none;stroke-linejoin:round}.wall{stroke:#8c959f;stroke-width:1.2}"
    "@media(prefers-color-scheme:dark){text{fill:#e6edf3}.note{fill:#9da7b3}}"
)
RAW, MAPPED = "#d55e00", "#0072b2"


@dataclass(frozen=True)
class Example:
    """What the program makes of one walk; positions in metres on the plan."""

    raw: FloatArray
    """The walk (n, 2) as the tracker logged it, moved, turned and scaled onto the mapped one."""
    mapped: FloatArray
    walls: FloatArray
    landmarks: FloatArray
    scans: FloatArray
    """Of the access point that is heard most often (k, 3): x, y and signal strength in dBm."""
    size_m: tuple[float, float]


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    scenario = regular_survey(SEED, floors=(0,), devices=("LG",), sessions=1, duration_s=DURATION_S)
    parser.parse_args().file.write_text(picture(example(scenario)), encoding="utf-8")


def example(scenario: Scenario) -> Example:
    """Simulate the walk, map it and label its readings, as `simulate` and `process` do."""
    with tempfile.TemporaryDirectory() as folder:
        survey, labels = Path(folder) / "survey", Path(folder) / "labels"
        simulate(scenario, survey)
        process(survey, labels, Settings())
        camera = read_session(open_survey(survey).sessions[0]).camera
        trajectory = pl.read_parquet(labels / "trajectory" / "*.parquet")
        wifi = pl.read_parquet(labels / "wifi" / "*.parquet").filter(pl.col("status") == "ok")
    mapped = trajectory.select("x", "y").to_numpy()
    known = np.isfinite(mapped).all(axis=1) & np.isfinite(camera.position_acs).all(axis=1)
    raw = camera.position_acs[known][:, [0, 2]] * (1, -1)
    raw = Similarity2.fit(raw, mapped[known]) @ raw
    often = wifi["bssid"].value_counts(sort=True)["bssid"][0]
    floor = scenario.building.floors[0]
    return Example(
        raw=raw[::THINNED],
        mapped=mapped[known][::THINNED],
        walls=floor.walls,
        landmarks=floor.landmark_position[:, :2],
        scans=wifi.filter(pl.col("bssid") == often).select("x", "y", "rssi_dbm").to_numpy(),
        size_m=(floor.width_m, floor.height_m),
    )


def picture(shown: Example) -> str:
    """Draw the three steps side by side as an SVG."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        "<title>A printed sheet, a phone, and its walk moved into the plan of the building</title>"
        f"<style>{STYLE}</style>{sheet()}{phone(shown)}{plan(shown)}</svg>\n"
    )


def sheet() -> str:
    """A printed landmark."""
    left, top, width, height = SHEET_BOX
    grey = Image.fromarray(dead_leaves_picture(0, "7")).resize((SHEET_PX, SHEET_PX), Image.Resampling.BOX)
    packed = io.BytesIO()
    grey.quantize(GREY_LEVELS).save(packed, "png", optimize=True)
    image = base64.b64encode(packed.getvalue()).decode("ascii")
    return (
        f'<text x="{left}" y="{HEAD_Y}">1 Print</text><text class="note" x="{left}" y="{HEAD_Y + 24}">sheets</text>'
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="#fff" stroke="#57606a"/>'
        f'<image x="{left + 7}" y="{top + 7}" width="{width - 14}" height="{width - 14}" '
        f'href="data:image/png;base64,{image}"/>'
        f'<text x="{left + 9}" y="{top + height - 14}" style="fill:#000;font-size:30px">7</text>'
    )


def phone(shown: Example) -> str:
    """A phone that shows the walk as its tracker logged it."""
    left, top, width, height = SCREEN_BOX
    inner = (width - 12, height - 12)
    turned = shown.raw[:, ::-1]
    least, size = turned.min(axis=0), np.ptp(turned, axis=0)
    scale = min(inner[0] / size[0], inner[1] / size[1])
    track = (turned - least) * scale + (left + 6, top + 6) + (np.array(inner) - size * scale) / 2
    return (
        f'<text x="{left - 8}" y="{HEAD_Y}">2 Walk</text>'
        f'<text class="note" x="{left - 8}" y="{HEAD_Y + 24}">with a phone</text>'
        f'<rect x="{left - 8}" y="{top - 18}" width="{width + 16}" height="{height + 36}" rx="12" fill="#24292f" '
        'stroke="#8c959f"/>'
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="#fff"/>'
        f'<path d="{line(track)}" stroke="{RAW}" stroke-width="2"/>'
    )


def plan(shown: Example) -> str:
    """The plan, the walk that moves into it, and the readings with their places."""
    left, top, width = PLAN_BOX
    scale = width / shown.size_m[0]
    height = shown.size_m[1] * scale

    def drawn(points: FloatArray) -> FloatArray:
        return points * (scale, -scale) + (left, top + height)

    walls = "".join(line(drawn(wall)) for wall in shown.walls)
    marks = "".join(
        f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="#24292f" stroke="#fff"/>'
        for x, y in drawn(shown.landmarks)
    )
    scans = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{colour(dbm)}" stroke="#fff" stroke-width=".8"/>'
        for (x, y), dbm in zip(drawn(shown.scans[:, :2]), shown.scans[:, 2], strict=True)
    )
    raw, mapped = line(drawn(shown.raw)), line(drawn(shown.mapped))
    timing = f'keyTimes="0;.25;.5;1" dur="{SECONDS}s" repeatCount="{REPEATS}"'
    return (
        f'<text x="{left}" y="{HEAD_Y}">3 Every reading gets its place</text>'
        f'<g><rect x="{left}" y="{top}" width="{width}" height="{height:.1f}" fill="#fff"/>'
        f'<path class="wall" d="{walls}"/>{marks}'
        f'<path d="{mapped}" stroke="{MAPPED}" stroke-width="2.5">'
        f'<animate attributeName="d" values="{raw};{raw};{mapped};{mapped}" {timing}/>'
        f'<animate attributeName="stroke" values="{RAW};{RAW};{MAPPED};{MAPPED}" {timing}/></path>'
        f'<g>{scans}<animate attributeName="opacity" values="0;0;0;1" {timing}/></g></g>'
        f'<text class="note" x="{left}" y="{top + height + 26:.0f}">■ sheet</text>'
        f'<text class="note" x="{left + 90}" y="{top + height + 26:.0f}">● Wi-Fi scan, bright: strong signal</text>'
        f'<text class="note" x="{left}" y="{top + height + 54:.0f}">'
        f'<tspan fill="{RAW}" style="fill:{RAW}">—</tspan> as logged'
        f'<tspan dx="16" style="fill:{MAPPED}">—</tspan> mapped by vislam2tag</text>'
    )


def line(points: FloatArray) -> str:
    """Points (n, 2) in pixels as the data of an SVG path."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)


def colour(dbm: float) -> str:
    """Colour of a reading, from weak to strong."""
    share = float(np.clip((dbm - LEAST_DBM) / (LARGEST_DBM - LEAST_DBM), 0, 1))
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(WEAK, STRONG, strict=True))
    return f"#{red:02x}{green:02x}{blue:02x}"


if __name__ == "__main__":
    main()
