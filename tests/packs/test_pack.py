"""Packs: frozen to the same bytes, verified by hash, refused with a message that names the place."""

import json
from collections import Counter
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.support.bare_house import bare_house
from tests.support.builders import episode
from tests.support.tiny_pack import tiny_pack
from vigil.base.geometry import Pose, Vec3
from vigil.errors import EpisodeError, HouseError, PackMismatch, SettingError, VigilError
from vigil.packs import files as pack_files
from vigil.packs import pack as pack_module
from vigil.packs.freeze import freeze
from vigil.packs.pack import Pack, Selection, count_families, frozen_episodes, manifest_sha256, protocol_faults
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode, HouseRef, Solution
from vigil.protocol.world import ObjectSetup, Placement, Setup

HOUSE = bare_house("house", "target", "Fridge|1|3")


def task(family: Any, episode_id: str, **facts: Any) -> Episode:
    return episode(family, id=episode_id, **{"house": HouseRef(name="house", sha256=HOUSE.sha256), **facts})


DRAWER = {"target": "Drawer|2|0|Dresser3"}
EPISODES = [task("PG", "pg_b"), task("DA", "da_a"), task("PG", "pg_a")]


def solution(of: Episode) -> Solution:
    return Solution(episode_id=of.id, actions=(Report(status="success", summary=""),))


def frozen(folder: Path, episodes: list[Episode] | None = None, **how: Any) -> Pack:
    chosen = EPISODES if episodes is None else episodes
    return freeze(folder, chosen, [solution(of) for of in chosen], [HOUSE], name="small", **how)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return frozen(tmp_path / "small").folder


def tamper(folder: Path, name: str, old: bytes, new: bytes, *, rehash: bool = True) -> None:
    """Replaces bytes in a file, by default with its hash in the manifest made to fit."""
    path = folder / name
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new))
    if rehash and name != "manifest.json":
        manifest = json.loads((folder / "manifest.json").read_bytes())
        manifest["files"][name] = sha256(path.read_bytes()).hexdigest()
        (folder / "manifest.json").write_text(json.dumps(manifest))


def test_a_frozen_pack_loads_as_it_was(folder: Path):
    pack = Pack.load(folder)
    assert [found.id for found in pack.episodes] == ["da_a", "pg_a", "pg_b"]
    assert pack.episode("pg_b") == EPISODES[0]
    assert pack.solutions["da_a"] == solution(EPISODES[1])
    assert pack.house_of(EPISODES[0]).data == HOUSE.data
    assert pack.manifest.families == {"PG": 2, "DA": 1}
    assert pack.sha256 == sha256((folder / "manifest.json").read_bytes()).hexdigest()


