"""``vislam2tag radio-maps`` as its users run it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import bssid, small_dataset
from vislam2tag.cli.commands_datasets import metres_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import write_dataset


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "set"
    write_dataset(small_dataset(), folder)
    return folder


@pytest.mark.usefixtures("undrawn_figures")
def test_maps_are_written_and_told(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("radio-maps", dataset, "--out", tmp_path / "maps", "--cell", "2m", "--most", "2")
    assert done.returncode == 0, done.stderr
    assert "Radio maps" in done.stdout
    assert "only the 2 most heard access points of a floor are mapped; --most takes more" in done.stdout
    assert f"page: {tmp_path / 'maps' / 'index.html'}\nnext: vislam2tag train " in done.stdout
    names = sorted(path.name for path in (tmp_path / "maps").iterdir() if path.name[0] != ".")
    assert names == ["figures", "floor_0.wifi.npz", "floor_1.wifi.npz", "geotiff", "index.html", "radio_maps.json"]
    assert len(list((tmp_path / "maps" / "geotiff").rglob("*.tif"))) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--ap", "00:00"), "--ap 00:00: is no access point of this data set"),
        (("--cell", "1"), "--cell 1: give a length above zero with its unit, such as 1m or 50cm"),
        (("--cell", "1mm"), "--cell 1mm: give a length"),
        (("--reach", "0m"), "--reach 0m: give a length"),
        (("--cell", "1cm"), "choose a larger --cell"),
    ],
)
def test_wrong_values_are_told_in_one_line(
    arguments: tuple[str, ...], message: str, dataset: Path, tmp_path: Path
) -> None:
    done = vislam2tag("radio-maps", dataset, "--out", tmp_path / "maps", *arguments)
    assert message in the_error(done)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_no_data_set_is_told(tmp_path: Path) -> None:
    assert "is no data set" in the_error(vislam2tag("radio-maps", tmp_path, "--out", tmp_path / "maps"))


def test_nothing_labelled_is_told(tmp_path: Path) -> None:
    write_dataset(small_dataset(unlabelled=12), tmp_path / "set")
    done = vislam2tag("radio-maps", tmp_path / "set", "--out", tmp_path / "maps", "--ap", bssid(0, 0))
    assert "there is nothing to map" in the_error(done)


@pytest.mark.parametrize(("text", "metres"), [("1m", 1.0), ("50cm", 0.5), (" 1.5 m ", 1.5)])
def test_lengths_have_a_unit(text: str, metres: float) -> None:
    assert metres_of(text, "--cell") == pytest.approx(metres)


@pytest.mark.parametrize("text", ["", "1", "-1m", "1km", "m"])
def test_other_lengths_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--cell"):
        metres_of(text, "--cell")
