from __future__ import annotations

import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.preparation.registration.point_columns import PointColumn, known_column, parse_columns


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("point,E", "required columns are missing: N"),
        ("point,E,N,N", "appears twice"),
        ("point,E,N,colour", "'colour' is not a column"),
    ],
)
def test_wrong_columns_are_told(columns: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_columns(columns)


@pytest.mark.parametrize(
    ("column", "names"),
    [
        (
            PointColumn.POINT,
            "Punktnummer|Pkt.-Nr.|N° de point|numéro|Matricule|Nome punto|Número de punto|Pto|Point ID",
        ),
        (PointColumn.EAST, "Rechtswert [m]|Ost|Est|Este_m|E-Koordinate|Easting (ft)|East in m|Y (Rechtswert)"),
        (PointColumn.NORTH, "Hochwert|Nordwert|nord|Norte|N [US survey feet]|Hochwert X|X [Nord]|x_north"),
        (PointColumn.HEIGHT, "Höhe ü. NN|HÖHE|Altitude|Quota s.l.m.|Cota|Z-Koordinate|Elev."),
        (PointColumn.CODE, "Codice|Código|Bemerkung"),
        (None, "X|Y|X [m]|Y (LV95)|Zielhöhe|Instrument height|Datum|Ouest|"),
    ],
)
def test_columns_are_known_in_five_languages(column: PointColumn | None, names: str) -> None:
    assert {name: known_column(name) for name in names.split("|")} == dict.fromkeys(names.split("|"), column)
