"""Entries: what submitting says, how they are ranked and tested, which signs they show, and the site in a browser."""

import json
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from tests.support.browser_page import DESKTOP, PHONE, Visitor
from tests.support.commands import Vigil
from tests.web.leaderboard.conftest import ONE_WORKER, metadata
from vigil.errors import RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.records.record import EPISODES_FILE, ProviderFacts, read_header
from vigil.records.record_file import read_records
from vigil.scoring.saved_run import read_run
from vigil.web.leaderboard.boards import boards_of, history_of, signs_between
from vigil.web.leaderboard.build import build_site
from vigil.web.leaderboard.checking import CheckedEntry
from vigil.web.leaderboard.measures import Figures, PlayReader, own_signs
from vigil.web.leaderboard.metadata import check_value, read_metadata
from vigil.web.leaderboard.pages import SiteContent, write_site
from vigil.web.leaderboard.settings import BuildSettings
from vigil.web.leaderboard.submit import submit_run

PLAYS = Path(__file__).parents[3] / "docs" / "packs" / "plays"


def as_yaml(path: Path, **facts: Any) -> Path:
    said = {**metadata("agent").model_dump(mode="json"), **facts}
    path.write_text(yaml.safe_dump({name: value for name, value in said.items() if value != "absent"}))
    return path


def test_the_same_run_gives_the_same_bytes(bundles: dict[str, Path], runs: Path, tmp_path: Path) -> None:
    submit_run(runs / "always_success", metadata("always_success"), tmp_path / "again.zip", ONE_WORKER)
    assert (tmp_path / "again.zip").read_bytes() == bundles["always_success"].read_bytes()


def test_a_bundle_names_no_path_of_the_machine(bundles: dict[str, Path], pack: Pack) -> None:
    with zipfile.ZipFile(bundles["random"]) as file:
        assert not any(str(pack.folder).encode() in file.read(name) for name in file.namelist())


def test_incomplete_metadata_is_refused_with_all_that_is_missing(tmp_path: Path) -> None:
    path = as_yaml(tmp_path / "entry.yaml", weights="absent", tier="absent")
    with pytest.raises(SettingError, match=r"Missing: `weights` \(open or closed .*\); `tier` \(one of"):
        read_metadata(path)


def test_a_mistyped_key_is_answered_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"line \d+, wieghts: this key does not exist. Did you mean 'weights'\?"):
        read_metadata(as_yaml(tmp_path / "entry.yaml", wieghts="open"))


@pytest.mark.parametrize(
    ("facts", "why"),
    [
        ({"submission_type": "standard"}, "so it must be custom"),
        ({"methodology": {"verification": {"modified_prompts": True}}}, "`modified_prompts` is True"),
        ({"methodology": {"verification": {"omitted_questions": True}}}, "every episode of its pack"),
    ],
)
def test_metadata_that_the_run_contradicts_is_refused(
    runs: Path, tmp_path: Path, facts: dict[str, Any], why: str
) -> None:
    said = metadata("agent").model_dump(mode="json")
    for name, value in facts.items():
        if name == "methodology":
            said[name]["verification"].update(value["verification"])
        else:
            said[name] = value
    with pytest.raises(RecordError, match=why):
        submit_run(runs / "random", type(metadata("agent")).model_validate(said), tmp_path / "x.zip", ONE_WORKER)
    assert not (tmp_path / "x.zip").exists()


def test_without_metadata_the_command_says_where_to_write_them(vigil: Vigil, runs: Path, tmp_path: Path) -> None:
    said = vigil("submit", runs / "random", "--out", tmp_path / "x.zip")
    assert said.code == 2
    assert "with --metadata" in said.err
    assert "`model_name` (name of the model or agent)" in said.err


def test_places_are_checked_before_the_questions(vigil: Vigil, runs: Path, tmp_path: Path) -> None:
    assert "ends in .zip" in vigil("submit", runs / "random", "--out", tmp_path / "x").err
    assert "with --metadata" not in vigil("submit", runs / "absent", "--out", tmp_path / "x.zip").err


@pytest.mark.parametrize(
    ("place", "good", "bad"),
    [
        ("submission_date", "2026-11-27", "tomorrow"),
        ("references", ["https://example.org"], ["example.org"]),
        ("model_name", "a", None),
        ("methodology.verification.omitted_questions", "false", "perhaps"),
    ],
)
def test_each_answer_is_checked_when_it_is_given(place: str, good: object, bad: object) -> None:
    check_value(place, good)
    with pytest.raises(ValueError, match="validation error"):
        check_value(place, bad)


Make = Callable[..., CheckedEntry]