def test_the_same_input_gives_the_same_bytes(tmp_path: Path):
    first = frozen(tmp_path / "1", meta={"seed": 1, "made": "by test"})
    second = frozen(tmp_path / "2", EPISODES[::-1], meta={"made": "by test", "seed": 1})
    assert first.sha256 == second.sha256
    for path in sorted(first.folder.rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (second.folder / path.relative_to(first.folder)).read_bytes()


def test_packs_are_never_overwritten(folder: Path):
    with pytest.raises(SettingError, match="not an empty folder"):
        frozen(folder)


class TestSelect:
    def ids(self, folder: Path, **how: Any) -> list[str]:
        return [found.id for found in Pack.load(folder).select(Selection(**how))]

    def test_by_family_ids_and_limit_in_order_of_id(self, folder: Path):
        assert self.ids(folder) == ["da_a", "pg_a", "pg_b"]
        assert self.ids(folder, families=("PG",)) == ["pg_a", "pg_b"]
        assert self.ids(folder, ids=("pg_b", "da_a")) == ["da_a", "pg_b"]
        assert self.ids(folder, limit=99) == ["da_a", "pg_a", "pg_b"]

    def test_a_limit_draws_evenly_and_a_higher_one_keeps_what_a_lower_one_drew(self, folder: Path):
        first = self.ids(folder, families=("PG",), limit=1)
        assert self.ids(folder, limit=2) == ["da_a", *first]
        mini = Pack.load("vigil_mini")
        drawn = [[episode.id for episode in mini.select(Selection(limit=limit))] for limit in range(1, 25)]
        assert all(set(less) < set(more) for less, more in pairwise(drawn))
        assert drawn[23] == sorted(drawn[23])
        assert set(count_families(mini.select(Selection(limit=24))).values()) == {3}

    @pytest.mark.parametrize(
        ("how", "message"),
        [
            ({"limit": 0}, "limit of 0"),
            ({"families": ("XX",)}, "no family 'XX'"),
            ({"families": ("CR",)}, "no episode that fits"),
            ({"ids": ("pg_c",)}, "no episode 'pg_c'. Did you mean 'pg_"),
            ({"ids": ("pg_a",), "families": ("DA",)}, "no episode that fits"),
        ],
    )
    def test_a_selection_of_nothing_is_told(self, folder: Path, how: dict, message: str):
        with pytest.raises(SettingError, match=message):
            self.ids(folder, **how)


HASH = HOUSE.sha256.encode()
REFUSED: list[tuple[str, bytes, bytes, bool, type[VigilError], str]] = [
    ("episodes.jsonl", b"Do it.", b"Do it!", False, PackMismatch, r"episodes.jsonl has SHA-256 .* changed after"),
    ("houses/house.json", b"oak", b"elm", False, PackMismatch, r"houses/house.json has SHA-256"),
    ("houses/house.json", b"oak", b"elm", True, PackMismatch, r"Episode 'da_a': house 'house' has SHA-256"),
    ("houses/house.json", b'"rooms":[', b'"rooms":7,"x":[', True, HouseError, r"rooms: Input should be a valid list"),
    ("houses/house.json", b'"walls":[]', b'"walls":', True, HouseError, r"is not JSON"),
    (
        "episodes.jsonl",
        b'"family":"DA"',
        b'"family":"DX"',
        True,
        EpisodeError,
        r"episodes.jsonl line 1: family: Value error, there is no family",
    ),
    ("episodes.jsonl", b'"family":"DA"', b'"reward":1,"family":"DA"', True, EpisodeError, r"line 1: reward: Extra"),
    ("episodes.jsonl", b"{", b"[", True, EpisodeError, r"line 1: the document: Invalid JSON"),
    ("episodes.jsonl", b"pg_b", b"pg_a", True, EpisodeError, r"two episodes have the id 'pg_a'"),
    ("episodes.jsonl", b"pg_b", b"aa", True, EpisodeError, r"sort them by id"),
    ("episodes.jsonl", HASH, b"0" * 64, True, PackMismatch, r"made for 000000000000"),
    ("episodes.jsonl", b'"name":"house"', b'"name":"huose"', True, PackMismatch, r"not in pack .* mean 'house'"),
    ("manifest.json", b'"episodes": 3', b'"episodes": 4', True, PackMismatch, r"says 4 episodes"),
    ("manifest.json", b'"episodes": 3', b'"episodes": "many"', True, PackMismatch, r"manifest.json: episodes: Input"),
    (
        "manifest.json",
        b'"schema_version": 2',
        b'"schema_version": 9',
        True,
        PackMismatch,
        r"schema 9, but vigil .* A newer vigil",
    ),
    ("manifest.json", b'"name": "small"', b'"name": "small", "x": 1', True, PackMismatch, r"x: Extra inputs"),
    ("manifest.json", b"houses/house.json", b"../house.json", True, PackMismatch, r"outside the pack"),
    ("manifest.json", b"houses/house.json", b"houses/" + b"x" * 300, True, PackMismatch, r"or not a file"),
    ("manifest.json", b"houses/house.json", b"houses/a\\u0000b", True, PackMismatch, r"or not a file"),
    ("manifest.json", b"solutions.jsonl", b"solved.jsonl", True, PackMismatch, r"does not list solutions.jsonl"),
    ("manifest.json", b"houses/house.json", b"houses/home.json", True, PackMismatch, r"houses/home.json is missing"),
]


@pytest.mark.parametrize(("name", "old", "new", "rehash", "error", "message"), REFUSED)
def test_what_does_not_fit_is_refused(folder: Path, name, old, new, rehash, error, message):
    tamper(folder, name, old, new, rehash=rehash)
    with pytest.raises(error, match=message):
        Pack.load(folder)


ORPHAN = ObjectSetup(placement=Placement(position=Vec3(0, 0, 0), parent="gone"))


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"bindings": {"target": "Fridge|1|2"}}, r"names 'Fridge\|1\|2', absent from house 'house'. Did you mean 'Fr"),
        ({"setup": Setup(objects={"ghost": ObjectSetup(openness=1.0)})}, r"setup names 'ghost'"),
        ({"setup": Setup(objects={"target": ORPHAN})}, r"setup names 'gone'"),
        ({"max_steps": 13}, r"budgets are 13 steps and 4 invalid actions, but family DA has 12 and 4"),
        ({"start": Pose(position=Vec3(0, 0, 0), rotation=0, horizon=0)}, r"horizon is 0, but family DA starts at 30"),
        ({"house": HouseRef(name="other", sha256="0" * 64)}, r"house 'other' is not among"),
        ({"house": HouseRef(name="house", sha256="0" * 64)}, r"made for 000000000000"),
    ],
)
def test_what_contradicts_house_or_family_is_not_frozen(tmp_path: Path, facts: dict, message: str):
    with pytest.raises((EpisodeError, PackMismatch), match=message):
        frozen(tmp_path / "bad", [task("DA", "da_a", **facts)])
    assert not (tmp_path / "bad").exists()


