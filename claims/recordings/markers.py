"""How well `gaitval markers` finds out where markers are whose names say nothing, or in any
language.

`unseen_markers.toml` lists recordings of laboratories that nobody had looked at before they were
measured; on no account is anything chosen on these. What such a measurement showed may be developed
on later; then its sets move to those looked at once, and others are sought for the next. Not listed
are Padua's of MOtoNMS, which had been drafted with its names, Motion Analysis's Walk1 and Lucerne's
Plug-in Gait, whose sets are there already, a golfer with 88 markers in Paris, for the time it
takes, and sets without ankles or knees (BTS's walk of ezc3d, Perth's of MOtoNMS). FOLDER has a
clone of each repository, named OWNER+NAME, as for `public.py`. The built-in
set of a recording says where its markers are. Each is drafted three times: with numbers for names;
with its names exchanged among its markers; and with names in German, French, Italian, Spanish or
Portuguese, which this file makes.

A marker is right if its segment and its landmark are those of the set. Three differences are none:
a wand on thigh or shank that is called a tracking marker; a marker on the sacrum where both
posterior spines have one, from which gaitval then measures; radial or ulnar where the set has one
wrist marker.
"""

import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import claims
from claims import ROOT, Claim
from claims.given import DATA
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import plain_name
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.scaling.markers.draft import Draft, Guess, Places, draft_of, places_of
from gaitval.scaling.markers.names import computed

UNSEEN: Final = ROOT / "claims" / "recordings" / "unseen_markers.toml"
SEED: Final = 37
NOT_OF_THE_BODY: Final = ("FHD", "BHD", "HEAD", "TEMP", "FIN", "HMC")
"""Markers of head and hand, which no set uses: right if the draft leaves them out."""

Truth = Mapping[str, tuple[str, str | None]]

LANGUAGES: Final = ROOT / "claims" / "recordings" / "languages.toml"
"""Words as laboratories may write them; a marker without a word there gets a number."""


def _placed(name: str, clones: Path) -> Path:
    if name.startswith("data:"):
        return DATA / name.removeprefix("data:")
    return clones / name


def recorded(entry: Mapping[str, Any], clones: Path) -> tuple[Recording, Recording, Truth]:
    """Walking and standing trial, and where the markers are, by the names of the file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        standing = read_recording(_placed(entry["standing"], clones), plates=False)
        walking = (
            read_recording(_placed(entry["walking"], clones), plates=False)
            if "walking" in entry
            else standing
        )
    names = list(dict.fromkeys([*standing.names, *walking.names]))
    truth = _truth(entry, names) if "markers" in entry else _known(entry, names)
    for one, other in entry.get("exchanged", ()):
        truth[one], truth[other] = truth[other], truth[one]
    return walking, standing, truth


def _known(entry: Mapping[str, Any], names: Sequence[str]) -> dict[str, tuple[str, str | None]]:
    """Where the markers of a built-in set are."""
    known = load_marker_set(entry["set"])
    truth: dict[str, tuple[str, str | None]] = {}
    for name, marker in known.renamed(names).items():
        definition = known.markers[marker]
        truth[name] = (definition.segment, definition.landmark)
    for name in names:
        if any(word in plain_name(name) for word in NOT_OF_THE_BODY):
            truth.setdefault(name, ("", None))
    return truth


def _truth(entry: Mapping[str, Any], names: Sequence[str]) -> dict[str, tuple[str, str | None]]:
    """Where the markers of a set of the list itself are."""
    letters = dict(zip("RL", entry.get("sides", "RL"), strict=True))
    found: dict[str, tuple[str, str | None]] = {}
    for place, markers in entry["markers"].items():
        segment, _, landmark = place.partition(" ")
        for marker in markers:
            for side, letter in letters.items():
                paired = segment in ("thigh", "shank", "foot", "toes", "upper_arm", "forearm")
                name = marker.replace("*", letter)
                where = f"{segment}_{side.lower()}" if paired else segment.replace("none", "")
                mark = f"{side}.{landmark}" if landmark and landmark != "Sacrum" else landmark
                found.setdefault(name, (where, mark or None))
    own = {plain_name(name): name for name in names}
    return {
        own[plain_name(name)]: where for name, where in found.items() if plain_name(name) in own
    }


def only_markers(recording: Recording) -> Recording:
    """The recording without computed points, which exchanged names would make markers of."""
    sums = computed(recording.names)
    kept = [i for i, name in enumerate(recording.names) if name not in sums]
    return recording.with_markers([recording.names[i] for i in kept], recording.markers[:, kept])


def renamed(recording: Recording, names: Mapping[str, str]) -> Recording:
    """The recording with other names."""
    return replace(recording, names=tuple(names[name] for name in recording.names))


def variants(names: Sequence[str], truth: Truth, seed: int) -> Iterator[tuple[str, dict[str, str]]]:
    """New names for all, by kind: numbers, exchanged, another language."""
    random = np.random.default_rng(seed)
    yield "without names", {name: f"M{number:02d}" for number, name in enumerate(names)}
    shuffled = list(random.permutation(np.array(names, dtype=object)))
    yield "labels exchanged", dict(zip(names, shuffled, strict=True))
    languages = list(tomllib.loads(LANGUAGES.read_text(encoding="utf-8")).values())
    language = languages[int(random.integers(len(languages)))]
    spoken: dict[str, str] = {}
    for number, name in enumerate(names):
        spoken[name] = _in_language(truth.get(name), language, number)
        if spoken[name] in list(spoken.values())[:-1]:
            spoken[name] += f"_{number}"
    yield "another language", spoken


def _with_names(places: Places, new: Mapping[str, str]) -> Places:
    return replace(
        places,
        names=tuple(new[name] for name in places.names),
        static_only=frozenset(new[name] for name in places.static_only),
        walking_only=tuple(new[name] for name in places.walking_only),
    )


def _in_language(
    where: tuple[str, str | None] | None, words: Mapping[str, str], number: int
) -> str:
    if where is None:
        return f"M{number:02d}"
    segment, landmark = where
    if landmark == "Sacrum":
        return words["Sacrum"]
    side, _, place = (landmark or "").partition(".")
    if landmark and place in words:
        return f"{words[side]}_{words[place]}"
    part, _, letter = segment.rpartition("_")
    if part in words:
        return f"{words[letter.upper()]}_{words[part]}_{number}"
    return f"M{number:02d}"


def is_right(guess: Guess, truth: tuple[str, str | None], all_of: Truth) -> bool:
    """Whether a guess has the segment and the landmark; see the module's docstring."""
    site = guess.site
    segment, landmark = ("", None) if site is None else (site.segment, site.landmark)
    landmarks = {place for _, place in all_of.values()}

    def same(name: str | None) -> str | None:
        if name is None or name.endswith((".Thigh", ".Shank")):
            return None
        if name == "Sacrum" and {"R.PSIS", "L.PSIS"} <= landmarks:
            return None
        return name

    one, other = same(landmark), same(truth[1])
    wrist = bool(one and other and other.endswith(".Wrist") and one.startswith(other))
    return segment == truth[0] and (one == other or wrist)