@pytest.fixture
def make(runs: Path) -> Make:
    """Make an entry of a model with plays of chosen verdicts, without playing any."""

    def entry(name: str, closed: list[bool], *, number: int = 0, **facts: Any) -> CheckedEntry:
        header = read_header(runs / "random").model_copy(update={"nonce": f"{number:032x}"})
        spec = header.spec.model_copy(update={"agent_kind": "model", **facts.pop("spec", {})})
        header = header.model_copy(update={"spec": spec, **facts.pop("header", {})})
        said = metadata(name, submission_type="standard", weights=facts.pop("weights", "open"))
        share = sum(closed) / len(closed)
        plays = pd.DataFrame(
            {
                "episode_id": [f"e{index}" for index in range(len(closed))],
                "epoch": 1,
                "attempt": 1,
                "house": [f"h{index % 20}" for index in range(len(closed))],
                "family": "PG",
                "W": True,
                "closed": closed,
                "steps": 5,
                "replies_sha256": [f"{number} {index}" for index in range(len(closed))],
                "play_sha256": [f"{number} {index}" for index in range(len(closed))],
                "actions_sha256": "",
                "is_solution": False,
                **facts.pop("plays", {}),
            }
        )
        figures: Figures = {"W": (1.0, 0.9, 1.0), "B": (share, max(0.0, share - 0.1), min(1.0, share + 0.1))}
        fields: dict[str, Any] = {"tier": "re_simulated", **facts}
        return CheckedEntry(
            metadata=said, header=header, suite=None, is_private=False, checked="Checked.", tokens={},  # pyright: ignore[reportArgumentType]
            figures=figures, tables=(), regimes=(), signs=(), plays=plays, **fields,
        )  # fmt: skip

    return entry


def test_neighbours_are_told_apart_only_by_a_test(make: Make) -> None:
    good = [index % 10 != 0 for index in range(100)]
    same = [index % 10 != 1 for index in range(100)]
    board = boards_of(
        [
            make("bad", [index % 10 == 0 for index in range(100)], number=1),
            make("a", good, number=2),
            make("b", same, number=3),
        ]
    )
    (found,) = board
    names = [each.entry.metadata.model_name for each in found.entries]
    assert names[2] == "bad"
    first, second, last = (each.to_next for each in found.entries)
    assert first is not None
    assert not first.is_apart
    assert "not told apart: +0.0 pp" in first.sentence
    assert second is not None
    assert second.is_apart
    assert last is None


def test_tiers_profiles_and_packs_are_ranked_apart(make: Make) -> None:
    entries = [
        make("a", [True], number=1),
        make("b", [True], number=2, tier="hosted"),
        make("c", [True], number=3, spec={"pack_sha256": "f" * 64}),
    ]
    assert [len(board.entries) for board in boards_of(entries)] == [1, 1, 1]
    assert next(iter(boards_of(entries))).tier == "hosted"


def test_history_is_over_versions_of_one_pack(make: Make) -> None:
    entries = [make("a", [True, False], number=number, spec={"pack": f"mini_v{number}"}) for number in (1, 2)]
    earlier = [
        {"model_name": "b", "profile": entries[0].header.spec.profile.name, "pack": "mini_v1", "result": "B 1.0"}
    ]
    (found,) = history_of(entries, earlier)
    assert (found.model, list(found.results)) == ("a", ["mini_v1", "mini_v2"])


def test_equal_replies_and_the_gap_to_a_fresh_pack_are_signs(make: Make) -> None:
    closed = [index % 2 == 0 for index in range(40)]
    copied = [f"2 {index}" if index < 7 else f"1 {index}" for index in range(40)]
    one = make("a", closed, number=1, plays={"replies_sha256": copied})
    other = make("b", closed, number=2)
    fresh = make(
        "a", [index % 4 == 0 for index in range(40)], number=3, tier="fresh_pack", spec={"pack_sha256": "1" * 64}
    )
    found = signs_between([one, other, fresh])
    assert (
        f"7 of 40 plays of 4 or more replies have, word by word, the replies of entry {other.id} (b)." in found[one.id]
    )
    gap = next(sign for sign in found[one.id] if "fresh pack" in sign)
    assert "+25.0 pp [" in gap
    assert gap in found[fresh.id]
    assert not any("fresh pack" in sign for sign in found[other.id])


def test_the_actions_of_another_with_other_thoughts_are_a_sign(make: Make) -> None:
    acted = [f"1 {index}" if index < 5 else "" for index in range(8)]
    one, other = (
        make(name, [True] * 8, number=number, plays={"actions_sha256": acted}) for number, name in enumerate("ab", 1)
    )
    assert signs_between([one, other])[one.id] == [
        f"5 of 5 plays of 4 or more replies with a click have, action by action, the actions of entry {other.id} (b)."
    ]


