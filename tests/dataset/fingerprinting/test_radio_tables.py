from __future__ import annotations

from tests.dataset.labelled_rows import labelled
from vislam2tag.dataset.fingerprinting.radio_tables import radio_rows
from vislam2tag.labeling.schemas import SCHEMAS


def test_beacons_are_known_by_their_identity_others_by_their_address() -> None:
    rows = [
        {"address": "c2:01", "name": "desk", "uuid": "32ff", "major": 1, "minor": 7, "rssi_dbm": -60.0},
        {"address": "c2:02", "name": "", "rssi_dbm": -70.0},
    ]
    table = radio_rows(labelled("ble", rows), "ble")
    assert table["bssid"].to_list() == ["32ff-1-7", "c2:02"]
    assert table["ssid"].to_list() == ["desk", ""]
    assert set(table.columns) == set(SCHEMAS["wifi"])
    assert all(table.schema[name] == kind for name, kind in SCHEMAS["wifi"].items())


def test_wifi_stays_as_it_is() -> None:
    table = labelled("wifi", [{"scan": 1, "bssid": "a", "ssid": "", "rssi_dbm": -60.0}])
    assert radio_rows(table, "wifi") is table
