"""A pack from a secret seed is played and published in every way there is, and what has left is attacked."""

import io
import json
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from inspect_ai import eval as inspect_eval
from inspect_ai._util.error import PrerequisiteError
from typer.testing import CliRunner, Result

from tests.support.chat_server import ChatAnswer, ChatRequest, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick
from vigil.authoring.drafting.sources import GeneratedHouse, houses_drawn_from
from vigil.authoring.packing.dataset_card import CARD
from vigil.cli import app
from vigil.errors import ModelAPIError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.packs.pack import MANIFEST, Pack
from vigil.packs.private import MIN_SECRET_SEED, REVEAL, is_private, read_seed, seed_sha256
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import rendered_sha256
from vigil.runner.run import run_pack
from vigil.scoring.saved_run import read_run

pytestmark = INSPECT
SEED = 271828182845904523536028747135266249775
FAMILIES = ("--family", "PG", "--family", "SV", "--family", "AI")
ROOMS = "bathroom"


def vigil(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


@dataclass(frozen=True)
class Secret:
    """A private pack, its run, and what may leave of both."""

    folder: Path
    pack: Pack
    published: str
    """The text of all files that were written to be published, without an option that reveals."""
    owned: str
    """What the commands tell to who owns the pack."""

    @property
    def run(self) -> Path:
        return self.folder / "run"


@pytest.fixture(scope="module")
def secret(tmp_path_factory: pytest.TempPathFactory) -> Secret:
    """The pack from a seed in a file, its run by a model that repeats the instruction, and all that was published."""
    folder = tmp_path_factory.mktemp("secret")
    (folder / "seed.txt").write_text(f"{SEED}\n")
    size = ("--rooms", ROOMS, "--count", "2", "--per-family", "1", *FAMILIES)
    made = vigil("pack", "make", "--name", "held_out", "--seed-file", folder / "seed.txt", *size, "--out", folder / "p")
    assert made.exit_code == 0, made.output
    pack = Pack.load(folder / "p")

    def brain(asked: ChatRequest) -> ChatAnswer:
        task = next(each.instruction for each in pack.episodes if each.instruction in asked.texts[0])
        said = {"skill_name": "report", "arguments": {"status": "success", "summary": task}}
        return ChatAnswer(json.dumps(said))

    with serving(brain) as server:
        settings = {"model": "openai/loopback", "base_url": server.url, "preflight": False}
        result = run_pack(quick(pack.folder, folder / "run", **settings))
    assert result.is_complete
    out = folder / "published"
    out.mkdir()
    told = [
        vigil("export", folder / "run", "--format", "every-eval-ever", "--developer", "me", "--out", out / "results"),
        vigil("report", folder / "run", "--format", "all", "--out", out / "report"),
        vigil("score", folder / "run"),
        vigil("score", folder / "run", "--json"),
    ]
    assert [each.exit_code for each in told] == [0] * len(told), [each.exception for each in told]
    (out / CARD).write_text((pack.folder / CARD).read_text())
    logs = [*(folder / "run" / "inspect").glob("*.eval")]
    assert logs
    texts = [text_of(path) for path in (*sorted(out.rglob("*")), *logs) if path.is_file()]
    owned = [vigil("pack", "info", pack.folder).output, vigil("pack", "info", pack.folder, "--json").output]
    owned.append((pack.folder / MANIFEST).read_text())
    return Secret(folder, pack, "\n".join([*texts, *(each.stdout for each in told)]), "\n".join(owned))


def text_of(path: Path) -> str:
    """All that a file says: of an archive, that of all its files."""
    if path.suffix == ".parquet":
        return str(pq.read_table(path).to_pylist())
    data = path.read_bytes()
    if path.suffix != ".eval":
        return data.decode("utf-8", "replace")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return "\n".join(f"{name}\n{archive.read(name).decode()}" for name in archive.namelist())


def rebuilt(text: str, houses: set[str]) -> set[str]:
    """The houses, by hash, that somebody finds who tries every number in a text as the seed of one."""
    numbers = {int(digits) for digits in re.findall(r"(?<![\d.])\d{1,40}(?![\d.])", text)}
    return {generate(number, spec_for(ROOMS)).sha256 for number in numbers} & houses


def test_what_was_published_holds_nothing_of_the_pack(secret: Secret) -> None:
    assert is_private(secret.pack.manifest.meta)
    assert secret.pack.sha256[:12] in secret.published
    for episode in secret.pack.episodes:
        hidden = [episode.id, episode.house.name, episode.house.sha256, episode.instruction, *episode.bound_ids()]
        hidden += [thing.partition("|")[0] for thing in episode.bound_ids()]
        hidden.append(rendered_sha256(episode.instruction, Profile()))
        found = [each for each in hidden if each in secret.published]
        assert not found, found


def test_no_seed_is_told_even_to_the_owner(secret: Secret) -> None:
    houses = houses_drawn_from(SEED, 2, [ROOMS])
    seeds = [SEED, *(house.seed for house in houses if isinstance(house, GeneratedHouse))]
    assert len(seeds) == 3
    assert min(seeds) > MIN_SECRET_SEED
    kept = "".join(path.read_text() for path in sorted(secret.pack.folder.rglob("*.json*")))
    for seed in seeds:
        for form in (str(seed), f"{seed:x}"):
            assert form not in secret.published + secret.owned + kept
    assert secret.pack.manifest.meta["seed_sha256"] == seed_sha256("held_out", SEED)
    assert {episode.house.name for episode in secret.pack.episodes} <= {house.name for house in houses}
    assert all(re.fullmatch(r"private_[0-9a-f]{20}", episode.id) for episode in secret.pack.episodes)


def test_no_number_in_what_was_published_rebuilds_a_house(secret: Secret) -> None:
    houses = {episode.house.sha256 for episode in secret.pack.episodes}
    small = re.sub(r"data:image/[^\"]+|<path[^>]*>|[\w.+/-]*\d\.\d[\w.]*", "", secret.owned)
    assert not rebuilt(small, houses)
    results = [path.read_text() for path in (secret.folder / "published" / "results").rglob("*.json")]
    assert not rebuilt("\n".join(results), houses)


def test_the_attack_rebuilds_a_house_whose_name_tells_its_seed() -> None:
    hashes = {generate(123456, spec_for(ROOMS)).sha256}
    assert rebuilt("17 episodes, one of them vigil_bathtub_seed123456_pg_0a1b2c", hashes) == hashes


def commands(secret: Secret, out: Path) -> dict[str, tuple[str | Path, ...]]:
    """Everything that would write more than rates and hashes."""
    run, episode, pack = secret.run, secret.pack.episodes[0].id, ("--pack", secret.pack.folder)
    return {
        "site": ("export", run, *pack, "--out", out / "site"),
        "page": ("export", run, "--episode", episode, *pack, "--out", out / "page.html"),
        "film": ("export", run, "--episode", episode, *pack, "--out", out / "film.webp"),
        "parquet": ("export", run, "--format", "parquet", "--out", out / "rows.parquet"),
        "hf": ("export", run, "--format", "hf", "--out", out / "dataset"),
        "trajectories": ("report", run, "--episode", episode, "--out", out / "report"),
        "diagram": ("report", run, "--diagram", "--out", out / "report"),
        "trajectory": ("figure", "trajectory", run, "--episode", episode, "--out", out / "t.png"),
        "pipeline": ("figure", "pipeline", run, "--episode", episode, "--out", out / "p.png"),
        "protocol": ("figure", "protocol", *pack, "--out", out / "d.png"),
        "sheet": ("pack", "sheet", secret.pack.folder, "--count", "1", "--out", out / "sheets"),
    }


def test_what_would_give_it_away_is_refused_and_nothing_is_written(secret: Secret, tmp_path: Path) -> None:
    for name, command in commands(secret, tmp_path).items():
        refused = vigil(*command)
        assert isinstance(refused.exception, SettingError), (name, refused.output)
        assert REVEAL in str(refused.exception), name
        assert not [path for path in tmp_path.rglob("*") if path.is_file()], name


def test_failures_of_the_infrastructure_are_kept_though_the_log_has_no_samples(secret: Secret, tmp_path: Path) -> None:
    with serving(lambda _: failure(500)) as server:
        settings = {"model": "openai/loopback", "base_url": server.url, "preflight": False, "retries": 0}
        result = run_pack(quick(secret.pack.folder, tmp_path / "run", **settings))
    assert (result.errors, result.is_complete) == (len(secret.pack.episodes), False)
    (log,) = (tmp_path / "run" / "inspect").glob("*.eval")
    assert not [each.id for each in secret.pack.episodes if each.id in text_of(log)]


def test_an_episode_that_breaks_off_is_told_of_though_the_log_has_no_samples(
    secret: Secret, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def broken(*given: object) -> None:
        raise RuntimeError("a fault of the program")

    monkeypatch.setattr("vigil.runner.run._RunSession.play", broken)
    with serving(lambda _: failure(500)) as server, pytest.raises(ModelAPIError, match="3 episodes broke off"):
        run_pack(quick(secret.pack.folder, tmp_path, model="openai/loopback", base_url=server.url, preflight=False))


def test_inspects_own_runs_are_refused_since_its_log_would_hold_everything(secret: Secret) -> None:
    given = {"pack": str(secret.pack.folder), "backend": "fake", "workers": 1}
    with pytest.raises(PrerequisiteError, match="reveal_private_pack=true"):
        inspect_eval("vigil/vigil", task_args=given, model="mockllm/model", display="none")


def test_the_rows_of_a_report_leave_private_packs_out_and_say_so(secret: Secret, tmp_path: Path) -> None:
    said = vigil("report", secret.run, "--format", "csv", "--out", tmp_path / "a")
    assert "its pack is private" in said.stderr
    assert not (tmp_path / "a" / "rows.csv").exists()
    assert (tmp_path / "a" / "tables").is_dir()
    assert vigil("report", secret.run, "--format", "csv", "--out", tmp_path / "b", REVEAL).exit_code == 0
    assert secret.pack.episodes[0].id in (tmp_path / "b" / "rows.csv").read_text()


def test_who_says_so_may_give_it_away(secret: Secret, tmp_path: Path) -> None:
    wanted = commands(secret, tmp_path)
    for name in ("parquet", "hf", "page"):
        assert vigil(*wanted[name], REVEAL).exit_code == 0, name
    assert secret.pack.episodes[0].instruction in (tmp_path / "page.html").read_text()
    results = ("export", secret.run, "--format", "every-eval-ever", "--developer", "me", "--out", tmp_path / "results")
    assert vigil(*results, REVEAL).exit_code == 0
    (samples,) = (tmp_path / "results").rglob("*_samples.jsonl")
    assert len(samples.read_text().splitlines()) == len(secret.pack.episodes)


def test_the_card_of_a_private_pack_gives_no_licence(secret: Secret) -> None:
    card = (secret.pack.folder / CARD).read_text()
    assert "apache" not in card.lower()
    assert "license:" not in card
    assert "data_files" not in card
    assert "**Private**" in card
    assert "3 episodes of AI, PG, SV." in card
    assert secret.pack.sha256 in card


def test_scores_of_a_private_pack_are_those_of_any(secret: Secret) -> None:
    scores = read_run(secret.run, None).table.scores()
    assert len(scores.outcomes) == len(secret.pack.episodes)
    (aggregate,) = (secret.folder / "published" / "results").rglob("*.json")
    result = json.loads(aggregate.read_text())
    assert "detailed_evaluation_results" not in result
    assert {each["evaluation_result_id"] for each in result["evaluation_results"]} >= {"overall/W", "PG/B"}


def test_two_steps_make_a_private_pack_too(tmp_path: Path) -> None:
    (tmp_path / "seed.txt").write_text(str(SEED))
    drafts = tmp_path / "drafts.jsonl"
    few = ("--family", "PG", "--tries", "3", "--per-house", "1")
    proposed = vigil(
        *("pack", "propose", "--seeds", "0:1", "--rooms", ROOMS, *few), "--seed-file", tmp_path / "seed.txt",
        "--out", drafts,
    )  # fmt: skip
    assert proposed.exit_code == 0, proposed.output
    built = vigil(
        *("pack", "build", "--drafts", drafts, "--family", "PG", "--per-family", "1"), "--name", "two",
        "--out", tmp_path / "two",
    )  # fmt: skip
    assert built.exit_code == 0, built.output
    pack = Pack.load(tmp_path / "two")
    assert pack.manifest.meta["seed_sha256"] == seed_sha256("two", SEED)
    assert "seed" not in pack.manifest.meta
    (episode,) = pack.episodes
    assert episode.house.name == houses_drawn_from(SEED, 1, [ROOMS])[0].name
    assert episode.provenance.seed is None


@pytest.mark.parametrize(
    "text", [None, "", "77", "0x1f", str(MIN_SECRET_SEED - 1), "-" + str(SEED), f"{SEED} {SEED}", "9" * 2000, "\xff"]
)
def test_a_file_without_a_secret_seed_is_named(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "seed.txt"
    if text is not None:
        path.write_text(text, encoding="latin-1")
    with pytest.raises(SettingError, match=r"Seed file .*seed\.txt.*secrets\.randbits\(128\)"):
        read_seed(path)


def test_a_seed_is_given_once_and_of_others_houses_it_is_no_secret(tmp_path: Path) -> None:
    (tmp_path / "seed.txt").write_text(str(SEED))
    file, out = ("--seed-file", tmp_path / "seed.txt"), ("--out", tmp_path / "o")
    for verb in (("pack", "make", "--name", "n"), ("houses", "generate"), ("pack", "stream", "--count", "1")):
        both = vigil(*verb, "--seed", "7", *file, *out)
        assert "--seed and --seed-file exclude each other" in str(both.exception)
    filed = vigil("pack", "make", "--name", "n", "--houses", "h.json", *file, *out)
    assert "it is in the recipe" in str(filed.exception)
    demos = vigil("demos", "--pack", f"stream:{SEED}", *out)
    assert "long enough to be a secret" in str(demos.exception)


def test_a_house_of_a_secret_seed_does_not_tell_it(tmp_path: Path) -> None:
    (tmp_path / "seed.txt").write_text(str(SEED))
    made = vigil("houses", "generate", "--seed-file", tmp_path / "seed.txt", "--rooms", ROOMS,
                 "--out", tmp_path / "h.json")  # fmt: skip
    assert made.exit_code == 0, made.output
    house = json.loads((tmp_path / "h.json").read_text())
    known = generate(SEED, spec_for(ROOMS))
    assert str(SEED) not in (tmp_path / "h.json").read_text()
    assert house["objects"] == known.data["objects"]
    assert str(SEED) in json.dumps(known.data)


def test_a_stream_of_a_secret_seed_tells_none(tmp_path: Path) -> None:
    (tmp_path / "seed.txt").write_text(str(SEED))
    made = vigil(
        *("pack", "stream", "--seed-file", tmp_path / "seed.txt", "--count", "1", "--family", "PG", "--workers", "1"),
        *("--out", tmp_path / "s"),
    )
    assert made.exit_code == 0, made.output
    pack = Pack.load(tmp_path / "s")
    assert is_private(pack.manifest.meta)
    files = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != "seed.txt"]
    assert files
    assert not [path for path in files if str(SEED) in path.read_text()]
    assert str(SEED) not in made.output
