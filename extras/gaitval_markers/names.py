"""What the name of a marker says: on which side, and on which places it may be.

Names are read in English, German, French, Italian, Spanish and Portuguese, and in the abbreviations
of Plug-in Gait, CGM2, Davis (BTS), Helen Hayes, Cleveland, IOR (Rizzoli), CAST, ISB, HBM, Qualisys
and OpenSim's models. Which letters mean right and left is taken from the whole file: those with
which most names have a partner.
"""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval_markers.body import Site

NAMED: Final = 12.0
"""Log of how much likelier a name is for one of the places that it means than for another: names
are mistaken in one marker of several hundred; a figure between that and what positions say."""

SIDES: Final = (
    ("RIGHT", "LEFT"), ("RECHTS", "LINKS"), ("RE", "LI"), ("DROITE", "GAUCHE"), ("DROIT", "GAUCHE"),
    ("DESTRA", "SINISTRA"), ("DESTRO", "SINISTRO"), ("DX", "SX"), ("DERECHA", "IZQUIERDA"), ("DERECHO", "IZQUIERDO"),
    ("DER", "IZQ"), ("DIREITA", "ESQUERDA"), ("DIREITO", "ESQUERDO"), ("DIR", "ESQ"), ("RT", "LT"),
    ("RX", "LX"), ("R", "L"), ("D", "G"), ("D", "E"), ("D", "I"), ("D", "S"),
)  # fmt: skip
"""Words and letters for right and left; of those with equally many partners, the first."""

_KNEE = "KNEE?S?|KNIE|GENOU|GINOCCHIO|GIN|RODILLA|ROD|JOELHO|JOE|KNJNT|EPIC?O?N?D?Y?L?E?S?|CONDYL|FEMEPI"
_ANKLE = (
    "ANKLE|ANK|KNOECHEL|KNOCHEL|SPRUNGGELENK|CHEVILLE|CAVIGLIA|TOBILLO|TORNOZELO|MALLEOLUS|MALLEOLE|"
    "MALLEOLO|MALL?"
)
_ELBOW = "ELBOW|ELB|ELLBOGEN|ELLENBOGEN|COUDE|GOMITO|CODO|COTOVELO|CUB"
_WRIST = "WRIST|WRI?|HANDGELENK|POIGNET|POLSO|MUNECA|PUNHO"
_INNER = "MEDIALE?|MEDIANO|MED|INTERNO|INTERNE|INTERIOR|INNEN|INNER|INT|INN|IN"
_OUTER = "LATERALE?|LAT|LN|EXTERNO|EXTERNE|ESTERNO|AUSSEN|AUSEN|OUTER|OUT|EXT"
_BONE = r"(?:METATARSALE?|METATARS[OE]?|META|METT?|MTP|MTH|MT|MH|FMT|FM|MFK)"
_REGION = r"(?:[A-Z]{0,2}\d{0,2}|UPPER|LOWER|UP|LOW|FRONT|REAR|ANT|POST|LAT|PROX|DIST|SUP|INF|OBEN|UNTEN|VORN|HINTEN)*"

