"""What names of layers and blocks stand for: English, German, French, Italian and Spanish words, and AIA codes."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from enum import StrEnum
from functools import cache


class Kind(StrEnum):
    """What a name stands for; the value says why it is left out, if it is."""

    WALL = "walls"
    PART = "windows or columns"
    DOOR = "doors"
    ANNOTATION = "text, dimensions or symbols"
    HATCH = "hatches and patterns"
    GRID = "grid or centre lines"
    FURNITURE = "furniture"
    ELECTRICAL = "electrical"
    OVERHEAD = "overhead or hidden"
    DEMOLISHED = "to be demolished"
    SANITARY = "sanitary and heating"
    STAIRS = "stairs or lifts"
    AREA = "areas and floors"
    OUTDOORS = "outdoors or people"
    SECTION = "sections and views"
    UNKNOWN = "no word for walls or doors in its name"


BUILT = (Kind.WALL, Kind.PART, Kind.DOOR)
"""What can be on a plan as a line that counts."""

_WORDS = {
    Kind.ANNOTATION: (
        "text texts texte texten txt anno annot* dim dims dimension* note notes notiz* label* tag tags symb",
        "symbol* iden title* titl ttlb border legen* leader* callout* sheet vport* viewport* defpoints number*",
        "nplt revs revision* bemas* vermass* masse mass masskette* masslinie* masszahl* *beschrift* schrift*",
        "*stempel *nummer *nummern nummerier* raumname* plankopf* plankoepfe *planrahmen rahmen blattrahmen kote",
        "koten hoehenkote* *bezeichnung* cotes cotation* cotations cartouche* etiquette* annotation* texte*",
        "legende* numero* repere* nom noms cadre quota quote quotat* testo testi scritt* etichett* cartigli*",
        "squadratur* nomi cota cotas acota* rotul* texto* etiquet* leyenda* cajetin* anotacion* simbol*",
    ),
    Kind.HATCH: (
        "hatch* htch patt pattern* fill fills poche schraff* *schraffur *schraffuren fuellung* hachur* trame",
        "trames remplissage* trattegg* retin* campitur* sombread* trama tramas achurad* rayad*",
    ),
    Kind.GRID: (
        "grid* cntr centerline* centreline* axis axes *achse *achsen achs* raster* axe assi asse eje ejes maglia",
        "reticol* reticul* malla hilfslinie* konstruktionslinie*",
    ),
    Kind.FURNITURE: (
        "furn* eqpm equip* casework millwork chair* table tables desk* sofa* cabinet* shelf* shelv* bed beds",
        "wardrobe* couch* m[ö]bel* m[ö]b *m[ö]bel *m[ö]bl* einrichtung* ausstattung* inventar* *stuhl *st[ü]hle",
        "*tisch *tische *schrank *schr[ä]nke schrankwand regal* bett betten k[ü]che* k[ü]chen* bestuhlung*",
        "mobili* meuble* ameublement* chaise* lit lits canape* placard* rangement* armoire* cuisine* arred*",
        "mobile tavol* sedia sedie letto letti armadi* divan* cucin* attrezz* mueble* amuebl* mesa mesas silla*",
        "cama camas armari* enseres cocina*",
    ),
    Kind.ELECTRICAL: (
        "elec* electr* light* lite lamp* lumin* outlet* socket* powr power elektr* *steckdose *steckdosen",
        "*leuchte *leuchten beleucht* licht* schalter* kabel* edv starkstrom schwachstrom eclairage* prise prises",
        "interrupt* elettr* illumin* interrutt* prese luci alumbrad* iluminac* enchufe*",
    ),
    Kind.OVERHEAD: (
        "head lintel* ovhd overhead clng ceiling* roof* beam beams joist* hidden hidd sturz st[ü]rze unterzug*",
        "unterz[ü]g* *decke *decken dach *dach daecher verdeckt* unsichtbar* linteau* plafond* toit* poutre*",
        "architrav* soffitt* controsoffitt* tetto tetti trave travi dintel* techo* cubierta* viga vigas",
    ),
    Kind.DEMOLISHED: ("demo demol* abbruch* abriss* abzubrechen* derrib*",),
    Kind.DOOR: (
        "door* *doors *door swing t[ue]r t[ue]ren t[ue]re *tuer *tueren *tuere tuer* tur turen turblatt innentur*",
        "aussentur* haustur* schiebetur* wohnungstur* brandschutztur* balkontur* eingangstur* drehtur* zimmertur*",
        "tor tore *rolltor *rolltore *garagentor* *schiebetor* *sektionaltor* durchg[ä]ng* durchgang* *[ö]ffnung",
        "*[ö]ffnungen opening openings porte portes huisserie* menuiserie* portail* vantail vantaux ouverture*",
        "porta porton* portafinestr* portefinestr* serrament* infiss* apertura aperture puerta* *puertas *puerta",
        "carpinteri* hueco huecos abertura*",
    ),
    Kind.WALL: (
        "*wall* *wand *wandung *waende *waenden *wande wandlinie* wandkante* wandkontur* wand[ö]* *mauer *mauern",
        "mauerwerk* partition* partn ptn drywall masonry trockenbau* rohbau* stahlbeton* vorsatzschale* mur murs",
        "murint* murext* cloison* refend* paroi parois porteur porteurs voile voiles maconner* doublage* muro",
        "muri mura murat* parete pareti tramezz* tampona* divisori* partizion* setto setti muros pared paredes",
        "tabique* tabiquer* medianer* cerramiento* mampara* mamposter* facade* fassade* facciat* fachada*",
    ),
    Kind.PART: (
        "column* cols pillar* window* *window glaz* *fenster *fenstern fenster* *verglasung* st[ü]tze* *st[ü]tze",
        "*st[ü]tzen pfeiler* s[ä]ule* fenetre* vitrage* vitre vitres chassis baie baies poteau* pilier* finestr*",
        "vetrat* vetri pilastr* colonn* ventan* vidri* acristal* pilar pilares columna*",
    ),
    Kind.SANITARY: (
        "plumb* plum plmb *sanit* fixt* toilet* wc basin* sink sinks shower* bath* hvac mech mechan* duct*",
        "waschb* waschtisch* dusche* badewanne* armatur* heiz* l[ü]ftung* hls hlsk plomb* lavabo* douche*",
        "baignoire* evier* cvc vmc chauffage* radiat* idraul* idric* bagn* lavandin* doccia docce riscald*",
        "fontaner* saneam* ducha* inodoro* calefac* climatiz* desag*",
    ),
    Kind.STAIRS: (
        "stair* strs steps lift lifts elevator* evtr ramp* handrail* railing* *treppe *treppen treppe* stufe*",
        "aufzug* aufz[ü]g* gelaender* escalier* marche marches ascens* rampe* scala scale gradin* ringhier*",
        "escaler* peldan* barandill*",
    ),
    Kind.AREA: (
        "area areas room rooms flor floor* zone zones fl[ä]che* *fl[ä]che *fl[ä]chen *raum *r[ä]ume raumpolygon*",
        "boden* *belag bgf ngf nuf surface* piece pieces local locaux dallage* carrelage* superfic* locale locali",
        "vano vani pavim* aree suelo* estancia* recinto*",
    ),
    Kind.OUTDOORS: (
        "site topo park parking plnt plant* landscape* tree trees car cars people person* terrain gel[ä]nde baum*",
        "b[ä]ume auto autos fahrzeug* grundst[ü]ck* arbre* alber* arbol* aussenanlage* flucht* rettung* escape*",
        "evac* evak* esodo",
    ),
    Kind.SECTION: (
        "sect section* elev elevation* detail* detl schnitt* ansicht* coupe coupes elevations sezion* prospett*",
        "seccion* corte cortes alzado*",
    ),
}
"""Words of each kind, the first kinds count first: what is written on walls is no wall, but a wall of a toilet is one.