def test_an_episode_may_be_about_a_drawer_that_the_house_does_not_name(tmp_path: Path):
    house = bare_house("house", "target", "Dresser|2|0")
    about = episode("SV", id="sv_a", house=HouseRef(name="house", sha256=house.sha256), bindings=DRAWER)
    pack = freeze(tmp_path / "drawer", [about], [solution(about)], [house], name="small")
    assert Pack.load(pack.folder).episodes[0].bindings == DRAWER
    elsewhere = about.model_copy(update={"bindings": {"target": "Drawer|2|1|Dresser3"}})
    with pytest.raises(EpisodeError, match=r"names 'Drawer\|2\|1\|Dresser3', absent from house 'house'"):
        freeze(tmp_path / "other", [elsewhere], [solution(elsewhere)], [house], name="small")


def test_every_episode_needs_its_solution(tmp_path: Path):
    with pytest.raises(EpisodeError, match="exactly one solution"):
        freeze(tmp_path / "bad", EPISODES, [solution(EPISODES[0])], [HOUSE], name="small")


def test_a_file_that_is_too_large_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(pack_files, "MAX_HOUSE_BYTES", 10)
    with pytest.raises(PackMismatch, match=r"houses/house.json is over \S+ MiB, the limit for such a file"):
        Pack.load(folder)


def test_a_fault_in_a_manifest_quotes_no_more_of_a_value_than_can_be_read(folder: Path):
    manifest = json.loads((folder / "manifest.json").read_bytes())
    manifest["families"]["x" * 100_000] = 1
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(PackMismatch) as raised:
        Pack.load(folder)
    assert len(str(raised.value)) < 1000


def test_a_missing_pack_is_told(tmp_path: Path):
    with pytest.raises(PackMismatch, match="'stream:7' is a stream, not a pack"):
        Pack.load("stream:7")
    with pytest.raises(PackMismatch, match="neither a folder nor a packaged one"):
        Pack.load("no_such_pack")
    with pytest.raises(PackMismatch, match=r"manifest\.json is missing"):
        Pack.load(tmp_path)


def test_protocol_faults_of_the_plain_episodes():
    assert [protocol_faults(of) for of in EPISODES] == [[], [], []]


def test_a_pack_is_known_by_its_manifest(folder: Path, tmp_path: Path):
    assert manifest_sha256(folder) == Pack.load(folder).sha256
    with pytest.raises(PackMismatch, match=r"manifest\.json is missing"):
        manifest_sha256(tmp_path)
    with pytest.raises(PackMismatch, match="expected 000000000000"):
        frozen_episodes(folder, "0" * 64)


def test_only_some_houses_are_kept_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(pack_module, "MAX_CACHED_HOUSES", 1)
    houses = [bare_house(name, "target", name) for name in ("a", "b")]
    tasks = [task("DA", f"da_{of.name}", house=HouseRef(name=of.name, sha256=of.sha256)) for of in houses]
    pack = freeze(tmp_path / "two", tasks, [solution(of) for of in tasks], houses, name="two")
    first = pack.house_of(tasks[0])
    assert pack.house_of(tasks[0]) is first
    assert pack.house_of(tasks[1]).name == "b"
    again = pack.house_of(tasks[0])
    assert again is not first
    assert again.sha256 == first.sha256


def test_a_pack_whose_making_was_killed_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Killed(BaseException):
        """Ends the making, as a kill would, before the second file."""

    written: list[Path] = []
    write = Path.write_bytes

    def dying(path: Path, data: bytes) -> int:
        if written:
            raise Killed
        written.append(path)
        return write(path, data)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", dying)
        with pytest.raises(Killed):
            tiny_pack(tmp_path / "tiny")
    assert not (tmp_path / "tiny").exists()
    assert len(tiny_pack(tmp_path / "tiny").episodes) == 4
    assert [path.name for path in tmp_path.iterdir()] == ["tiny"]


