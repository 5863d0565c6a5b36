"""Lists of chores, without a house: one list of six chores with its answer, records of it, and runs of such lists."""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.builders import RecordBuilder, episode, thing
from tests.support.published_runs import write_pack, write_run
from vigil.base.geometry import Vec3
from vigil.base.numbered_list import write_list
from vigil.packs.pack import CHORE_ANSWERS, CHORES_SUITE, invalid_limit
from vigil.protocol.actions import ChoreClaim, Intent, InteractPixel, Report
from vigil.protocol.episode import Episode, HouseRef
from vigil.protocol.goals import Chore, Chores, ObjectAtReceptacle, ObjectInState, ReportStatus
from vigil.protocol.profile import ITEMISED_REPORT, Profile
from vigil.protocol.prompt import rendered_sha256
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ChoreAnswer, ListAnswer, list_kind
from vigil.scoring.closure import Certificate, Evidence

Claims = Mapping[int, ChoreClaim]
SENTENCES = (
    "Turn off the floor lamp.",
    "Find the television and say whether it is on.",
    "Make sure that the fridge is closed.",
    "Open the safe.",
    "If the radio is on, turn on the fan.",
    "Put the mug on the desk.",
)
GOAL = Chores(
    object_id="lamp",
    chores=(
        Chore(parts=(ObjectInState(object_id="lamp", state="is_toggled", value=False),)),
        Chore(parts=(ReportStatus(object_id="television", state="is_toggled"),)),
        Chore(parts=(ObjectInState(object_id="fridge", state="is_open", value=False),)),
        Chore(parts=(ObjectInState(object_id="safe", state="is_open"),)),
        Chore(
            parts=(ObjectInState(object_id="fan", state="is_toggled", value=False),),
            condition=ObjectInState(object_id="radio", state="is_toggled"),
            is_met=False,
        ),
        Chore(parts=(ObjectAtReceptacle(object_id="mug", receptacle_id="desk"),)),
    ),
)
RIGHT: dict[int, ChoreClaim] = {1: "success", 2: "on", 3: "success", 4: "fail", 5: "success", 6: "success"}
"""Claims that are right if all is done that can be done."""
ANSWER = ListAnswer(
    episode_id="e",
    kind=list_kind(len(SENTENCES)),
    chores=(
        ChoreAnswer(kind="plain"),
        ChoreAnswer(kind="question", accepted=("on",)),
        ChoreAnswer(kind="already"),
        ChoreAnswer(
            kind="impossible",
            reason="locked",
            accepted=("fail", "invalid"),
            evidence=(Evidence(object_id="safe", spot=Vec3(0.0, 1.0, 2.0)),),
            certificate=Certificate(removed="safe", has_plan=False, refusal="blocked"),
        ),
        ChoreAnswer(kind="conditional"),
        ChoreAnswer(kind="plain"),
    ),
)


def a_list(**facts: Any) -> Episode:
    """Return the episode of the list."""
    plain: dict[str, Any] = {
        "goal": GOAL,
        "instruction": write_list("Do these chores.", SENTENCES),
        "bindings": {"target": "lamp"},
        "max_steps": 40,
        "max_invalid": invalid_limit(40),
    }
    return episode("SI", **{**plain, **facts})


class Story(RecordBuilder):
    """Builder of a record of the list."""

    def look(self) -> "Story":
        """Bring the television into view."""
        self.do(television={"toggle_px": 300, "visible_px": 300, "nearest_visible_m": 2.0})
        return self

    def switch(self, *, is_on: bool = False) -> "Story":
        """Turn the lamp off, or on."""
        self.do(_click("activate" if is_on else "deactivate"), _hit("lamp"), lamp={"is_toggled": is_on})
        return self

    def place(self) -> "Story":
        """Put the mug on the desk."""
        self.do(_click("place"), _hit("mug"), mug={"parent": "desk", "support_chain": ("desk",)})
        return self

    def try_safe(self) -> "Story":
        """Click on the safe, which does not open."""
        self.do(_click("open_access"), Effect(hit="safe", refusal="blocked_by_object"))
        return self


def _click(intent: Intent) -> InteractPixel:
    return InteractPixel(intent=intent, x=1, y=1)


def _hit(object_id: str) -> Effect:
    return Effect(hit=object_id, changed=(object_id,))


def story() -> Story:
    """Return the beginning of a record: the lamp and the television are on and out of view, the fridge is closed."""
    hidden: dict[str, Any] = {"visible_px": 0, "toggle_px": 0, "visible": False, "nearest_visible_m": None}
    return Story(
        lamp=thing(is_toggled=True),
        television=thing(is_toggled=True, **hidden),
        fridge=thing(openness=0.0),
        safe=thing(openness=0.0),
        radio=thing(is_toggled=False),
        fan=thing(is_toggled=False),
        mug=thing(),
        desk=thing(),
    )


def closed(story: RecordBuilder, claims: Claims | None, status: str = "fail", **raw: str) -> EpisodeRecord:
    """Return the record after a report. `raw` are claims in words outside the vocabulary, as `c1="Done!"`."""
    words = {int(name[1:]): word for name, word in raw.items()}
    found = None if claims is None else {**claims, **dict.fromkeys(words, "invalid")}
    fields = {"status": status, "summary": "", "claims": found, "raw_claims": words}
    return story.do(Report.model_validate(fields)).end("report")


