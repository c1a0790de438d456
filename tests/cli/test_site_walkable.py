from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from tests.walkable.hand_made import HEIGHT_M, MARGIN_M, WIDTH_M, plan, walls
from vislam2tag.cli import main


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["vislam2tag", "site", "walkable", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_tells_what_it_found_and_what_is_closed_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site"
    (site / "floor_0").mkdir(parents=True)
    (site / "floor_dimensions.csv").write_text(
        f"id,width,height\n0,{WIDTH_M + 2 * MARGIN_M},{HEIGHT_M + 2 * MARGIN_M}\n"
    )
    Image.fromarray(plan(10, lines=walls(gate=False)).image).save(site / "floor_0" / "floorplan.png")
    assert run(monkeypatch, str(site), "--out", str(tmp_path / "out"), "--wall-contrast", "0.4") == 0
    shown = capsys.readouterr().out
    assert "Walkable space" in shown
    assert "floor 0: closed off by walls and left out" in shown
    assert "written" in shown
    (tmp_path / "own.toml").write_text("[walkable]\nwall_contrast = 0.3\ncell_m = 0.2\n")
    config = ("--config", str(tmp_path / "own.toml"), "--wall-contrast", "0.4")
    assert run(monkeypatch, str(site), "--out", str(tmp_path / "out"), *config) == 0
    kept = json.loads((tmp_path / "out" / "walkable.json").read_text())["settings"]["walkable"]
    assert (kept["wall_contrast"], kept["cell_m"]) == (0.4, 0.2)
    assert run(monkeypatch, str(site), "--floor", "9", "--out", str(tmp_path / "out")) == 2