SUITE = "vigil_closure_400"


def test_a_limit_draws_evenly_from_the_kinds_of_a_suite_and_keeps_twins_together():
    pack = Pack.load(SUITE)
    kinds = {place.kind for place in pack.suite_entries.values()}
    before: set[str] = set()
    for limit in (1, 2, 3, 7, 13, 14, 40, 41, 100, 399):
        found = {episode.id for episode in pack.select(Selection(limit=limit))}
        assert before <= found
        assert limit - 1 <= len(found) <= limit
        halves = Counter(pack.pairs[name] for name in found if name in pack.pairs)
        assert set(halves.values()) <= {2}
        counts = Counter(pack.suite_entries[name].kind for name in found)
        if 2 * len(kinds) <= limit <= 100:
            assert counts.keys() == kinds
            assert max(counts.values()) - min(counts.values()) <= 2
        before = found


def test_a_limit_below_two_of_twins_alone_leaves_nothing():
    pack = Pack.load(SUITE)
    twins = tuple(sorted(pack.pairs)[:2])
    names = tuple(name for name, pair in pack.pairs.items() if pair in {pack.pairs[twin] for twin in twins})
    with pytest.raises(
        SettingError, match=r"A limit of 1 leaves nothing to play: the episodes are pairs of twins. Give 2 or"
    ):
        pack.select(Selection(ids=names, limit=1))


ASSET = bare_house("house", "target").data["objects"][0]["assetId"]


class Sizes(dict[str, int]):
    """As a database of assets, as far as a pack asks."""

    def __init__(self, sha256: str | None, *ids: str) -> None:
        super().__init__(dict.fromkeys(ids, 0))
        self.sha256 = sha256


@pytest.mark.parametrize(
    ("made_with", "given", "is_refused"),
    [
        (None, Sizes(None), False),
        ("a" * 64, Sizes("a" * 64), False),
        ("a" * 64, Sizes(None), True),
        ("a" * 64, Sizes("b" * 64), True),
        (None, Sizes("b" * 64, ASSET), True),
        (None, Sizes("b" * 64, "another asset"), False),
    ],
)
def test_a_pack_is_held_to_its_asset_database(tmp_path: Path, made_with, given: Sizes, is_refused: bool):
    meta = {} if made_with is None else {"asset_database_sha256": made_with}
    pack = frozen(tmp_path / "small", meta=meta)
    if not is_refused:
        pack.check_assets(given)
        return
    with pytest.raises(PackMismatch, match=r"Pack 'small' was made with .* objects would have other sizes"):
        pack.check_assets(given)


def test_a_house_that_changes_after_the_pack_was_loaded_is_not_played(folder: Path):
    pack = Pack.load(folder)
    pack._houses.clear()
    file = folder / "houses" / "house.json"
    file.write_bytes(file.read_bytes().replace(b"oak", b"elm"))
    with pytest.raises(PackMismatch, match=r"houses/house.json has SHA-256 .* changed after freezing"):
        pack.house_of(pack.episodes[0])


def test_solutions_that_change_after_the_pack_was_loaded_are_not_used(folder: Path):
    pack = Pack.load(folder)
    (folder / "solutions.jsonl").write_bytes(b"")
    with pytest.raises(PackMismatch, match=r"solutions.jsonl has SHA-256 .* changed after freezing"):
        _ = pack.solutions


def test_the_very_pack_of_a_hash_is_loaded(folder: Path):
    pack = Pack.load(folder)
    assert Pack.load(folder, pack.sha256).sha256 == pack.sha256
    with pytest.raises(PackMismatch, match="results on another pack cannot be compared"):
        Pack.load(folder, "0" * 64)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b'"houses": 1', b'"houses": 2', "says 2 houses, but the episodes are in 1"),
        (HASH, b"0" * 64, "house_sources gives house 'house' another SHA-256"),
    ],
)
def test_what_a_manifest_says_of_houses_is_compared(tmp_path: Path, old: bytes, new: bytes, said: str):
    pack = frozen(tmp_path / "small", meta={"house_sources": {"house": {"sha256": HOUSE.sha256}}})
    tamper(pack.folder, "manifest.json", old, new)
    with pytest.raises(PackMismatch, match=said):
        Pack.load(pack.folder)
