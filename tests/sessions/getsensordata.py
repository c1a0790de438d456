"""Lines of made GetSensorData logs."""

from __future__ import annotations

import numpy as np

from vislam2tag.site.georeference import Georeference, to_wgs84

BOOT_S = 5000.25
"""The phone's clock when the app's began."""
HEAD = (
    "% LogFile created by the 'GetSensorData' App for Android.\n"
    "% Date of creation: Thu Jul 07 12:31:03 CEST 2016\n"
    "% Phone used for this logfile:\n"
    "% Manufacturer:            \tsamsung\n"
    "% Model:                   \tSM-A310F\n"
    "% WIFI data: \t'WIFI;AppTimestamp(s);SensorTimeStamp(s);Name_SSID;MAC_BSSID;Frequency;RSS(dBm);'\n"
)
HEAD_LINES = HEAD.count("\n")
ORIGIN = Georeference(latitude_deg=40.3133, longitude_deg=-3.4835)
MAC, OTHER = "00:0b:86:27:36:c1", "00:0b:86:27:36:c2"


def posi(at_s: float, east_m: float, north_m: float, floor: float = 1, building: int = 2) -> str:
    longitude, latitude = to_wgs84(np.array([[east_m, north_m]]), ORIGIN)[0]
    return f"POSI;{at_s:.3f};1;{latitude:.9f};{longitude:.9f};{floor:g};{building}"


def wifi(at_s: float, seen_s: float, rssi: int = -71, mac: str = MAC, ssid: str = "eduroam", new: bool = True) -> str:
    seen = "" if np.isnan(seen_s) else f"{seen_s:.3f}"
    return f"WIFI;{at_s:.3f};{seen};{ssid};{mac};{'2412;' if new else ''}{rssi}"


def acce(at_s: float, boot_s: float = BOOT_S, kind: str = "ACCE") -> str:
    return f"{kind};{at_s:.3f};{at_s + boot_s - 0.005:.3f};0.1;0.2;9.8;3"


def text(*rows: str) -> bytes:
    return (HEAD + "\n".join(rows) + "\n").encode()
