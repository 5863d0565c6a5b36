"""Baselines, guesses without a look, solutions in figures, and contact sheets."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from tests.support.builders import episode as story_episode
from tests.support.tiny_pack import FRIDGE, tiny_episode, tiny_house, tiny_pack
from vigil.authoring.packing.baselines import (
    AGENTS,
    BASELINES,
    BLIND_AGENTS,
    Baselines,
    baselines_table,
    broken_promises,
    guess_lines,
    list_baselines,
    majority_guess,
    measured_baselines,
    read_baselines,
    strongest_lines,
    words_guess,
)
from vigil.authoring.packing.dataset_card import skill_shares, steps_of
from vigil.authoring.review.contact_sheets import COLUMNS, GAP, WIDTH, pick_sample, sheet_of
from vigil.cli import app
from vigil.errors import PackMismatch
from vigil.packs.pack import Pack
from vigil.protocol.actions import Report, Status
from vigil.protocol.episode import Episode, HouseRef, Solution
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import ReportStatus

RATES = {"W": 0.0, "W_strict": 0.0, "B": 0.0, "FR": 0.0, "NR": 1.0, "IL": 0.0, "Other": 0.0}


def summary(families: dict[str, float], **rates: float) -> dict:
    """What `summarise` returns, as far as baselines need it: W by family, other rates alike everywhere."""

    def of(w: float) -> dict:
        found = {**RATES, **rates, "W": rates.get("W", w)}
        return {"episodes": 10, "mean_steps": 2.0, **found, "intervals": {"W": [0.0, 0.3], "B": [0.0, 0.3]}}

    return {"overall": of(0.1), "families": {family: of(w) for family, w in families.items()}}


ON_OFF: tuple[Status, Status] = ("on", "off")


def questions(*asked: tuple[str, Status, str]) -> tuple[list[Episode], dict[str, Solution]]:
    """Episodes that ask for a state, each with (instruction, label, house)."""
    episodes: list[Episode] = []
    solutions: dict[str, Solution] = {}
    for number, (instruction, label, house) in enumerate(asked):
        goal = ReportStatus(object_id=FRIDGE, state="is_toggled" if label in ("on", "off") else "is_open")
        ref = HouseRef(name=house, sha256=tiny_house().sha256)
        made = tiny_episode(number, "SV", goal=goal, instruction=instruction).model_copy(update={"house": ref})
        episodes.append(made)
        solutions[made.id] = Solution(episode_id=made.id, actions=(Report(status=label, summary=""),))
    return episodes, solutions


@pytest.fixture
def pack(tmp_path: Path) -> Pack:
    return tiny_pack(tmp_path / "pack", 8)


def test_words_that_give_the_state_away_are_found_out():
    telling: list[tuple[str, Status]] = [
        (f"Is the {'lit' if label == 'on' else 'dark'} lamp on or off?", label) for label in ON_OFF
    ]
    asked: list[tuple[str, Status, str]] = [
        (text, label, f"house{number}") for number in range(6) for text, label in telling
    ]
    guess = words_guess(*questions(*asked))
    assert (guess.hits, guess.n) == (12, 12)
    assert not guess.is_chance


def test_words_that_say_nothing_are_no_help():
    asked: list[tuple[str, Status, str]] = [
        ("Is the lamp on or off?", label, f"house{number}") for number in range(6) for label in ON_OFF
    ]
    guess = words_guess(*questions(*asked))
    assert guess.hits <= 6
    assert guess.is_chance


def test_what_is_learnt_in_a_house_is_not_used_in_it():
    asked: list[tuple[str, Status, str]] = [("Is the lamp on or off?", "on", "one")] * 8
    assert words_guess(*questions(*asked)).hits == 0  # nothing known: the first of the pair, "off"


def test_the_majority_is_counted_by_pair():
    labels: list[Status] = ["on", "on", "off", "open", "closed", "closed", "closed"]
    asked: list[tuple[str, Status, str]] = [("?", label, "h") for label in labels]
    guess = majority_guess(*questions(*asked))
    assert (guess.hits, guess.n) == (5, 7)


def test_solutions_are_told_by_family(pack):
    assert steps_of(pack)["SV"] == {"mean": 1.0, "max": 1, "budget": 5}
    assert skill_shares(pack) == {family: {"report": 1.0} for family in ("PG", "DA", "SV", "AI")}


def test_promises_that_are_kept_and_broken(pack):
    fine = {name: summary({"PG": 0.0, "VS": 0.4, "SV": 1.0}) for name in BLIND_AGENTS[1:]}
    fine["noop"] = summary({"PG": 0.0, "SV": 1.0})
    fine["solver"] = summary({"PG": 1.0}, W=1.0, W_strict=1.0, B=1.0)
    assert broken_promises(measured_baselines(pack, fine, "1")) == []
    bad = {
        **fine,
        "sweep": summary({"VS": 0.41, "SV": 1.0}),
        "noop": summary({"PG": 0.1}),
        "never_report": summary({"PG": 1.0}, B=0.2),
        "solver": summary({"PG": 1.0}, W=1.0, W_strict=0.9, B=1.0),
    }
    said = broken_promises(measured_baselines(pack, bad, "1"))
    assert [line.split(":")[0] for line in said] == ["sweep", "noop", "solver", "never_report"]


def test_lists_of_chores_have_their_own_scores_and_promises(pack):
    blind = {"W_share": 0.2, "W": 0.0, "B": 0.0, "T": 0.5, "chance": 0.5, "skill": 0.0}
    found = list_baselines(pack, {"claim_success": blind, "claim_fail": {**blind, "skill": None}}, "1")
    assert broken_promises(found) == []
    lines = baselines_table(found)
    assert lines[0] == "| agent | W share | W | B | T | T by chance | skill over chance |"
    assert lines[2] == "| claim_success | 20.0 | 0.0 | 0.0 | 50.0 | 50.0 | 0.0 |"
    assert lines[3].endswith("| 50.0 |  |")
    bad = {"claim_success": {**blind, "B": 0.1}, "claim_fail": blind, "claim_coin": {**blind, "skill": 0.2}}
    said = broken_promises(list_baselines(pack, bad, "1"))
    assert [line.split(":")[0] for line in said] == ["claim_success", "claim_coin"]


def test_the_blind_agent_with_the_highest_w_is_named_for_each_family(pack):
    rates = {
        "noop": summary({"PG": 0.0, "SV": 1.0, "AI": 0.0}),
        "centre": summary({"PG": 0.2, "SV": 0.9, "AI": 0.0}),
        "point": summary({"PG": 0.1, "SV": 1.0, "AI": 0.0}),
        "solver": summary({"PG": 1.0, "SV": 1.0, "AI": 1.0}, B=1.0),
    }
    lines = strongest_lines(measured_baselines(pack, rates, "1"))
    assert lines == ["- Highest W of a blind agent: PG 20.0 (`centre`), AI 0."]
    assert strongest_lines(list_baselines(pack, {}, "1")) == []


def test_figures_of_another_pack_do_not_count(pack, tmp_path):
    found = measured_baselines(pack, {"noop": summary({"PG": 0.0})}, "1")
    file = pack.folder / BASELINES
    file.write_text(found.model_dump_json())
    assert read_baselines(pack) == found
    file.write_text(found.model_copy(update={"pack_sha256": "0" * 64}).model_dump_json())
    assert read_baselines(pack) is None
    file.write_text("{}")
    with pytest.raises(PackMismatch, match="Measure again"):
        read_baselines(pack)


def test_the_table_has_a_row_for_each_agent(pack):
    found = measured_baselines(pack, {"noop": summary({"SV": 1.0}), "solver": summary({"SV": 1.0}, B=1.0)}, "1")
    lines = baselines_table(found)
    assert lines[0].endswith("| SV W/B |")
    assert lines[2] == "| noop | 10.0 [0, 30] | 0.0 [0, 30] | 0.0 | 100.0 | 0.0 | 100.0 / 0.0 |"
    assert lines[3].startswith("| solver (privileged) |")
    assert "of 2; chance is 50 %" in guess_lines(found)[0]


def test_a_sample_is_even_over_families_and_always_the_same():
    episodes = [story_episode(family, id=f"{family}-{n}") for family in ("AI", "SV", "PG") for n in range(9)]
    sample = pick_sample(episodes, 7)
    assert sample == pick_sample(episodes[::-1], 7)
    assert [episode.family for episode in sample] == sorted((e.family for e in sample), key=list(FAMILIES).index)
    assert sorted(sum(e.family == family for e in sample) for family in ("PG", "SV", "AI")) == [2, 2, 3]


def test_a_sheet_has_room_for_every_frame_and_its_words():
    frames = [Image.new("RGB", (640, 480), "#336699")] * 3
    sheet = sheet_of(["Short.", "Word " * 40, "Third."], frames)
    assert sheet.width == COLUMNS * (WIDTH + GAP) + GAP
    assert sheet.getpixel((GAP + 5, GAP + 5)) == (0x33, 0x66, 0x99)
    below = sheet.crop((GAP, GAP + 362, GAP + WIDTH, GAP + 362 + 70)).convert("L")
    assert np.asarray(below).min() < 120


def test_the_commands_measure_and_show_a_pack(pack, tmp_path):
    runner = CliRunner()
    done = runner.invoke(
        app, ["pack", "baselines", str(pack.folder), "--log-dir", str(tmp_path / "runs"), "--workers", "1", "--card"]
    )
    assert done.exit_code == 2  # in a room so small, walking ahead ends near the table
    assert "broken: forward: W is 100.0% in DA" in done.output
    kept = Baselines.model_validate_json((pack.folder / BASELINES).read_bytes())
    assert list(kept.agents) == list(AGENTS)
    assert "## Baselines" in (pack.folder / "README.md").read_text()
    assert Pack.load(pack.folder).sha256 == pack.sha256
    told = json.loads(runner.invoke(app, ["pack", "info", str(pack.folder), "--json"]).output)
    assert told["solutions"]["steps"]["PG"]["budget"] == 5
    done = runner.invoke(app, ["pack", "sheet", str(pack.folder), "--count", "4", "--out", str(tmp_path / "sheets")])
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in (tmp_path / "sheets").iterdir()) == ["AI.webp", "DA.webp", "PG.webp", "SV.webp"]