def timing_faults(run: Path, pack: Pack, seconds: float, moved: timedelta = timedelta()) -> set[str]:
    """Return the timing faults of a run's first play if its replies took `seconds` together, the play began `moved`
    later, and it ended 60 s after the run began."""
    header = read_header(run).model_copy(update={"ended": None})
    first = read_records(run / EPISODES_FILE)[0]
    steps = [
        step.model_copy(update={"reply": step.reply.model_copy(update={"seconds": seconds / len(first.steps)})})
        for step in first.steps
    ]
    reader = PlayReader(header, pack)
    times = {"started": first.started + moved, "ended": header.started + timedelta(seconds=60)}
    reader.facts(first.model_copy(update={"steps": tuple(steps), **times}))
    return set(reader.timing_faults)


def test_replies_may_take_longer_than_the_play_but_not_than_the_run(runs: Path, pack: Pack) -> None:
    """The start of a play that was continued in another process may be the start of that process."""
    fault = "their replies took longer than from the beginning of the run to the end of the play"
    assert timing_faults(runs / "random", pack, 59, timedelta(seconds=50)) == set()
    assert timing_faults(runs / "random", pack, 62) == {fault}


@pytest.mark.parametrize("folder", sorted(PLAYS.iterdir()), ids=lambda folder: folder.name)
def test_published_plays_of_readers_have_no_impossible_timing(folder: Path) -> None:
    saved = read_run(folder)
    reader = PlayReader(saved.header, Pack.load(saved.pack_folder))
    for key in saved.table.rows:
        reader.facts(saved.table.record(key))
    assert not reader.timing_faults


def test_names_solutions_and_timings_are_signs(make: Make) -> None:
    answered = ProviderFacts(replies=2, models={"m-1": 1, "m-2": 1})
    entry = make("a", [True, True], header={"answered": answered}, plays={"is_solution": [True, False]})
    said = entry.metadata.model_copy(update={"model_release": (datetime.now(UTC) + timedelta(days=400)).date()})
    signs = " ".join(own_signs(entry.header, said, entry.plays, {"they end before they begin": 1}))
    assert "name 2 models, not one: m-1, m-2" in signs
    assert "before the stated release" in signs
    assert "1 of 2 plays are, action by action, the solution" in signs
    assert "Impossible timing in 1 of 2 plays: they end before they begin." in signs


