"""How well drawings of floors are read: the campaign of docs/results/drawings.md.

    python benchmarks/drawings.py                    60 generated drawings
    python benchmarks/drawings.py --only dxf-de      those whose name contains a text
    python benchmarks/drawings.py --keep FOLDER      also keep the drawings and sites

Each drawing goes through ``site init`` and ``site walkable``, with the options that its maker would pass: the size of
a picture, or the storey. The walkable area is compared with that between the walls.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

import drawing_files as files  # noqa: E402
from drawing_files import DrawnFloor, DxfStyle, PictureStyle  # noqa: E402
from typer.testing import CliRunner  # noqa: E402

from vislam2tag.cli.app import app  # noqa: E402

RIGHT, WRONG = 0.05, 0.15
EARTH = f"--georeference {files.EARTH[0]},{files.EARTH[1]},0"
_Write = Callable[[DrawnFloor, Path], None]


@dataclass(frozen=True)
class Drawing:
    """A drawing: its file's name, how it is written, and the options for ``site init``."""

    name: str
    file: str
    write: _Write
    options: str = ""

    @property
    def thin(self) -> bool:
        """Whether walls are drawn without their thickness."""
        return any(word in self.name for word in ("single", "rooms", "levels", "imdf"))


def dxf(name: str, options: str = "", **style: Any) -> Drawing:
    """A DXF drawing with a style."""
    return Drawing(
        f"dxf-{name}", "plan.dxf", lambda floor, path: files.write_dxf(floor, DxfStyle(**style), path), options
    )


def picture(name: str, style: PictureStyle, suffix: str = ".png") -> Drawing:
    """A picture whose width is known."""
    return Drawing(
        f"picture-{name}",
        f"plan{suffix}",
        lambda floor, path: files.write_picture(floor, style, path),
        "--width-m {width}",
    )


def _two_levels(floor: DrawnFloor) -> list[dict[str, Any]]:
    return [*files.indoor_features(floor, "0"), *files.indoor_features(_other(floor), "1")]


def _other(floor: DrawnFloor) -> DrawnFloor:
    return DrawnFloor.of(round(1000 * floor.width_m), thin=True)


LANGUAGES = ("en", "de", "fr", "it", "es")
DRAWINGS: tuple[Drawing, ...] = (
    *(dxf(f"{lang}-lines", language=lang) for lang in LANGUAGES),
    *(dxf(f"{lang}-outlines", language=lang, form=1, walls="outlines", unit="m") for lang in LANGUAGES),
    *(dxf(f"{lang}-hatch", language=lang, walls="hatch", unit="cm") for lang in LANGUAGES),
    *(dxf(f"{lang}-solids", language=lang, form=1, walls="solids", unit="m") for lang in LANGUAGES),
    *(dxf(f"{lang}-single", language=lang, walls="single") for lang in LANGUAGES),
    *(dxf(f"{lang}-block", language=lang, form=1, walls="block", extras=("frame",)) for lang in LANGUAGES),
    dxf("inches", unit="in"),
    dxf("wrong-unit", unit="m", said_unit="in"),
    dxf("no-unit", "--unit-m 0.001", said_unit=""),
    dxf("stray", extras=("stray",)),
    dxf("frozen", language="de", extras=("frozen",)),
    dxf("clipped", extras=("clipped",)),
    dxf("storeys", "--area 0,0,{width_mm},{height_mm}", extras=("storeys",)),
    dxf("binary", language="de", binary=True),
    Drawing("geojson-walls", "plan.geojson", lambda f, p: files.write_geojson(files.wall_features(f), p), EARTH),
    Drawing("geojson-rooms", "plan.geojson", lambda f, p: files.write_geojson(files.indoor_features(f, "0"), p), EARTH),
    Drawing(
        "geojson-levels",
        "plan.geojson",
        lambda f, p: files.write_geojson(_two_levels(f), p),
        f"{EARTH} --level 0",
    ),
    Drawing("osm-rooms", "plan.osm", lambda f, p: files.write_osm(files.indoor_features(f, "0"), p), EARTH),
    Drawing(
        "osm-levels",
        "plan.osm",
        lambda f, p: files.write_osm(_two_levels(f), p),
        f"{EARTH} --level 0",
    ),
    Drawing("imdf-folder", "imdf", lambda f, p: files.write_imdf([f], p), EARTH),
    Drawing("imdf-levels", "imdf", lambda f, p: files.write_imdf([f, _other(f)], p), f"{EARTH} --level L0"),
    Drawing("ifc-millimetres", "plan.ifc", lambda f, p: files.write_ifc([f], p)),
    Drawing("ifc-metres", "plan.ifc", lambda f, p: files.write_ifc([f], p, prefix="")),
    Drawing("ifc-storeys", "plan.ifc", lambda f, p: files.write_ifc([f, _other(f)], p), "--level 'Level 0'"),
    picture("filled", PictureStyle()),
    picture("outlined", PictureStyle(filled=False)),
    picture("swings", PictureStyle(extras=("swings",))),
    picture("hatched", PictureStyle(filled=False, extras=("hatched", "swings"))),
    picture("coloured", PictureStyle(extras=("coloured", "swings"))),
    picture("legend", PictureStyle(extras=("legend", "swings"))),
    picture("boxed", PictureStyle(extras=("boxed",))),
    picture("fine", PictureStyle(pixels_per_m=60, extras=("swings",))),
    picture("coarse", PictureStyle(pixels_per_m=12)),
    picture("jpg", PictureStyle(extras=("swings",)), ".jpg"),
    Drawing("svg", "plan.svg", files.write_svg, "--scale 1:100"),
    Drawing("pdf", "plan.pdf", files.write_pdf, "--scale 1:100"),
)