MEANINGS: Final[tuple[tuple[str, str], ...]] = (
    (r"ASIS?|IAS|SIAS?|EIAS|ASSIS|FWT|ANTSUPILIACSPINE", "ASIS"),
    (r"PSIS?|IPS|SIPS?|EIPS|BWT|POSTSUPILIACSPINE", "PSIS"),
    (r"V?SACR?(?:UM|AL|O|OL)?|MSIP|MAI|S[123]|OSSACRUM|KREUZBEIN|SACRO", "Sacrum Pelvis"),
    (r"(?:ILIAC|CREST|CRETE|CRISTA|CRESTA|ILC|IC|SIC|BECKENKAMM|CRESTAILIACA|ILIACCREST|CRISTAILIACA)", "Crest"),
    (r"G?R?T(?:R|RO|ROC?H?A?N?T?E?R?E?O?)|GT|FTC|FT|GREATERTROCHANTER|TROCANTERE?|GTROC", "Trochanter"),
    (rf"(?:{_KNEE})(?:[12]?|{_OUTER}|L)|(?:{_OUTER})(?:{_KNEE}|CON|FEMCON)|F?LE(?:K|PI)?|LFC|LKN?|LFE|FLE|LCO", "Knee"),
    (rf"(?:{_KNEE})(?:{_INNER}|M|I)|(?:{_INNER}|M)(?:{_KNEE}|CON|FEMCON)|F?ME(?:K|PI)?|MFC|MKN?E?E?|KNM|KNI|FME|MCO", "Knee.Medial"),
    (r"PAT(?:ELLA)?|ROTULA|ROTULE|KNIESCHEIBE|SUPPAT|PTLA", "Patella Thigh"),
    (r"(?:FIB(?:ULA)?(?:HEAD)?|HF|FAX|FH|WADENBEIN(?:KOEPFCHEN|KOPFCHEN)?|PERONE|CABECADAFIBULA|TETEPERONE|FIBULAKOEPFCHEN)", "Fibula"),
    (r"(?:TT|TTC|TTA|TTU|ATI|TUBTIB|TIBTUB|TUB(?:EROSITY)?|TIBTUBEROSITY|TUBEROSITAS(?:TIBIAE)?|TUBEROSIDADE?(?:TIBIAL?)?|TUBEROSITE(?:TIBIALE)?)", "Tuberosity"),
    (rf"(?:TH(?:IG?H?|AP|AD|L[PD]|OL)?|OBERSCHENKEL|OSCH|CUISSE|COSCIA|MUSLO|COXA|BAR1|FEM(?:UR)?){_REGION}|TH\d|FTH?I", "Thigh"),
    (rf"(?:TIB(?:IA)?|TIA[PD]|TILAT|TB|SK|SHA(?:NK)?(?:OL)?|SHN|UNTERSCHENKEL|JAMBE|GAMBA|PIERNA|PERNA|BAR2){_REGION}|SH\d", "Shank"),
    (rf"(?:{_ANKLE})(?:[12]?|{_OUTER}|L)|(?:{_OUTER}|L)(?:{_ANKLE}|MAL)|FAL|LM|LAK|LMALL?E?O?L?", "Ankle"),
    (rf"(?:{_ANKLE})(?:{_INNER}|M|I)|(?:{_INNER}|M)(?:{_ANKLE}|MAL)|TAM|MM|MAK|MAN|ANM|MED", "Ankle.Medial"),
    (r"HEEL?|CALC?(?:A|ANEUS|ANEUM|ANEO|ANHAR|CAGNO)?|FCC|CA|HLE?|FERSE|TALON|TALLONE|TALAO", "Heel"),
    (rf"{_BONE}1|1(?:ST)?{_BONE}|P1MT|FMH|FIRST{_BONE}|METI|FOOTMED(?:IAL)?|TOEMED", "MT1"),
    (rf"{_BONE}2|2(?:ND)?{_BONE}|SMH|SECOND{_BONE}|SM", "MT2"),
    (rf"{_BONE}5|5(?:TH)?{_BONE}|P5MT|VMH|FIFTH{_BONE}|METV|FOOTLAT(?:ERAL)?|TOELAT|META5|MET", "MT5"),
    (r"TOE\d?|ZEHE?|ORTEIL|DEDO|DITO|PUNTA", "MT2 Toe MT1"),
    (r"HAL(?:LUX|LUCE)?|HLX|ALLUCE|TOETIP|GROSSZEHE|BIGTOE|DP1", "Toe"),
    (r"MID.*|NAV.*|CUN.*|CUB(?:OID)?|MF[SL]|FOOT\d?|LATFOOT|PIED|FUSS\d?|PIEDE|PE|MIF|ST", "Foot"),
    (r"CV?7|C7TH?", "C7"),
    (r"T(?:V|H)?(?:4|5|6|7|8|9|10|11|12)|BRUSTWIRBEL\d*", "Thoracic Torso"),
    (r"CLAV?(?:I?C?L?E?)?|IJ|SJN|JN|SUPRASTERN\w*|MAN|JUGULUM|INCISURA\w*|STER", "Clavicle"),
    (r"ST(?:E)?RN(?:UM)?|XIPH?(?:OID)?|XYPH|PX|SXS|XPRO|STERNON|ESTERNO|BRUSTBEIN|TRXP?|STERNUM", "Sternum Clavicle"),
    (r"ACRO?M?I?U?O?N?\d?|SHO(?:UL)?D?E?R?|SHL?|SHOULD|CAJ|AC|SAE|SCHULTER|EPAULE|SPALLA|HOMBRO|OMBRO|SCHUL", "Acromion"),
    (r"R?BA(?:K|C|CK)|SCAP?(?:ULA|OLA)?|OFF(?:SET)?|SIA|SRS|SAA|BBAC", "Scapula Torso"),
    (r"[FB]?H(?:EA)?D|HEAD|TEMPLE?|TEMP|GLAB|TETE|TESTA|KOPF|CABEZA|CABECA|CHEEC|TOPHEAD|VERTEX|BHD|FHD|[FT]HEAD", "Head"),
    (r"UP?A(?:RM)?\w{0,2}|ARM|BICEPS?|OBERARM|BRAS|BRACCIO|BRAZO|BRACO|HUM(?:ERUS)?|DELT|UOA|UHE", "Arm"),
    (rf"(?:{_ELBOW})(?:{_OUTER}|L)?|HLE|LEL|LEE|EPILAT|EPICONDLAT", "Elbow"),
    (rf"(?:{_ELBOW})(?:{_INNER}|M)|M(?:{_ELBOW})|HME|MEL|MEE|EPIMED", "Elbow.Medial"),
    (r"FRM|FRA|FOREARM|FA\w{0,9}|LA\d|UNTERARM|AVANTBRAS|AVAMBRACCIO|ANTEBRAZO|ANTEBRACO|FORE?ARM\w*", "Forearm"),
    (rf"WRA|RSP|(?:{_WRIST})(?:RAD\w*|R|LAT)|LW|RAD(?:IUS)?|STYLORAD", "Wrist.Radial"),
    (rf"WRB|USP|(?:{_WRIST})(?:ULN\w*|U|MED)|MW|ULNA?|CUBITO", "Wrist.Ulnar"),
    (rf"(?:{_WRIST})", "Wrist.Radial Wrist.Ulnar"),
    (r"FIN\d?|HAND\d?|MAIN|MANO|MAO|HM\d|CAP|HMC\d", "Hand"),
)  # fmt: skip
"""Patterns of whole names, without side and in capitals, and the places that each may mean."""