def judged(draft: Draft, truth: Truth) -> tuple[int, int, int, list[str]]:
    """Markers right, all, wrong ones used unseen, and what is wrong, of a draft."""
    right = used = 0
    wrong: list[str] = []
    guesses = {guess.name: guess for guess in draft.guesses}
    for name, where in truth.items():
        guess = guesses.get(name)
        if guess is None or guess.walking_only:
            continue
        good = is_right(guess, where, truth)
        right += good
        if not good:
            used += guess.used
            place = "nowhere" if guess.site is None else guess.site.label
            wrong.append(f"{name} as {place} {guess.certainty:.2f}{'!' if guess.used else ''}")
    return right, right + len(wrong), used, wrong


@claims.measured("public")
def fresh_markers(given: claims.Given) -> list[Claim]:
    """The same of people and laboratories that were drafted once before, and looked at since."""
    return _measured(given.public, _listed("once"), "people and laboratories looked at once")


@claims.measured("public")
def unseen_markers(given: claims.Given) -> list[Claim]:
    """The same of laboratories that nobody had looked at, drafted in the measurement once."""
    return _measured(given.public, _listed("laboratories"), "laboratories never looked at")


def _listed(of: str) -> list[dict[str, Any]]:
    """A part of the list."""
    entries: list[dict[str, Any]] = tomllib.loads(UNSEEN.read_text(encoding="utf-8"))[of]
    return entries


def _measured(clones: Path, entries: Sequence[Mapping[str, Any]], words: str) -> list[Claim]:
    """The rows of the recordings of `entries`."""
    found: dict[str, list[tuple[int, int, int]]] = {}
    certain: dict[str, list[int]] = {}
    for number, entry in enumerate(entries):
        walking, standing, truth = recorded(entry, clones)
        walking, standing = only_markers(walking), only_markers(standing)
        names = list(dict.fromkeys([*standing.names, *walking.names]))
        unnamed = {name: f"M{i:02d}" for i, name in enumerate(names)}
        places = places_of(renamed(walking, unnamed), renamed(standing, unnamed))
        back_to = {new: name for name, new in unnamed.items()}
        for kind, new in variants(names, truth, SEED + number):
            # What places alone say does not depend on the names: it is worked out once.
            draft = draft_of(_with_names(places, {m: new[name] for m, name in back_to.items()}))
            known = {new[name]: where for name, where in truth.items() if name in new}
            right, count, used, wrong = judged(draft, known)
            found.setdefault(kind, []).append((right, count, used))
            certain.setdefault(kind, []).append(sum(guess.used for guess in draft.guesses))
            back = {other: name for name, other in new.items()}
            messages = [f"{back[each.split(' as ')[0]]} {each}" for each in wrong]
            print(
                f"{entry['set']}, {kind}: {right} of {count}, wrong and used {used}",
                *messages,
                sep="\n   ",
                flush=True,
            )
    rows = []
    for kind, each in found.items():
        right, count, used = np.sum(each, axis=0)
        print(f"{kind}: {right} of {count}; wrong and used {used}; used {sum(certain[kind])}")
        what = f"markers of {words} drafted, {kind}"
        rows += [
            Claim(f"{what}: right", 100 * right / count, "%", int(count)),
            Claim(f"{what}: wrong ones used unseen", int(used), "markers", int(count)),
        ]
    return rows
