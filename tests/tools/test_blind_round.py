"""Blind rounds: what is drawn by lot, that readers learn nothing from their folder, and how answers are judged."""

import json
import shutil
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tools.blind import drawing, making, publishing, sampling, sheets
from tools.blind.drawing import FrameFacts, Job, Portrait, StartView
from tools.blind.forms import CROP_CELL_PX, LAYOUTS
from tools.blind.judging import WORDS, is_named, is_state_named, normalized
from tools.blind_round import main
from vigil.assets.catalog import CATALOG
from vigil.packs.names import stem_of
from vigil.packs.pack import packaged_names
from vigil.sim.engines.mujoco.compiled.binding import BACKEND

ROOT = Path(__file__).parents[2]
SEED = 11
draws = pytest.mark.skipif(BACKEND.fault is not None, reason=str(BACKEND.fault))


def _rows(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


PUBLISHED = [row for path in sorted(publishing.FOLDER.glob("*.jsonl")) for row in _rows(path)]


@pytest.fixture(scope="session")
def near(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if BACKEND.fault:
        pytest.skip(BACKEND.fault)
    folder = tmp_path_factory.mktemp("rounds") / "near"
    main(["make", "--kind", "near", "--seed", str(SEED), "--count", "2", "--out", str(folder)])
    return folder


def _key(folder: Path) -> dict[str, Any]:
    return json.loads(sheets.key_of(folder).read_text(encoding="utf-8"))


def _answer(folder: Path, *answers: dict[str, Any]) -> None:
    sheets.write_lines(folder / sheets.ANSWERS, ({"n": n, **answer} for n, answer in enumerate(answers, start=1)))


def _bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_a_reader_gets_sheets_a_question_and_what_to_fill_in(near: Path) -> None:
    assert sorted(path.name for path in near.iterdir()) == ["README.txt", "answers.jsonl", "sheet_01.png"]
    assert _rows(near / sheets.ANSWERS) == [{"n": n, "answers": [], "state": ""} for n in (1, 2)]


def test_no_file_of_a_reader_names_what_is_shown(near: Path) -> None:
    files = b"".join(_bytes_of(near).values()).lower()
    assert not [each for each in _key(near)["pictures"] if each["category"].lower().encode() in files]
    assert sheets.key_of(near).parent == near.parent


def test_the_same_seed_gives_the_same_bytes(near: Path, tmp_path: Path) -> None:
    folder = tmp_path / near.name
    main(["make", "--kind", "near", "--seed", str(SEED), "--count", "2", "--out", str(folder)])
    assert _bytes_of(folder) == _bytes_of(near)
    assert _key(folder) == _key(near)


def test_a_round_is_not_written_over(near: Path) -> None:
    with pytest.raises(SystemExit, match="already"):
        main(["make", "--kind", "near", "--seed", "1", "--count", "1", "--out", str(near)])


def test_far_things_are_large_enough_and_things_with_states_have_one() -> None:
    far = sampling.portraits("far", SEED, 6)
    assert len(far) == 6
    assert {each.distance_m for each in far} == {sampling.FAR_M}
    assert not {"Egg", "Fork", "CreditCard"} & {each.category for each in far}
    states = sampling.portraits("state", SEED, 16)
    assert len(states) == 16
    assert set(Counter(each.state for each in states)) == {"open", "closed", "on", "off"}


@pytest.mark.parametrize("box", [(300.0, 200.0, 340.0, 260.0), (600.0, 400.0, 640.0, 480.0), (10.0, 0.0, 500.0, 480.0)])
def test_a_cropped_picture_has_the_whole_thing_in_it(box: tuple[float, float, float, float]) -> None:
    frame = np.zeros((480, 640, 3), np.uint8)
    left, top, right, bottom = map(int, box)
    frame[top:bottom, left:right] = (200, 0, 0)
    picture = np.asarray(sheets.crop_around(Image.fromarray(frame), box))
    assert picture.shape == (CROP_CELL_PX[1], CROP_CELL_PX[0], 3)
    scale = 1.0 if right - left < CROP_CELL_PX[0] else CROP_CELL_PX[0] / 640
    red = (picture[..., 0] > 100) & (picture[..., 1] < 20)
    assert red.sum() == pytest.approx((right - left) * (bottom - top) * scale**2, rel=0.03)


@draws
def test_half_of_the_moments_are_after_a_pick_and_half_in_each_quality(tmp_path: Path) -> None:
    assert set(Counter(sampling.held_cases(40, SEED)).values()) == {10}
    folder = tmp_path / "held"
    main(["make", "--kind", "held", "--seed", "2", "--count", "2", "--pack", "starter", "--out", str(folder)])
    pictures = _key(folder)["pictures"]
    assert Counter((each["held"], each["quality"]) for each in pictures) == Counter(sampling.held_cases(2, 2))
    assert len({each["episode"] for each in pictures}) == 2
    with Image.open(folder / "sheet_01.png") as sheet:
        assert sheet.width > 2 * 640


def test_every_target_is_picked_once_before_one_is_picked_again() -> None:
    found = sampling.picks(sampling.candidates(["starter"]), SEED)
    first = [each.category for each in found[: len({each.category for each in found})]]
    assert len(first) == len(set(first)) > 5
    assert all(each.actions[-1].skill_name == "interact_pixel" for each in found)


def test_newest_packs_are_drawn_from_unless_others_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    (smoke,) = [name for name in packaged_names() if stem_of(name) == "vigil_smoke"]
    monkeypatch.setattr(sampling, "packaged_names", lambda: ["vigil_smoke_v0_9", smoke])
    assert {each.pack.name for each in sampling.candidates([])} == {smoke}
    assert {each.pack.name for each in sampling.candidates(["starter"])} == {"starter"}


def test_starts_are_shown_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "BACKEND", "fake")
    folder = tmp_path / "starts"
    main(["starts", "--seed", "3", "--count", "2", "--pack", "vigil_smoke", "--out", str(folder)])
    assert {each["drawn"] for each in _key(folder)["pictures"]} == {"after"}
    _answer(folder, {"artefacts": []}, {"artefacts": ["a streak on the wall"]})
    assert "in 1 of 2 (50.0 % [" in publishing.publish([folder], tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["round_1_artefacts.jsonl"]


@draws
def test_a_pair_is_drawn_by_both_trees_from_one_pose(tmp_path: Path) -> None:
    made = making.pair_round(SEED, 1, ["vigil_smoke"], ROOT)
    left, right = map(np.asarray, made.shown[0].pictures)
    assert (left == right).all()
    sheets.write(tmp_path / "pairs", made)
    _answer(tmp_path / "pairs", {"more_real": "A", "clearer": "B", "why": "light"})
    (row,) = publishing.read(tmp_path / "pairs").rows
    assert row["more_real"] == row["left"]
    assert {row["clearer"], row["more_real"]} == {"before", "after"}


def test_the_older_picture_is_on_either_side_equally_often() -> None:
    assert Counter(sampling.sides(40, SEED)) == {True: 20, False: 20}
    assert sampling.sides(40, SEED) == sampling.sides(40, SEED) != sampling.sides(40, SEED + 1)


def test_an_older_tree_that_shows_stand_ins_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def draw(tree: Path | None, jobs: Sequence[Job], folder: Path) -> list[FrameFacts]:
        asked.append(len(jobs))
        for number, _ in enumerate(jobs):
            Image.new("RGB", (640, 480)).save(drawing.frame_path(folder, number))
        return [FrameFacts(notes=["a drawer: shown as a box"] if tree else []) for _ in jobs]

    monkeypatch.setattr(making, "draw_with", draw)
    with pytest.raises(SystemExit, match=r"a drawer: shown as a box.*--pack"):
        making.pair_round(SEED, 2, ["starter"], ROOT)
    assert sum(asked) < 20


def test_a_folder_without_source_cannot_draw(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="checkout"):
        making.object_round("near", SEED, 1, tmp_path)


def test_what_cannot_be_drawn_says_why(tmp_path: Path) -> None:
    jobs = [StartView(str(tmp_path / "none.json"), {}, {}), Portrait("Unicorn", 1, None, 1, None)]
    assert [fact.fault is not None for fact in drawing.draw(jobs, tmp_path)] == [True, True]
    assert not list(tmp_path.glob("*.png"))


def test_answers_are_published_with_what_is_shown(near: Path, tmp_path: Path) -> None:
    folder = tmp_path / "near"
    shutil.copytree(near, folder)
    shutil.copy(sheets.key_of(near), sheets.key_of(folder))
    first, second = _key(near)["pictures"]
    right = {"answers": [CATALOG[first["category"]].display_name], "state": first["state"] or "-"}
    _answer(folder, right, {"answers": ["zeppelin", "airship"], "state": "-"})
    said = publishing.publish([folder], tmp_path / "out", 9)
    rows = _rows(tmp_path / "out" / "round_9_near_after.jsonl")
    assert [row["right"] for row in rows] == [True, False]
    assert [row["category"] for row in rows] == [first["category"], second["category"]]
    assert set(rows[0]) == {name for row in PUBLISHED if "span_px" in row and "drawn" in row for name in row}
    assert "| 9, near, after | 2 pictures | 1 of 2 (50.0 % [9.5, 90.5]) |" in said
    assert f"{second['category']} {second['variant']}: named 'zeppelin', then 'airship'" in said
    with pytest.raises(SystemExit, match="another --number"):
        publishing.publish([folder], tmp_path / "out", 9)


def test_what_nobody_answered_is_not_published(near: Path, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"answers\.jsonl, line 1"):
        publishing.publish([near], tmp_path)
    for blank, form in ((form.blank, form) for form in LAYOUTS.values()):
        with pytest.raises(ValueError):
            form.answer.model_validate({"n": 1, **blank})


def test_a_missing_answer_is_named(near: Path, tmp_path: Path) -> None:
    folder = tmp_path / "near"
    shutil.copytree(near, folder)
    shutil.copy(sheets.key_of(near), sheets.key_of(folder))
    _answer(folder, {"answers": ["egg"], "state": "-"})
    with pytest.raises(SystemExit, match=r"\[2\]"):
        publishing.publish([folder], tmp_path / "out")


def test_published_answers_are_judged_as_they_were() -> None:
    named = [row for row in PUBLISHED if row.get("right") is not None]
    assert len(named) > 1000
    assert [row for row in named if is_named(row["category"], row["answers"][0]) != row["right"]] == []
    told = [row for row in PUBLISHED if row.get("state_right") is not None and "drawn" in row]
    assert len(told) > 500
    assert [row for row in told if is_state_named(row["state"], row["state_answer"]) != row["state_right"]] == []


@pytest.mark.parametrize(
    ("state", "said", "right"),
    [
        ("open", "open", True),
        ("closed", "shut, off", True),
        ("on", "Closed, ON.", True),
        ("off", "-", False),
        ("open", "open or closed", False),
        ("on", "front panel", False),
    ],
)
def test_a_state_is_told_by_its_name_and_not_its_opposite(state: str, said: str, right: bool) -> None:
    assert is_state_named(state, said) is right


def test_accepted_words_are_of_the_catalogue_and_plain() -> None:
    listed: dict[str, list[str]] = json.loads(WORDS.read_text(encoding="utf-8"))
    assert set(listed) <= set(CATALOG)
    assert [word for words in listed.values() for word in words if word != normalized(word)] == []
    assert [name for name, words in listed.items() if words != sorted(set(words))] == []
    assert is_named("Egg", "An egg") is True
    assert is_named("Egg", "potato") is False


def test_lots_show_every_category_in_other_variants_and_states() -> None:
    lots = sampling.draw_subjects(3 * len(CATALOG), 2)
    assert lots == sampling.draw_subjects(3 * len(CATALOG), 2) != sampling.draw_subjects(3 * len(CATALOG), 3)
    for category in CATALOG:
        drawn = [lot for lot in lots if lot.category == category]
        assert len({lot.variant for lot in drawn}) == 3
    assert {lot.state for lot in lots if lot.category == "Fridge"} == {"open", "closed"}
    assert {lot.state for lot in lots if lot.category == "Microwave"} == {"open", "closed", "on"}


def test_lots_are_drawn_until_so_many_suit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sampling, "CATALOG", {name: CATALOG[name] for name in ("Egg", "Fork")})
    lots = sampling.draw_subjects(9, 2, lambda subject: subject.category == "Egg")
    assert {lot.category for lot in lots} == {"Egg"}
    assert len({lot.variant for lot in lots}) == 9
    with pytest.raises(ValueError, match="ask for fewer"):
        sampling.draw_subjects(1, 2, lambda _: False)


def test_marks_lie_around_the_box_and_within_the_picture() -> None:
    plain = np.full((480, 640, 3), 128, np.uint8)
    drawn = (np.asarray(sheets.marked(plain, (300.0, 200.0, 340.0, 230.0))) != 128).any(axis=2)
    assert drawn.any()
    assert not drawn[200:231, 300:341].any()
    rows, columns = np.nonzero(drawn)
    assert (rows.min() > 185, rows.max() < 245, columns.min() > 285, columns.max() < 355) == (True,) * 4
    assert sheets.marked(plain, (-50.0, -50.0, 900.0, 700.0)).size == (640, 480)
