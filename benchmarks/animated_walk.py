"""The picture that moves in README and on the start page: a walk as the tracker logged it, and mapped.

python benchmarks/animated_walk.py docs/images/walk_mapped.svg
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from data_sets import Walk, generated

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.faults import EventKind
from vislam2tag.core.tracks import Trajectory
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings

SEED = 3
WIDTH, HEIGHT = 640, 250
MARGIN = 18
DURATION_S = 12
THINNED = 15
"""Every so many frames a point is drawn."""
STYLE = (
    "text{font:13px sans-serif;fill:#555}path{fill:none;stroke-width:2.5;stroke-linejoin:round}"
    "@media(prefers-color-scheme:dark){text{fill:#ccc}}"
)


def main() -> None:
    """Write the picture of the first walk on which the tracker broke down."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    walks = ((walk, mapped(walk)) for walk in generated([SEED], "default"))
    walk, trajectory = next(found for found in walks if any(event.kind is EventKind.BREAK for event in found[1].events))
    parser.parse_args().file.write_text(picture(walk, trajectory), encoding="utf-8")


def mapped(walk: Walk) -> Trajectory:
    """The walk as the smoother maps it."""
    return strategy_named("smoother", MappingSettings()).map(walk.camera, walk.log, walk.landmarks)


def picture(walk: Walk, trajectory: Trajectory) -> str:
    """Both ways side by side as an SVG that draws them as they were walked."""
    seen = np.isfinite(trajectory.position_bcs[:, 0])
    raw = walk.camera.position_acs[seen][::THINNED][:, [0, 2]]
    found = trajectory.position_bcs[seen][::THINNED, :2]
    half = WIDTH // 2
    box = (half - 2 * MARGIN, HEIGHT - 2 * MARGIN - 20)
    raw_px, _ = fitted(raw, raw, box)
    found_px, marks = fitted(found * (1, -1), walk.landmarks.position_bcs[:, :2] * (1, -1), box)
    squares = "".join(f'<rect x="{x - 3:.1f}" y="{y - 3:.1f}" width="6" height="6" fill="#888"/>' for x, y in marks)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        f"<title>A walk as the tracker logged it, and mapped into the building</title><style>{STYLE}</style>"
        f'<g transform="translate({MARGIN},{MARGIN})"><text y="4">as the tracker logged it</text>'
        f'<g transform="translate(0,20)">{drawn(raw_px, "#d55e00")}</g></g>'
        f'<g transform="translate({half + MARGIN},{MARGIN})"><text y="4">mapped into the building</text>'
        f'<g transform="translate(0,20)">{squares}{drawn(found_px, "#0072b2")}</g></g></svg>\n'
    )


def fitted(way: FloatArray, marks: FloatArray, box: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """A way (n, 2) and marks (m, 2), m, y down, as pixels of a box (width, height) at one scale."""
    both = np.vstack((way, marks[np.isfinite(marks).all(axis=1)]))
    least, size = both.min(axis=0), np.ptp(both, axis=0)
    scale = min(box[0] / size[0], box[1] / size[1])
    return (way - least) * scale, (marks - least) * scale


def drawn(way_px: FloatArray, colour: str) -> str:
    """A way (n, 2) in pixels that is drawn at a constant pace, with a dot ahead of it, over and over."""
    line = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in way_px)
    length = float(np.linalg.norm(np.diff(way_px, axis=0), axis=1).sum())
    times = f'dur="{DURATION_S}s" repeatCount="indefinite"'
    return (
        f'<path d="{line}" stroke="{colour}" opacity=".25"/>'
        f'<path d="{line}" stroke="{colour}" stroke-dasharray="{length:.0f}" stroke-dashoffset="0">'
        f'<animate attributeName="stroke-dashoffset" values="{length:.0f};0;0" keyTimes="0;.85;1" {times}/></path>'
        f'<circle r="4.5" fill="{colour}"><animateMotion path="{line}" keyPoints="0;1;1" keyTimes="0;.85;1" '
        f'calcMode="linear" {times}/></circle>'
    )


if __name__ == "__main__":
    main()