def test_decisions_are_read_and_shown_and_a_checked_bundle_is_not_checked_again(
    bundles: dict[str, Path], pack: Pack, tmp_path: Path, vigil: Vigil, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, settings = tmp_path / "site", BuildSettings(packs=(pack.folder,), workers=1, shown_plays=0)
    first = build_site([*bundles.values()], out, settings)
    assert first.checked == 2
    good, bad = (entry.id for entry in first.entries)
    decisions = tmp_path / "decisions.yaml"
    common = "by: us, date: 2026-01-01"
    decisions.write_text(
        f"decisions:\n"
        f"- {{run: {good}, status: accepted, why: it holds, tier: fresh_pack, {common}}}\n"
        f"- {{run: {bad}, status: withdrawn, why: the authors asked, {common}}}\n"
    )
    monkeypatch.setattr(
        "vigil.web.leaderboard.bundle_checks.verify_candidates", None
    )  # what is in the cache is not checked again
    arguments = (*bundles.values(), "--pack", pack.folder, "--shown-plays", "0", "--workers", "1")
    said = vigil("leaderboard", "build", *arguments, "--decisions", decisions, "--out", out)
    assert said.code == 0, said.err
    assert "Bundles: 2, of which 0 new. Entries: 1." in said.out
    assert f"{bad} · withdrawn · the authors asked (us, 2026-01-01)" in said.out
    found = json.loads((out / "entries.json").read_text())
    assert [(entry["id"], entry["tier"]) for entry in found["entries"]] == [(good, "fresh_pack")]
    assert "the authors asked" in (out / "index.html").read_text()
    assert pd.read_parquet(out / "plays.parquet")["entry"].unique().tolist() == [good]
    assert "always_success" in (out / "entries.csv").read_text()
    wrong = decisions.read_text().replace("withdrawn", "withdrwn")
    decisions.write_text(wrong)
    said = vigil("leaderboard", "build", *arguments, "--decisions", decisions, "--out", out)
    assert said.code == 2
    assert "line 3, decisions[2].status" in said.err


def test_a_new_bundle_costs_its_own_plays_only(
    bundles: dict[str, Path], pack: Pack, runs: Path, tmp_path: Path
) -> None:
    played: list[tuple[int, int]] = []

    def built(*paths: Path) -> int:
        played.clear()
        settings = BuildSettings(packs=(pack.folder,), workers=1, shown_plays=0)
        return build_site(paths, tmp_path / "site", settings, lambda *counts: played.append(counts)).checked

    together = len(bundles) * len(pack.episodes)
    assert built(*bundles.values()) == 2
    assert played == [(count, together) for count in range(1, together + 1)]
    submit_run(runs / "random", metadata("another name"), tmp_path / "new.zip", ONE_WORKER)
    assert built(*bundles.values(), tmp_path / "new.zip") == 1
    assert played[-1] == (len(pack.episodes), len(pack.episodes))


def test_a_folder_that_is_no_site_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(SettingError, match="is not the site of a leaderboard"):
        build_site([], tmp_path, BuildSettings())
    assert (tmp_path / "mine.txt").exists()


def test_a_bundle_that_does_not_exist_stops_the_build(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"absent.zip' does not exist"):
        build_site([tmp_path / "absent.zip"], tmp_path / "site", BuildSettings())
    assert not (tmp_path / "site").exists()


def test_a_link_to_a_site_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "site").symlink_to("served")
    for _ in range(2):
        build_site([], tmp_path / "site", BuildSettings())
        assert (tmp_path / "site").is_symlink()
        assert (tmp_path / "served" / "index.html").is_file()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(SettingError, match="is not the site of a leaderboard"):
        build_site([], tmp_path / "loop", BuildSettings())


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("   ", "at least 1 character"),
        ("\u3164", "an invisible character"),
        ("a\ufe0f", "an invisible character"),
        ("a" + "\u0301" * 4, "more than 3 marks"),
        ("G\u0420T-4o", "mixes Latin letters with letters that look like them"),
    ],
)
def test_a_name_that_deceives_is_refused(name: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        metadata(name)


OVERLAPS = """() => {
  const plot = document.querySelector("svg.plane");
  const nodes = [plot, ...plot.querySelectorAll(":scope > text")];
  const [whole, ...texts] = nodes.map((node) => node.getBoundingClientRect());
  const isIn = (a) => a.left >= whole.left && a.right <= whole.right && a.top >= whole.top && a.bottom <= whole.bottom;
  const meet = (a, b) => a.left + 2 < b.right && b.left + 2 < a.right && a.top + 2 < b.bottom && b.top + 2 < a.bottom;
  return texts.filter((a, at) => !isIn(a) || texts.slice(at + 1).some((b) => meet(a, b))).length;
}"""
"""Script that counts the titles and ticks of a plot that are cut off, or that overlap another one by over 2 px."""


@pytest.mark.parametrize(("size", "scheme"), [(DESKTOP, "light"), (PHONE, "dark")], ids=["desktop-light", "phone-dark"])
def test_a_hundred_entries_are_filtered_by_keyboard(
    make: Make, tmp_path: Path, chromium: Any, size: dict[str, int], scheme: str
) -> None:
    entries = [
        make(
            f"model {number}",
            [index % (number + 2) == 0 for index in range(40)],
            number=number,
            weights=("open", "closed")[number % 2],
        )
        for number in range(100)
    ]
    profile = "pure_rgb_dialogue_history_look_before_report"
    earlier = [
        {"model_name": "model 1", "profile": profile, "pack": f"vigil_mini_v{number}", "result": "B 10.0 [5.2, 18.5]"}
        for number in (1, 2)
    ]
    write_site(SiteContent(entries, (), signs_between(entries), {}, earlier), tmp_path / "site")
    context = chromium.new_context(viewport=size, color_scheme=scheme)
    visitor = Visitor(context.new_page())
    visitor.page.goto((tmp_path / "site" / "index.html").as_uri())
    visitor.check("index")
    visitor.check_with_axe("index")
    assert visitor.page.evaluate(OVERLAPS) == 0
    assert visitor.text("#shown") == "100 of 100 entries"
    visitor.tab_to("select[data-filter=weights]")
    visitor.press("ArrowDown")
    assert visitor.text("#shown") == "50 of 100 entries"
    assert visitor.page.locator("svg.plane a:not([hidden])").count() == 50
    visitor.tab_to("svg.plane a")
    visitor.press("Enter")
    visitor.page.wait_for_url("**/entries/*.html")
    visitor.check("entry")
    visitor.check_with_axe("entry")
    visitor.page.goto((tmp_path / "site" / "glossary.html").as_uri())
    visitor.check_with_axe("glossary")
    context.close()


def test_another_prompt_or_grammar_is_another_condition(make: Make) -> None:
    plain = make("a", [True], number=1)
    profile = plain.header.spec.profile
    neutral = profile.model_copy(update={"prompt_variant": "neutral_report"})
    loose = profile.model_copy(update={"reply_policy": "lenient"})
    entries = [plain, *(make("b", [True], number=2, spec={"profile": each}) for each in (neutral, loose))]
    assert [entry.profile.partition(", ")[2] for entry in entries] == ["", "neutral_report", "lenient"]
    assert len(boards_of(entries)) == 3
