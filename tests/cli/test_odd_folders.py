"""The whole chain of commands in folders whose names mean something to shells, patterns and addresses."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import polars as pl
import pytest

from vislam2tag.cli import main

ODD = Path("a[1]/b*/c?/{d}/%41/k=v/a b/Gebäude/🏠/-dash/file:/ds[1]", "x" * 200)


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> None:
    monkeypatch.setattr(sys, "argv", ["vislam2tag", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in (None, 0), arguments


def label(monkeypatch: pytest.MonkeyPatch, root: Path, seed: int) -> pl.DataFrame:
    """Simulate a survey below ``root``, label it, make a data set of it, and return what is exported of that."""
    root.mkdir(parents=True)
    survey, labels, made = root / "survey[1]", root / "labels*", root / "set[1]"
    shape = ("--floors", "1", "--devices", "1", "--sessions", "2", "--minutes", "1", "--landmark-count", "20")
    run(monkeypatch, "simulate", survey, *shape, "--severity", "none", "--seed", str(seed))
    (device,) = (folder for folder in (survey / "floor_0").iterdir() if folder.is_dir() and any(folder.glob("*/*.csv")))
    device.rename(survey / "floor_0" / "LG[1]")
    run(monkeypatch, "process", survey, "--out", labels, "--device", "LG[1]", "--jobs", "1")
    run(monkeypatch, "dataset", labels, "--survey", survey, "--out", made, "--jobs", "1")
    run(monkeypatch, "export", made, "--format", "parquet", "--out", root / "export[1]")
    with (root / "export[1]" / "fingerprints.parquet").open("rb") as file:
        return pl.read_parquet(file)


@pytest.mark.slow
def test_a_folder_beside_one_that_its_name_matches_keeps_its_own_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    neighbour = label(monkeypatch, Path(str(ODD).replace("[1]", "1")), seed=1)
    own = label(monkeypatch, ODD, seed=2)
    assert own.height
    assert not own.equals(neighbour)
    made, model = ODD / "set[1]", ODD / "m?.v2t"
    run(monkeypatch, "split", made)
    run(monkeypatch, "train", made, "--model", "weighted-knn", "--out", model)
    run(monkeypatch, "locate", model, made, "--track", ODD / "labels*", "--out", ODD / "p[1].csv")
    assert len((ODD / "p[1].csv").read_text().splitlines()) == own.height + 1
    run(monkeypatch, "verify", ODD / "labels*", ODD / "labels*")
    run(monkeypatch, "import", ODD / "export[1]", "--out", ODD / "again[1]")
    run(monkeypatch, "join", made, ODD / "again[1]", "--out", ODD / "joined[1]")
    run(monkeypatch, "evaluate", ODD / "survey[1]", "--out", ODD / "e[1]", "--device", "LG[1]", "--jobs", "1")
    assert json.loads((ODD / "e[1]" / "evaluation.json").read_text())["sessions"]
