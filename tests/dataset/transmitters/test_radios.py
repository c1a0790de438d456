from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.dataset.transmitters.radios import LEAST_SCANS, pair_differences, radios, sum_of_differences

SCANS = 40


def readings(
    *transmitters: tuple[str, int],
    fading_db: float = 1.5,
    step_db: float = 8.0,
    mhz: float | None = 2437.0,
    scans: int = SCANS,
    delay_ns: int = 0,
    first: int = 0,
) -> pl.DataFrame:
    """Hear (address, place) in each scan: addresses of one place share what changes along the walk."""
    rng = np.random.default_rng(len(transmitters) + first)
    places = {place for _, place in transmitters}
    mean = {place: -60 + rng.normal(0, step_db, scans) for place in places}
    return pl.concat(
        pl.DataFrame(
            {
                "scan_id": [f"walk/wifi/{first + scan:06d}" for scan in range(scans)],
                "bssid": bssid,
                "rssi_dbm": (mean[place] + rng.normal(0, fading_db, scans)).astype(np.float32),
                "frequency_mhz": mhz,
                "time_ns": np.arange(scans) * 4_000_000_000 + number * delay_ns,
            },
            schema_overrides={"frequency_mhz": pl.Float32},
        )
        for number, (bssid, place) in enumerate(transmitters)
    )


def grouped(table: pl.DataFrame) -> dict[str, str | None]:
    return dict(radios(table["bssid"].unique().sort(), pair_differences(table)).iter_rows())


def together(table: pl.DataFrame) -> bool:
    return len(set(grouped(table).values())) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("04:40:a9:a1:95:40", "04:40:a9:a1:95:42"),
        ("04:40:a9:a1:95:4f", "04:40:a9:a1:95:50"),
        ("cc:2d:e0:2a:cc:fb", "ce:2d:e0:2a:cc:fb"),
        ("e6:cb:ac:32:da:f5", "ee:cb:ac:32:da:f5"),
    ],
)
def test_addresses_counted_on_and_equally_loud_are_one_radio(one: str, other: str) -> None:
    assert grouped(readings((one, 0), (other, 0))) == {one: one, other: one}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("04:40:a9:a1:95:40", "04:40:a9:a1:95:60"),
        ("04:40:a9:a1:95:40", "04:40:a9:a1:96:40"),
        ("04:40:a9:a1:95:40", "08:40:a9:a1:95:40"),
        ("cc:2d:e0:2a:cc:fb", "ce:2d:e0:2a:cc:fc"),
    ],
)
def test_other_addresses_are_not_however_loud(one: str, other: str) -> None:
    assert not together(readings((one, 0), (other, 0)))


def test_neighbouring_addresses_at_two_places_are_two_radios() -> None:
    assert not together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 1)))


def test_a_radio_has_one_channel() -> None:
    low = readings(("04:40:a9:a1:95:40", 0), mhz=2437.0)
    high = low.with_columns(bssid=pl.lit("04:40:a9:a1:95:41"), frequency_mhz=pl.lit(5180.0, pl.Float32))
    assert not together(pl.concat([low, high]))


def test_channels_that_nobody_wrote_down_do_not_hinder() -> None:
    assert together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0), mhz=None))


def test_readings_of_different_moments_say_nothing() -> None:
    assert not together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0), delay_ns=1_000_000_000))


def test_data_without_times_is_compared_by_scan() -> None:
    table = readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0))
    assert together(table.with_columns(time_ns=pl.lit(None, pl.Int64)))


def test_few_scans_prove_nothing() -> None:
    pair = ("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0)
    assert not together(readings(*pair, scans=LEAST_SCANS - 1))
    assert together(readings(*pair, scans=LEAST_SCANS))


def test_a_radio_is_named_by_its_least_address_over_links_of_pairs() -> None:
    names = ["04:40:a9:a1:95:40", "04:40:a9:a1:95:4a", "04:40:a9:a1:95:54"]
    assert grouped(readings(*((name, 0) for name in names))) == dict.fromkeys(names, names[0])


def test_an_identifier_that_is_no_address_has_no_known_radio() -> None:
    assert grouped(readings(("WAP001", 0))) == {"WAP001": None}


def test_sums_over_parts_are_the_sum_over_all() -> None:
    pair = ("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0)
    parts = [readings(*pair, first=0), readings(*pair, first=SCANS)]
    (whole,) = pair_differences(pl.concat(parts)).rows()
    (summed,) = sum_of_differences([pair_differences(part) for part in parts]).rows()
    assert summed == pytest.approx(whole)


def test_generated_radios_are_found_again() -> None:
    """Sixty radios of one delivery with three networks each, addresses 4 apart so that all radios are neighbours."""
    transmitters = [
        (f"04:40:a9:a1:{radio // 60:02x}:{4 * (radio % 60) + net:02x}", radio)
        for radio in range(60)
        for net in range(3)
    ]
    table = readings(*transmitters, fading_db=2.0)
    found = grouped(table)
    truth = dict(transmitters)
    assert sum(1 for bssid in found if found[bssid] == min(b for b in truth if truth[b] == truth[bssid])) == len(truth)