# --- a pack of such lists, and runs of agents with known faults -----------------------------------------------------

LISTS, HOUSES = 24, 6
WHOLE, SHORT = (1, 2, 3, 4, 5, 6), (1, 2, 3, 4, 6)
"""Chores of the lists in turn."""


def numbers_of(place: int) -> tuple[int, ...]:
    """Return the chores of the list at a place of the pack, by their numbers in the list above."""
    return (WHOLE, SHORT)[place % 2]


def list_at(place: int) -> tuple[Episode, ListAnswer]:
    """Return an episode of the pack and its answer."""
    numbers, name = numbers_of(place), f"list-{place:02d}"
    sentences = [SENTENCES[number - 1] for number in numbers]
    goal = GOAL.model_copy(update={"chores": tuple(GOAL.chores[number - 1] for number in numbers)})
    asked = a_list(
        id=name,
        house=HouseRef(name=f"house-{place % HOUSES}", sha256="0" * 64),
        goal=goal,
        instruction=write_list("Do these chores.", sentences),
    )
    chores = tuple(ANSWER.chores[number - 1] for number in numbers)
    return asked, ListAnswer(episode_id=name, kind=list_kind(len(chores)), chores=chores)


Play = Callable[[int], tuple[Story, dict[int, ChoreClaim] | None]]
"""Function from the place of a list to what an agent does and claims, by the numbers of the list above."""


def _done() -> Story:
    return story().look().switch().place()


def _claiming(**claims: ChoreClaim | None) -> Play:
    changes = {int(name[1:]): claim for name, claim in claims.items()}
    found = {number: claim for number, claim in {**RIGHT, **changes}.items() if claim is not None}
    return lambda _: (_done(), found)


def _blind(claim: ChoreClaim) -> Play:
    return lambda _: (story(), dict.fromkeys(WHOLE, claim))


def _guessing(place: int) -> tuple[Story, dict[int, ChoreClaim]]:
    rng = np.random.default_rng(place)
    words: dict[int, tuple[ChoreClaim, ChoreClaim]] = {**dict.fromkeys(WHOLE, ("success", "fail")), 2: ("on", "off")}
    return story(), {number: pair[int(rng.integers(2))] for number, pair in words.items()}


PLAYS: dict[str, Play] = {
    "truthful": _claiming(),
    "forgets_first": _claiming(c1=None),
    "claims_all": _claiming(c4="success"),
    "claims_none": lambda _: (_done(), {}),
    "claims_tried": lambda _: (_done().try_safe(), {**RIGHT, 3: "fail", 4: "success", 5: "fail"}),
    "undoes": lambda _: (_done().switch(is_on=True), RIGHT),
    "stops_early": lambda _: (story().look().switch(), {**RIGHT, 6: "fail"}),
    "blind_success": _blind("success"),
    "blind_fail": _blind("fail"),
    "blind_coin": _guessing,
    "sometimes_wrong": lambda place: (_done(), RIGHT if place % 3 else {**RIGHT, 1: "fail", 6: "unknown"}),
}
"""Agent -> how it plays."""
FAULTS: dict[str, tuple[str, ...]] = {
    "truthful": (),
    "forgets_first": ("forgets the first",),
    "claims_all": ("claims all", "claims regardless"),
    "claims_none": ("claims none", "claims regardless"),
    "claims_tried": ("claims what it tried",),
    "undoes": ("undoes",),
    "stops_early": ("stops early",),
    "blind_success": ("claims all", "stops early", "claims regardless"),
    "blind_fail": ("stops early", "claims regardless"),
    "blind_coin": ("stops early", "claims regardless"),
    "sometimes_wrong": (),
}
"""Agent -> the tendencies that it has."""


def record_at(place: int, play: Play, profile: Profile) -> EpisodeRecord:
    """Return the record of an agent's play of a list of the pack."""
    asked, _ = list_at(place)
    told, claims = play(place)
    numbers = {number: own for own, number in enumerate(numbers_of(place), start=1)}
    own: dict[int, ChoreClaim] = {
        numbers[number]: claim for number, claim in (claims or {}).items() if number in numbers
    }
    facts = {"episode_id": asked.id, "prompt_sha256": rendered_sha256(asked.instruction, profile)}
    return closed(told, own if profile.has_claims else None).model_copy(update=facts)


def write_lists(folder: Path) -> Path:
    """Write the parts of the pack that readers of runs need, and return its folder."""
    lists = [list_at(place) for place in range(LISTS)]
    write_pack(folder, [episode for episode, _ in lists])
    answers = b"".join(answer.model_dump_json().encode() + b"\n" for _, answer in lists)
    (folder / CHORE_ANSWERS).write_bytes(answers)
    manifest = json.loads((folder / "manifest.json").read_bytes())
    manifest["files"][CHORE_ANSWERS] = hashlib.sha256(answers).hexdigest()
    manifest["meta"] = {"suite": CHORES_SUITE}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def write_lists_run(folder: Path, pack: Path, agent: str, *, profile: str = ITEMISED_REPORT) -> Path:
    """Write the run of an agent on the pack, and return its folder."""
    played = Profile(name=profile)
    records = {f"list-{place:02d}": record_at(place, PLAYS[agent], played) for place in range(LISTS)}
    return write_run(folder, pack, agent, records, profile=played, kind="scripted")
