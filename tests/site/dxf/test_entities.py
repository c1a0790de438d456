"""What of a drawing is shown: visibility by the rules, blocks, clips, and filled shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ezdxf.xclip import XClip

from tests.site.dxf.drawings import WALLS, add_floor, parts, read, written
from vislam2tag.site.plan_formats.dxf import read_dxf
from vislam2tag.site.plans.source import PlanSource


def inserted(document: Any, space: Any, insertion: str, layer: str) -> None:
    """The floor, and one twice as high in a block whose insertion is on a layer of its own."""
    add_floor(space)
    add_floor(block := document.blocks.new("OLD"), layer=layer)
    block.add_line((0, 20), (20, 20), dxfattribs={"layer": layer})
    space.add_blockref("OLD", (0, 0), dxfattribs={"layer": insertion})


@pytest.mark.parametrize(
    ("frozen", "layer", "height"), [(True, "Wände", 10), (True, "0", 10), (False, "Wände", 20), (False, "0", 10)]
)
def test_a_frozen_layer_hides_blocks_on_it_and_an_off_layer_only_its_own_lines(
    tmp_path: Path, frozen: bool, layer: str, height: float
) -> None:
    def build(document: Any, space: Any) -> None:
        hidden = document.layers.add("Wand-Alt")
        hidden.freeze() if frozen else hidden.off()
        inserted(document, space, "Wand-Alt", layer)

    assert read(tmp_path, build).bounds == (0, 20, 0, height)


def test_what_is_hidden_is_said(tmp_path: Path) -> None:
    def build(document: Any, space: Any) -> None:
        document.layers.add("Alt").freeze()
        add_floor(space, layer="Alt")

    with pytest.raises(OSError, match=r"shows nothing: all that it contains is hidden, on Alt \(frozen layer\)"):
        read(tmp_path, build)

    def both(document: Any, space: Any) -> None:
        build(document, space)
        add_floor(space)

    assert ("Alt", "left out", 7, "frozen layer") in parts(read(tmp_path, both))
    with pytest.raises(OSError, match=r"shows nothing on layer Alt \(frozen layer\)"):
        read(tmp_path, both, layers=["alt"])


def test_a_layer_that_is_not_printed_counts_only_if_it_is_chosen(tmp_path: Path) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(space)
        document.layers.add("Wand-Hilfe").dxf.plot = 0
        space.add_line((0, 5), (20, 15), dxfattribs={"layer": "Wand-Hilfe"})

    assert ("Wand-Hilfe", "left out", 1, "layer that is not printed") in parts(read(tmp_path, build))
    assert len(read(tmp_path, build, layers=["W*"]).walls) == WALLS + 1


@pytest.mark.parametrize("nested", [False, True])
def test_what_a_clip_cuts_away_is_not_there(tmp_path: Path, nested: bool) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(block := document.blocks.new("WHOLE"), layer="0")
        block.add_line((10, 8), (10, 28), dxfattribs={"layer": "0"})
        holder = document.blocks.new("OUTER") if nested else space
        insertion = holder.add_blockref("WHOLE", (100, 50), dxfattribs={"layer": "Wände"})
        XClip(insertion).set_block_clipping_path([(-1, -1), (21, 11)])
        if nested:
            space.add_blockref("OUTER", (-100, -50), dxfattribs={"xscale": 2, "yscale": 2})

    left, right, low, high = read(tmp_path, build).bounds
    assert (right - left, high - low) == pytest.approx((40, 22) if nested else (20, 11))


@pytest.mark.parametrize("kind", ["HATCH", "SOLID", "TRACE", "3DFACE", "width"])
def test_filled_shapes_on_layers_of_walls_are_walls(tmp_path: Path, kind: str) -> None:
    corners, like = [(10.0, 2.0), (10.3, 2.0), (10.3, 8.0), (10.0, 8.0)], {"layer": "Wand"}

    def build(document: Any, space: Any) -> None:
        space.add_lwpolyline([(0, 0), (20, 0), (20, 10), (0, 10)], close=True, dxfattribs=like)
        if kind == "HATCH":
            space.add_hatch(dxfattribs=like).paths.add_polyline_path(corners, is_closed=True)
        elif kind == "width":
            space.add_lwpolyline([(10.15, 2), (10.15, 8)], dxfattribs={**like, "const_width": 0.3})
        elif kind == "3DFACE":
            space.add_3dface(corners, dxfattribs=like)
        else:
            first, second, third, fourth = corners
            {"SOLID": space.add_solid, "TRACE": space.add_trace}[kind]([first, second, fourth, third], dxfattribs=like)

    inner = read(tmp_path, build).walls[4:].reshape(-1, 2)
    assert (*inner.min(axis=0), *inner.max(axis=0)) == pytest.approx((10, 2, 10.3, 8))


def test_a_filled_floor_is_no_wall(tmp_path: Path) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(space)
        hatch = space.add_hatch(dxfattribs={"layer": "Wände"})
        hatch.paths.add_polyline_path([(0, 0), (5, 0), (5, 10), (0, 10)], is_closed=True)

    drawing = read(tmp_path, build)
    assert len(drawing.walls) == WALLS
    assert ("Wände", "left out", 1, "filled areas") in parts(drawing)


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(space)
        space.add_polyface(dxfattribs={"layer": "Wände"}).append_face([(0, 0, 0), (1, 0, 0), (1, 1, 0)])
        document.add_xref_def("bau/core.dwg", "core")
        space.add_blockref("core", (0, 0))

    drawing = read(tmp_path, build)
    assert ("Wände", "left out", 1, "POLYLINE cannot be read") in parts(drawing)
    assert "the drawing bau/core.dwg, which it refers to, is not in the file" in drawing.notes[0]
    assert "type POLYLINE on layer Wände cannot be read" in drawing.notes[1]


def test_binary_files_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, lambda document, space: add_floor(space), fmt="bin")
    assert len(read_dxf(path, PlanSource(file=path.name)).walls) == WALLS
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(OSError, match="cannot be read as DXF"):
        read_dxf(path, PlanSource(file=path.name))
