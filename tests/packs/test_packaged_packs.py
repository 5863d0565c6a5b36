"""The packs that come with the package: what their manifests promise, and that their solutions still hold."""

import json
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
from pyarrow import json as arrow_json

import vigil
from tests.support.published_runs import PUBLISHED
from vigil.authoring.packing.requests import MAX_PER_HOUSE
from vigil.authoring.packing.selection import FOUND_BY_TURNING
from vigil.authoring.packing.verify import VerificationSettings, verify_pack
from vigil.packs.files import MANIFEST
from vigil.packs.pack import Pack
from vigil.protocol.families import FAMILIES
from vigil.scoring.levels import LEVELS, read_pack_levels

BUILT = {"vigil_smoke_v6": 1, "vigil_mini_v6": 10, "vigil_balanced_1000_v6": 125, "vigil_paper_1000_v2": 125}
"""Name -> episodes of each family."""
MOST_MB = 25.0
load = cache(Pack.load)
FOLDER = Path(vigil.__file__).parent / "data" / "packs"
HERE = sorted(path.parent.name for path in FOLDER.glob(f"*/{MANIFEST}") if path.parent.name in BUILT)


@pytest.fixture(params=HERE)
def pack(request: pytest.FixtureRequest) -> Pack:
    return load(request.param)


def test_the_first_packs_are_there() -> None:
    assert {"vigil_mini_v6", "vigil_smoke_v6"} <= set(HERE)
    size = sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file())
    assert size < MOST_MB * 2**20


LEVELLED = ("vigil_mini_v6", "vigil_balanced_1000_v6")


KINDS = {
    "PG": ("large", "medium", "small"),
    "SV": ("on", "off", "open", "closed"),
    "AI": ("open", "close", "turn_on", "turn_off", "pick", "look_alike"),
    "SI": ("open", "close", "turn_on", "turn_off", "pick", "look_alike", "pick_inside"),
    "SM": tuple(FAMILIES["SM"].kinds),
    "CR": tuple(FAMILIES["CR"].kinds),
}
PAPER_KINDS = {
    "AI": ("open", "close", "turn_on", "turn_off", "pick"),
    "SI": ("open", "close", "turn_on", "turn_off", "pick"),
    "SM": ("reveal_pick", "put_into", "rearrange", "open_pick_place"),
    "CR": ("obstacle", "leaf", "swing", "interlock", "hand"),
}
"""Family -> the kinds of the paper's own mix, where they are fewer."""
UNEVEN = {"SM": 4, "CR": 2}
"""By how many kinds of a family differ where not each has drafts enough; by one in all others."""


def test_families_and_kinds_are_even(pack: Pack) -> None:
    each = BUILT[pack.name]
    assert pack.manifest.families == dict.fromkeys(PUBLISHED, each)
    strata = pack.manifest.meta["strata"]
    for counts in strata["families"].values():
        assert sum(counts.values()) == each
    for family, kinds in (KINDS | (PAPER_KINDS if pack.name == "vigil_paper_1000_v2" else {})).items():
        counts = strata["families"][family]
        assert counts.keys() <= set(kinds)
        assert max(counts.values()) - min(counts.get(kind, 0) for kind in kinds) <= UNEVEN.get(family, 1)
    for family, afar in strata["not_found_by_turning"].items():
        assert afar >= (1 - FOUND_BY_TURNING) * each, family


@pytest.mark.parametrize("name", LEVELLED)
def test_levels_are_even_within_each_family(name: str) -> None:
    pack = load(name)
    levels = read_pack_levels(pack.folder)
    counts = Counter((episode.family, levels[episode.id].level) for episode in pack.episodes)
    each = BUILT[name] / len(LEVELS)
    assert all(abs(counts[family, level] - each) < 1 for family in PUBLISHED for level in LEVELS)


@pytest.mark.parametrize("name", ["vigil_smoke_v6", "vigil_mini_v6", "vigil_balanced_1000_v6"])
def test_all_are_robust_and_say_so(name: str) -> None:
    pack = load(name)
    assert pack.manifest.meta["is_robust"]
    rows = [json.loads(line) for line in (pack.folder / "facts.jsonl").read_text().splitlines()]
    assert all(row["is_robust"] for row in rows)


def test_words_do_not_tell_the_state(pack: Pack) -> None:
    """A pair of labels for each category would be 0.5; a few odd ones out remain, the more so in small packs."""
    most = {1: 1.0, 10: 0.7, 125: 0.56}
    assert pack.manifest.meta["text_guess_sv"] <= most[BUILT[pack.name]]


def test_no_house_carries_more_than_a_few(pack: Pack) -> None:
    uses = Counter((episode.family, episode.house.name) for episode in pack.episodes)
    assert max(uses.values()) == pack.manifest.meta["strata"]["most_of_a_family_in_a_house"] <= MAX_PER_HOUSE


def test_the_thousand_are_spread_over_houses_rooms_and_constraints() -> None:
    pack = load("vigil_1000")
    strata = pack.manifest.meta["strata"]
    assert pack.manifest.houses >= 100
    assert len({episode.provenance.seed for episode in pack.episodes}) == pack.manifest.houses
    assert max(strata["rooms"].values()) < 0.35 * len(pack.episodes)
    assert sum(count for rooms, count in strata["rooms"].items() if int(rooms) >= 3) > 0.45 * len(pack.episodes)
    told = sum(count for kind, count in strata["families"]["CR"].items() if not kind.endswith("_implicit"))
    assert abs(told - len(pack.episodes) / 16) <= 3


def test_ids_have_the_papers_form(pack: Pack) -> None:
    for episode in pack.episodes:
        head, category, seed, family, digest = episode.id.split("_")
        assert (head, family) == ("vigil", episode.family.lower())
        assert category == episode.goal.object_id.split("|")[0].lower()
        assert seed == f"seed{episode.provenance.seed:03d}"
        assert int(digest, 16) >= 0


def test_nothing_is_said_to_be_reviewed_that_is_not(pack: Pack) -> None:
    reviews = pack.manifest.meta["reviews"]
    marked = sum(episode.provenance.reviewed is not None for episode in pack.episodes)
    assert sum(reviews.values()) == len(pack.episodes)
    assert marked <= reviews["person"] + reviews["model"]


@pytest.mark.parametrize("name", ["episodes.jsonl", "solutions.jsonl", "facts.jsonl"])
def test_files_are_tables_for_other_tools(pack: Pack, name: str) -> None:
    table = arrow_json.read_json(str(pack.folder / name))
    assert table.num_rows == len(pack.episodes)
    assert f"data_files: {name}" in (pack.folder / "README.md").read_text()


def test_the_smoke_packs_solutions_hold() -> None:
    assert verify_pack(load("vigil_smoke_v6"), VerificationSettings()) == []