COMPUTED: Final = re.compile(
    r"[HKASEW]JC|HJCREG|^MID(?!F)|GROUND$|CENT(?:RE|ER)OF|^COM$|HIPCENT|ANGLES?$|MOMENTS?$|FORCES?$|POWERS?$|"
    r"^(?:L|R)?(?:PEL|FE|TI|FO|TO|HED|CL|HU|RA|HN|TRX|TIBIAPROX|FEMUR|TIBIA|FOOT|TOES?|PELVIS)"
    r"(?:CGM24)?[OALPXYZ]$"
)
"""Points that a program computed: joint centres, axes of segments (Vicon), sums."""


@dataclass(frozen=True)
class Said:
    """What a name says: the side ("R", "L", "" where it says none) and the places; none: nothing."""

    side: str
    places: tuple[str, ...]

    def fits(self, site: Site) -> bool:
        """Whether a place is one of these."""
        return site.name in self.places and (not (self.side and site.side) or site.side == self.side)


def plain(name: str) -> str:
    """A name in capitals without accents and signs, and without "Subject:"."""
    own = name.rsplit(":", 1)[-1].replace("ß", "ss")
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue")):
        own = own.replace(umlaut, letters).replace(umlaut.upper(), letters.upper())
    bare = unicodedata.normalize("NFKD", own).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9]", "", bare).upper()


def computed(name: str) -> bool:
    """Whether a name is one of a computed point."""
    return COMPUTED.search(plain(name)) is not None


def read_names(names: Sequence[str]) -> list[Said]:
    """What each of the names of a file says."""
    right, left = _sides_of([plain(name) for name in names])
    return [_said(plain(name), right, left) for name in names]


def likelihoods(said: Sequence[Said], sites: Sequence[Site]) -> Array:
    """(N, K) logarithm of how likely each name is for each place, relative to a place it means."""
    return np.array(
        [[0.0 if not each.places or each.fits(site) else -NAMED for site in sites] for each in said]
    )


def _sides_of(names: Sequence[str]) -> tuple[str, str]:
    """The letters for right and left of a file."""
    known = set(names)

    def partners(pair: tuple[str, str]) -> int:
        right, left = pair
        return sum(
            any(
                left + rest in known or rest + left in known
                for rest in (_without(name, right, first=True), _without(name, right, first=False))
                if rest
            )
            for name in names
        )

    # A longer word wins against a letter of it: "RIGHT" begins with "R".
    return max(SIDES, key=partners)


def _without(name: str, side: str, *, first: bool) -> str:
    if first:
        return name.removeprefix(side) if name.startswith(side) else ""
    return name.removesuffix(side) if name.endswith(side) else ""


def _said(name: str, right: str, left: str) -> Said:
    found: list[Said] = []
    for first in (True, False):
        for side, word in (("R", right), ("L", left)):
            rest = _without(name, word, first=first)
            places = _places(rest) if rest else ()
            if places:
                found.append(Said(side, places))
    if found:
        return found[0]
    for side, word in (("R", right), ("L", left)):
        # In the middle, as in FRTHI.
        for at in [match.start() for match in re.finditer(word, name[1:-1])]:
            places = _places(name[: at + 1] + name[at + 1 + len(word) :]) if len(word) == 1 else ()
            if places and not _places(name):
                return Said(side, places)
    return Said("", _places(name))


def _places(stem: str) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for pattern, places in MEANINGS:
        if re.fullmatch(pattern, stem):
            found |= dict.fromkeys(places.split())
    return tuple(found)


def agreement(said: Sequence[Said], chosen: Mapping[int, Site | None]) -> float:
    """Share of the names that say a place, whose marker is on one of them; NaN without such names."""
    known = [said[i].fits(site) for i, site in chosen.items() if said[i].places and site is not None]
    return float(np.mean(known)) if known else float("nan")
