"""Names of layers and blocks in five languages."""

from __future__ import annotations

import unicodedata

import pytest

from vislam2tag.site.dxf.layers import Kind, kind_of

NAMES = {
    Kind.WALL: """
        Wände Waende WÄNDE wande A-WALL A-WALL-EXTR Außenwände Trennwand InnenWand Mauerwerk 01_Waende Brandschutzwand
        Cloisons murs mur_porteur mur_cote_rue Murs-côté-jardin Cloisons-sanitaires muri pareti tramezzi paredes
        tabiques Wände_und_Türen Wände&Türen xref|A-WALL x$0$A-FURN$0$WAND Wände_geschnitten Treppenhauswände
        WALL200 façades
    """,
    Kind.PART: "Fenster Stützen Stuetzen Stutzen A-GLAZ S-COLS fenêtres finestre ventanas pilastri poteaux Säulen",
    Kind.DOOR: """
        Tür Türen TUEREN Innentür_90 Haustuer Schiebetur A-DOOR porte porta puertas Fenstertür Tuer90 TuerBlatt Tor
        Garagentor porte-fenêtre menuiseries Infissi carpintería
    """,
    Kind.ANNOTATION: """
        Bemaßung Bemassung BEMASZUNG Maße A-WALL-DIMS A-WALL-CNTR-ANNO cotes COTE mur-cote quote acotado cotas Texte
        Beschriftung Wandbeschriftung Türnummern A-DOOR-IDEN Raumstempel cartouche Plankopf Etichette Defpoints
    """,
    Kind.HATCH: "A-WALL-PATT Wandschraffur Schraffuren hachures tratteggio",
    Kind.GRID: "A-WALL-CNTR Achsen Wandachsen S-GRID ejes",
    Kind.FURNITURE: "Einrichtung Möbel Moebel Mobel MOBILIER Mobiliario arredo A-FURN Wandschrank Wandmöbel meubles",
    Kind.ELECTRICAL: "Elektro E-LITE Wandleuchten électricité elettrico",
    Kind.OVERHEAD: "A-WALL-HEAD Unterzüge Dach linteaux",
    Kind.SANITARY: "Sanitär Sanitaer P-SANR-FIXT Armaturen plomberie",
    Kind.STAIRS: "Treppe escalier escalera A-FLOR-STRS Geländer",
    Kind.UNKNOWN: "0 Bestand Architektur Struktur Textur Kontur Motor Sektor Indoor Grundriss Aufwand Murnau",
}


@pytest.mark.parametrize("kind", NAMES)
def test_words_of_five_languages(kind: Kind) -> None:
    assert {name: kind_of(name) for name in NAMES[kind].split()} == dict.fromkeys(NAMES[kind].split(), kind)


def test_accents_may_be_letters_of_their_own() -> None:
    assert kind_of(unicodedata.normalize("NFD", "Wände")) == Kind.WALL
