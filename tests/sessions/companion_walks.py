"""Walks with a companion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import IntArray
from vislam2tag.sessions.model import Session

METADATA = (
    "version,device name,recording epoch time,recording time,recording timezone,platform,appVersion,device id,sensors,"
    "sampleRateMs,standardisation\n3,Pixel 6,1700000000000,2023-11-14_22-13-20,Europe/Berlin,{platform},1.30,x,"
    "a|b,0,false\n"
)


@dataclass(frozen=True)
class OtherClock:
    """``offset_s`` by which it is ahead when the walk's shows ``zero_ns``, and how much it gains (``rate``)."""

    offset_s: float
    rate: float
    zero_ns: int

    def of(self, our_ns: IntArray) -> IntArray:
        gained = np.round((our_ns - self.zero_ns) * self.rate).astype(np.int64)
        return np.asarray(our_ns + gained + round(self.offset_s * 1e9))


def write_sensor_logger(
    folder: Path, walk: Session, clock: OtherClock, *, every: int = 2, noise: float = 0.02, platform: str = "android"
) -> None:
    """Write what was felt and heard on a walk: every so many readings of the walk's own sensors, with noise."""
    folder.mkdir(parents=True)
    (folder / "Metadata.csv").write_text(METADATA.format(platform=platform), encoding="utf-8")
    rng = np.random.default_rng(5)
    for sensor, name in (("GYRO", "Gyroscope.csv"), ("ACC", "TotalAcceleration.csv")):
        rows = walk.tables["sensors"].filter((pl.col("sensor") == sensor) & ~pl.col("repeated"))[1::every]
        values = rows.select("v1", "v2", "v3").to_numpy() + rng.normal(0, noise, (rows.height, 3))
        zero = int(clock.of(rows["time_ns"].to_numpy())[0])
        lines = [
            f"{ns},{(ns - zero) * 1e-9:.9f},{z:.6f},{y:.6f},{x:.6f}"
            for ns, (x, y, z) in zip(clock.of(rows["time_ns"].to_numpy()).tolist(), values.tolist(), strict=True)
        ]
        (folder / name).write_text("\n".join(("time,seconds_elapsed,z,y,x", *lines)) + "\n", encoding="utf-8")
    heard = walk.tables["wifi"].filter(~pl.col("repeated"))
    lines = [
        f'{ns},0,"{ssid}",{bssid.upper()},{frequency or 2412},{level:.0f},[WPA2]'
        for ns, ssid, bssid, frequency, level in zip(
            clock.of(heard["time_ns"].to_numpy()).tolist(),
            heard["ssid"].to_list(),
            heard["bssid"].to_list(),
            heard["frequency_mhz"].to_list(),
            heard["rssi_dbm"].to_list(),
            strict=True,
        )
    ]
    header = "time,seconds_elapsed,ssid,bssid,frequency,level,capabilities"
    (folder / "WiFi.csv").write_text("\n".join((header, *lines)) + "\n", encoding="utf-8")