@dataclass(frozen=True)
class Outcome:
    """What became of a drawing: relative error of the area, None if it was refused; warnings and errors."""

    name: str
    error: float | None
    said: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """A column of the table."""
        if self.error is None:
            return "refused"
        wide = "right" if abs(self.error) <= RIGHT else "wrong" if abs(self.error) > WRONG else "inexact"
        return f"{wide}, warning" if self.said else wide


def run(drawing: Drawing, seed: int, folder: Path) -> Outcome:
    """Write a drawing, make a site of it, and compare its area."""
    floor = DrawnFloor.of(seed, thin=drawing.thin)
    folder.mkdir(parents=True)
    drawing.write(floor, folder / drawing.file)
    sizes = {"width": floor.width_m, "height": floor.height_m}
    sizes |= {"width_mm": 1000 * floor.width_m + 500, "height_mm": 1000 * floor.height_m + 500}
    options = drawing.options.format(**sizes)
    code, text = _command(
        ["site", "init", folder / "site", "--plan", folder / drawing.file, "--floor", 0, *_words(options)]
    )
    said = [line for line in text.splitlines() if line.startswith(("warning: ", "error: "))]
    if code:
        return Outcome(drawing.name, None, tuple(said or text.splitlines()[-1:]))
    code, text = _command(["site", "walkable", folder / "site", "--out", folder / "walkable", "--json"])
    if code:
        return Outcome(drawing.name, None, (*said, text.strip()))
    (found,) = json.loads(text[text.index("[") :])
    return Outcome(drawing.name, found["area_m2"] / floor.area_m2 - 1, tuple(said))


def _words(options: str) -> list[str]:
    import shlex

    return shlex.split(options)


def _command(words: Sequence[object]) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words], terminal_width=200)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        if type(result.exception).__module__.startswith("vislam2tag"):
            return 2, f"error: {result.exception}"
        return 2, f"error: Traceback {result.exception!r}"
    return result.exit_code, result.output


def main() -> None:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--seed", type=int, default=300, help="of the first floor")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    chosen = [(number, each) for number, each in enumerate(DRAWINGS) if options.only in each.name]
    with tempfile.TemporaryDirectory() as scratch:
        work = options.keep or Path(scratch)
        outcomes = []
        for number, drawing in chosen:
            shutil.rmtree(work / drawing.name, ignore_errors=True)
            outcomes.append(run(drawing, options.seed + number, work / drawing.name))
            print(f"{drawing.name}: {outcomes[-1].verdict}", file=sys.stderr, flush=True)
    print("| drawing | area, error in % | result | said |\n| --- | ---: | --- | --- |")
    for each in outcomes:
        error = "-" if each.error is None else f"{100 * each.error:+.1f}"
        print(f"| {each.name} | {error} | {each.verdict} | {'; '.join(each.said).replace('|', '/')} |")
    print(f"\n{len(outcomes)} drawings: " + ", ".join(f"{verdict} {count}" for verdict, count in _counted(outcomes)))


def _counted(outcomes: Sequence[Outcome]) -> list[tuple[str, int]]:
    names = sorted({each.verdict for each in outcomes})
    return [(name, sum(each.verdict == name for each in outcomes)) for name in names]


if __name__ == "__main__":
    main()
