"""What lines become, by names of layers and blocks, by choice and by shape."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.site.dxf.drawings import WALLS, Build, add_floor, parts, read


def add_more(space: Any, layer: str) -> None:
    """Lines across all rooms and beyond the floor."""
    for y in (2, 5, 12):
        space.add_line((-1, y), (21, y), dxfattribs={"layer": layer})


def floor_and(layer: str, more: str) -> Build:
    def build(_: object, space: Any) -> None:
        add_floor(space, layer=layer)
        add_more(space, more)

    return build


@pytest.mark.parametrize("layer", ["Bemaßung", "A-WALL-DIMS", "Cotes", "Mobilier", "Elektro", "Wandschraffur"])
@pytest.mark.parametrize("walls", ["Wände", "CLOISONS", "pareti", "Tabiques", "Bestand"])
def test_what_is_called_after_other_things_is_left_out(tmp_path: Path, walls: str, layer: str) -> None:
    drawing = read(tmp_path, floor_and(walls, layer))
    assert drawing.bounds == pytest.approx((0, 20, 0, 10))
    assert {name: became for name, became, _, _ in parts(drawing)} == {walls: "walls", layer: "left out"}
    assert not drawing.notes


def test_windows_alone_are_not_all_walls(tmp_path: Path) -> None:
    drawing = read(tmp_path, floor_and("Bestand", "Fenster"))
    assert {became for _, became, _, _ in parts(drawing)} == {"walls"}


@pytest.mark.parametrize(
    ("block", "became"), [("Innentür_90", "doors"), ("Tisch_120", "left out"), ("Stütze", "walls"), ("B17", "walls")]
)
def test_blocks_on_layers_of_walls_are_what_they_are_called(tmp_path: Path, block: str, became: str) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(space)
        document.blocks.new(block).add_line((0, 0), (0.9, 0))
        space.add_blockref(block, (2, 2), dxfattribs={"layer": "Wände"})

    drawing = read(tmp_path, build)
    assert [each for _, each, count, _ in parts(drawing) if count != 7] == (
        [became] if became != "walls" else ["walls"]
    )
    assert len(drawing.walls) == WALLS + (became == "walls")


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        ({"layers": ["neu"]}, {("neu", "walls", 7, ""), ("Wand", "left out", 3, "not among the layers of walls")}),
        ({"doors": ["W?nd"], "layers": ["neu"]}, {("neu", "walls", 7, ""), ("Wand", "doors", 3, "")}),
        ({"ignore": ["wand"]}, {("neu", "walls", 7, ""), ("Wand", "left out", 3, "as chosen")}),
        (
            {"doors": ["w*"], "layers": ["*"]},
            {("neu", "walls", 7, ""), ("Wand", "doors", 3, "--doors counts before --walls")},
        ),
        ({"doors": ["*"], "layers": ["NEU"]}, {("neu", "walls", 7, ""), ("Wand", "doors", 3, "")}),
    ],
)
def test_layers_are_chosen(tmp_path: Path, choice: dict[str, object], expected: object) -> None:
    drawing = read(tmp_path, floor_and("neu", "Wand"), **choice)
    assert parts(drawing) == expected


@pytest.mark.parametrize(
    ("choice", "options"),
    [
        ({"doors": ["Wand"], "layers": ["wand", "neu"]}, "--doors and --walls"),
        ({"ignore": ["wand"], "doors": ["Wand"]}, "--ignore and --doors"),
    ],
)
def test_a_layer_cannot_be_two_things(tmp_path: Path, choice: dict[str, object], options: str) -> None:
    with pytest.raises(OSError, match=f"^has one layer Wand, which {options} both name: keep one of them$"):
        read(tmp_path, floor_and("neu", "Wand"), **choice)


@pytest.mark.parametrize("choice", ["layers", "doors", "ignore"])
def test_layers_that_are_not_there(tmp_path: Path, choice: str) -> None:
    with pytest.raises(OSError, match=r"^has no layer nix; there are: Wände$"):
        read(tmp_path, lambda document, space: add_floor(space), **{choice: ["nix"]})


def test_layers_of_which_it_is_not_clear_are_noted(tmp_path: Path) -> None:
    two = read(tmp_path, floor_and("neu", "alt"))
    assert two.notes[0].startswith("no layer is called after walls, so all lines on alt, neu became walls")
    more = read(tmp_path, floor_and("neu", "Wand"))
    assert more.notes[0].startswith("layer neu contains more lines (7) than all walls (3) and is left out")


@pytest.mark.parametrize("leaf", ["line", "box", "none"])
def test_doors_that_are_drawn_without_a_block_stay_open(tmp_path: Path, leaf: str) -> None:
    def build(document: Any, space: Any) -> None:
        add_floor(space)
        space.add_arc((5, 4), 2.0, 0, 90, dxfattribs={"layer": "Wände"})
        width = {"line": 0.0, "box": 0.05}.get(leaf)
        if width is not None:
            corners = [(5, 4), (7, 4), (7, 4 + width), (5, 4 + width)] if width else [(5, 4), (7, 4)]
            space.add_lwpolyline(corners, close=bool(width), dxfattribs={"layer": "Wände"})

    drawing = read(tmp_path, build)
    assert (len(drawing.walls) == WALLS) == bool(len(drawing.doors)) == (leaf != "none")