``*`` stands for any letters, an umlaut in brackets for all its spellings.
"""
_NOT = re.compile(r"\b(in|out)doors?\b|\b(auf|lein|ein|ge)wand\b")
_SIDE = re.compile(r"\b[Cc][oô]té\b|\bCÔTÉ\b|\bCOTÉ\b")
"""French for side, which without accents is a dimension."""
_SINGLE_COTE = re.compile(r"^cote\b|\bcote$")
_AND = re.compile(r"[&+,]| (und|u|and|et|e|y|con|mit|with|avec) ")
_XREF = re.compile(r"\||\$\d+\$")
_RUN = re.compile(r"[^\W\d_]+")
_CASES = re.compile(r"(?<=[a-zß-öø-ÿ])(?=[A-ZÀ-ÖØ-Þ])|(?<=[A-ZÀ-ÖØ-Þ])(?=[A-ZÀ-ÖØ-Þ][a-zß-öø-ÿ])")
_UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "œ": "oe", "æ": "ae"})
_SPELLINGS = {"[ä]": "(?:ae|a)", "[ö]": "(?:oe|o)", "[ü]": "(?:ue|u)", "*": r"\w*"}


@cache
def kind_of(name: str) -> Kind:
    """What a layer's or block's name stands for."""
    own = _XREF.split(unicodedata.normalize("NFC", name))[-1]
    text = _NOT.sub(" ", " ".join(_words(_SIDE.sub(" ", own))))
    if _SINGLE_COTE.search(text):
        return Kind.ANNOTATION
    kinds = [kind for kind in _WORDS if _pattern(kind).search(text)]
    if kinds[:1] == [Kind.DOOR] and Kind.WALL in kinds and _AND.search(own + text):
        return Kind.WALL
    return kinds[0] if kinds else Kind.UNKNOWN


def _words(name: str) -> Iterator[str]:
    """Words of a name, folded: split at all that is not a letter, and once more at changes of case."""
    for run in _RUN.findall(name):
        parts = _CASES.split(run)
        yield from map(_folded, [run, *parts] if len(parts) > 1 else [run])


def _folded(word: str) -> str:
    """Fold case, umlauts as ae, oe and ue, and accents."""
    plain = unicodedata.normalize("NFKD", word.casefold().translate(_UMLAUTS))
    return "".join(letter for letter in plain if not unicodedata.combining(letter))


@cache
def _pattern(kind: Kind) -> re.Pattern[str]:
    words = " ".join(_WORDS[kind]).split()
    for spelling, pattern in _SPELLINGS.items():
        words = [word.replace(spelling, pattern) for word in words]
    return re.compile(rf"\b(?:{'|'.join(words)})\b")
