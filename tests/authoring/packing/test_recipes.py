"""Recipes: the same houses give the same bytes; other houses, sizes or files are named."""

import gzip
import json
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.support.fake_prior import FakePrior, as_procthor_writes
from vigil.authoring.closure import generation
from vigil.authoring.drafting.drafts import DRAFTS_VERSION, DraftsFile
from vigil.authoring.drafting.generation import GenerationSettings
from vigil.authoring.drafting.procthor import REVISION
from vigil.authoring.packing.recipes import PACKAGED, Recipe, made_with
from vigil.authoring.packing.selection import TooFewDrafts
from vigil.cli import app
from vigil.errors import EpisodeError, PackMismatch, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.packs.pack import Pack

MADE = ("--family", "PG", "--per-family", "1", "--seed", "5", "--workers", "1")


def vigil(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["pack", *map(str, arguments)])


@pytest.fixture(scope="module")
def lines() -> list[bytes]:
    """Two houses as ProcTHOR writes them."""
    return [as_procthor_writes(generate(seed, spec_for("bathroom")).data) for seed in (4, 6)]


@pytest.fixture(scope="module")
def made(lines: list[bytes], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of houses, a pack made of it, and the pack's recipe."""
    folder = tmp_path_factory.mktemp("recipes")
    (folder / "two.jsonl.gz").write_bytes(gzip.compress(b"\n".join(lines), mtime=0))
    done = vigil("make", "--name", "two", "--houses", folder / "two.jsonl.gz", *MADE, "--out", folder / "pack")
    assert done.exit_code == 0, done.output
    return folder


def with_drafts(made: Path, out: Path) -> Path:
    """Puts the finished drafts of the pack beside `out`, which is returned: what continues them drafts nothing."""
    shutil.copy(made / "pack.drafts.jsonl", out.with_name(f"{out.name}.drafts.jsonl"))
    shutil.copytree(made / "pack.drafts.houses", out.with_name(f"{out.name}.drafts.houses"))
    return out


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_pack_tells_where_its_houses_are_from(made: Path) -> None:
    pack = Pack.load(made / "pack")
    (episode,) = pack.episodes
    assert episode.id.startswith("procthor_")
    assert f"_house00{episode.house.name[-1]}_pg_" in episode.id
    number = int(episode.house.name.removeprefix("two_"))
    expected = {"dataset": "two.jsonl.gz", "index": number - 1, "sha256": episode.house.sha256}
    assert pack.manifest.meta["house_sources"] == {episode.house.name: expected}
    assert pack.manifest.meta["seed"] == 5


def test_the_recipe_holds_hashes_and_no_house(made: Path) -> None:
    text = (made / "pack.recipe.json").read_text()
    recipe = Recipe.load(str(made / "pack.recipe.json"))
    assert [house.name for house in recipe.houses] == ["two_1", "two_2"]
    assert recipe.pack_sha256 == Pack.load(made / "pack").sha256
    assert recipe.made_with == made_with()
    assert "floorPolygon" not in text
    assert recipe.notes() == []


def test_whoever_has_the_houses_makes_the_same_bytes(made: Path, lines: list[bytes], tmp_path: Path) -> None:
    """Under another file name, written with other spaces."""
    renamed = tmp_path / "mine.jsonl"
    renamed.write_text("".join(f"{json.dumps(json.loads(line), indent=None)}\n" for line in lines))
    done = vigil("remake", made / "pack.recipe.json", "--houses", renamed, "--out", tmp_path / "again")
    assert done.exit_code == 0, done.output
    assert "2 houses are those of recipe 'two'" in done.stdout
    assert "the same bytes" in done.stdout
    assert contents(tmp_path / "again") == contents(made / "pack")


def test_a_recipe_of_a_suite_gives_the_same_bytes(
    lines: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drafted anew, of one kind of task alone."""
    monkeypatch.setattr(generation, "KINDS", ("already",))
    (tmp_path / "one.jsonl").write_bytes(lines[0] + b"\n")
    asked = ("--suite", "closure", "--kind", "already:1", "--max-per-house", "1", "--seed", "5", "--workers", "1")
    done = vigil("make", "--name", "stress", "--houses", tmp_path / "one.jsonl", *asked, "--out", tmp_path / "pack")
    assert done.exit_code == 0, done.output
    recipe = Recipe.load(str(tmp_path / "pack.recipe.json"))
    assert (recipe.suite, recipe.tasks) == ("closure", {"already": 1})
    again = tmp_path / "again"
    done = vigil("remake", tmp_path / "pack.recipe.json", "--houses", tmp_path / "one.jsonl", "--out", again)
    assert done.exit_code == 0, done.output
    assert "the same bytes" in done.stdout
    assert contents(again) == contents(tmp_path / "pack")
    other = recipe.model_copy(update={"tasks": {"already": 2}})
    other.save(tmp_path / "other.json")
    done = vigil("remake", tmp_path / "other.json", "--houses", tmp_path / "one.jsonl", "--out", tmp_path / "o")
    assert "already 1 of 2" in str(done.exception)


def test_more_houses_are_drawn_until_the_pack_is_complete(made: Path, tmp_path: Path) -> None:
    """The budget decides whether there is a pack, not which one."""
    asked = ("--family", "PG", "--per-family", "4", "--seed", "5", "--workers", "1", "--count", "1")
    make = ("make", "--name", "four", "--houses", made / "two.jsonl.gz", *asked, "--out")
    out = tmp_path / "pack"
    short = vigil(*make, out, "--max-houses", "1")
    assert isinstance(short.exception, TooFewDrafts)
    assert [(each.group, each.asked) for each in short.exception.missing] == [("PG", 4)]
    assert "larger --max-houses; or freeze a smaller pack from these drafts" in str(short.exception)
    assert not out.exists()
    done = vigil(*make, out)
    assert done.exit_code == 0, done.output
    assert "missing after house 1 of at most 2: PG" in done.stdout
    recipe = Recipe.load(str(tmp_path / "pack.recipe.json"))
    assert recipe.drafted_in == 1
    done = vigil(
        "remake", tmp_path / "pack.recipe.json", "--houses", made / "two.jsonl.gz", "--out", tmp_path / "again"
    )
    assert done.exit_code == 0, done.output
    assert contents(tmp_path / "again") == contents(out)


@pytest.mark.parametrize(("count", "said"), [((), "needs --count"), (("--count", "5"), "the first drafts in 5 houses")])
def test_a_budget_below_the_first_houses_is_refused(
    made: Path, tmp_path: Path, count: tuple[str, ...], said: str
) -> None:
    arguments = ("--name", "n", "--houses", made / "two.jsonl.gz", "--max-houses", "2", *count)
    with pytest.raises(SettingError, match=said):
        raise vigil("make", *arguments, "--out", tmp_path / "o").exception or AssertionError


def test_the_first_house_that_differs_is_named(made: Path, lines: list[bytes], tmp_path: Path) -> None:
    changed = lines[1].replace(b'"horizon": ', b'"horizon": 1', 1)
    assert changed != lines[1]
    (tmp_path / "two.jsonl").write_bytes(lines[0] + b"\n" + changed + b"\n")
    done = vigil("remake", made / "pack.recipe.json", "--houses", tmp_path / "two.jsonl", "--out", tmp_path / "o")
    assert isinstance(done.exception, PackMismatch)
    assert "House 2 of 2 in recipe 'two' ('two_2') has SHA-256" in str(done.exception)
    assert not (tmp_path / "o").exists()
    (tmp_path / "one.jsonl").write_bytes(lines[0] + b"\n")
    done = vigil("remake", made / "pack.recipe.json", "--houses", tmp_path / "one.jsonl", "--out", tmp_path / "o")
    assert "House 2 of 2 in recipe 'two' ('two_2') is missing" in str(done.exception)


def test_a_recipe_says_in_which_words_it_is_drafted(made: Path) -> None:
    recipe = Recipe.load(str(made / "pack.recipe.json"))
    assert (recipe.forms, recipe.drafts) == ("public", DRAFTS_VERSION)
    assert recipe.request.forms == "public"
    header = DraftsFile(made / "pack.drafts.jsonl").read().header
    assert (header.forms, header.drafts) == ("public", DRAFTS_VERSION)
    assert Pack.load(made / "pack").manifest.meta["forms"] == ["public"]


def test_a_recipe_of_another_version_of_drafts_is_refused(made: Path, tmp_path: Path) -> None:
    recipe = Recipe.load(str(made / "pack.recipe.json")).model_copy(update={"drafts": DRAFTS_VERSION - 1})
    recipe.save(tmp_path / "old.json")
    done = vigil("remake", tmp_path / "old.json", "--houses", made / "two.jsonl.gz", "--out", tmp_path / "o")
    assert isinstance(done.exception, SettingError)
    assert f"this package has version {DRAFTS_VERSION}" in str(done.exception)
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("given", "wanted"), [((), ["all"]), (("--forms", "held-out"), ["held_out"]), (("--forms", "public"), ["public"])]
)
def test_a_secret_seed_speaks_both_halves_unless_told(
    given: tuple[str, ...], wanted: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def noted(file: DraftsFile, sources: object, settings: GenerationSettings, **_: object) -> None:
        asked.append(settings.forms)
        raise SettingError("seen enough")

    monkeypatch.setattr("vigil.cli.making.pack.generate_drafts", noted)
    vigil("make", "--name", "mine", "--seed", str(2**70), *given, "--out", tmp_path / "mine")
    assert asked == wanted


def test_other_bytes_are_told(made: Path, tmp_path: Path) -> None:
    recipe = Recipe.load(str(made / "pack.recipe.json"))
    other = recipe.model_copy(update={"pack_sha256": "0" * 64, "made_with": {**recipe.made_with, "numpy": "0.1"}})
    other.save(tmp_path / "other.json")
    out = with_drafts(made, tmp_path / "o")
    done = vigil("remake", tmp_path / "other.json", "--houses", made / "two.jsonl.gz", "--out", out)
    assert done.exit_code == 2
    assert f"not the recipe's bytes: the recipe's pack has sha256 {'0' * 64}" in done.stdout
    assert "numpy 0.1 (here" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["pack.recipe.json"], ["'two.jsonl.gz'", "--houses"]),
        (["pack.recipe.json", "--houses", "nothing.jsonl"], ["'two.jsonl.gz'", "--houses"]),
        (["pack.recipe.json", "--houses", "two.jsonl.gz", "--assets", "sizes.json"], ["no asset", "VIGIL_ASSETS"]),
        (["no_such_recipe"], ["'no_such_recipe' does not exist", *(path.stem for path in PACKAGED.glob("*.json"))]),
        (["two.jsonl.gz"], ["is not JSON"]),
        (["pack/manifest.json"], ["manifest.json'"]),
    ],
)
def test_what_is_no_recipe_or_lacks_something_is_named(
    made: Path, arguments: list[str], words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(made)
    (made / "sizes.json").write_text('{"Chair": []}')
    done = vigil("remake", *arguments, "--out", "o")
    assert isinstance(done.exception, SettingError)
    for word in words:
        assert word in str(done.exception)


def test_a_recipe_of_procthor_10k_asks_for_no_file(
    lines: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "prior", FakePrior(tmp_path / "datasets", lines))
    done = vigil("make", "--name", "p", "--houses", "procthor-10k:val:1", *MADE, "--out", tmp_path / "pack")
    assert done.exit_code == 0, done.output
    assert "63 MB" in done.stderr
    recipe = Recipe.load(str(tmp_path / "pack.recipe.json"))
    assert [(row.dataset, row.split, row.index) for row in recipe.houses] == [("procthor-10k", "val", 1)]
    assert recipe.houses[0].revision == REVISION
    again = vigil("remake", tmp_path / "pack.recipe.json", "--out", with_drafts(tmp_path, tmp_path / "again"))
    assert again.exit_code == 0, again.output
    assert "the same bytes" in again.stdout


def test_too_few_drafts_are_no_recipe(made: Path, tmp_path: Path) -> None:
    arguments = ["--name", "n", "--houses", made / "two.jsonl.gz", *MADE, "--per-family", "90"]
    done = vigil("make", *arguments, "--out", with_drafts(made, tmp_path / "pack"))
    assert isinstance(done.exception, EpisodeError)
    assert not list(tmp_path.glob("*.recipe.json"))


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"revision": "../../evil"}, "houses.0.revision: String should match"),
        ({"revision": "0" * 39}, "houses.0.revision: String should match"),
        ({"split": "../secret"}, "houses.0.split: Input should be 'train', 'val' or 'test'"),
        ({"index": -1}, "houses.0.index: Input should be greater than or equal to 0"),
        ({"index": 10**30}, "houses.0.index: Input should be less than"),
        ({"name": "../x"}, "houses.0.name: String should match"),
        ({"dataset": "/etc/passwd"}, "houses.0.dataset: String should match"),
    ],
)
def test_a_recipe_names_no_place_outside(made: Path, tmp_path: Path, fields: dict[str, object], said: str) -> None:
    recipe = json.loads((made / "pack.recipe.json").read_text())
    recipe["houses"][0] |= {"dataset": "procthor-10k", "split": "val", "index": 0, "revision": REVISION} | fields
    (tmp_path / "evil.json").write_text(json.dumps(recipe))
    done = vigil("remake", tmp_path / "evil.json", "--out", tmp_path / "o")
    assert isinstance(done.exception, SettingError)
    assert said in str(done.exception)


def test_no_other_revision_than_the_pinned_one_is_fetched(
    made: Path, lines: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is fetched runs: the program of the dataset, as it is in that revision."""
    prior = FakePrior(tmp_path / "datasets", lines)
    monkeypatch.setitem(sys.modules, "prior", prior)
    recipe = json.loads((made / "pack.recipe.json").read_text())
    recipe["houses"][0] |= {"dataset": "procthor-10k", "split": "val", "index": 0, "revision": "e" * 40}
    (tmp_path / "evil.json").write_text(json.dumps(recipe))
    done = vigil("remake", tmp_path / "evil.json", "--houses", made / "two.jsonl.gz", "--out", tmp_path / "o")
    assert isinstance(done.exception, SettingError)
    assert f"this package accepts only {REVISION}" in str(done.exception)
    assert prior.calls == []


def test_an_endless_recipe_is_refused() -> None:
    with pytest.raises(SettingError, match="is a device, not a file"):
        Recipe.load("/dev/zero")
