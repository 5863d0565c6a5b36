"""Lists of chores, without a house: one list of six chores, its answer, its world at the reset, and its reports."""

from typing import Any

from tests.support.builders import RecordBuilder, episode, thing
from vigil.base.geometry import Vec3
from vigil.base.numbered_list import write_list
from vigil.packs.pack import invalid_limit
from vigil.protocol.actions import ChoreClaim, Report
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Chore, Chores, ObjectAtReceptacle, ObjectInState, ReportStatus
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ChoreAnswer, ListAnswer, list_kind
from vigil.scoring.closure import Certificate, Evidence

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

    def switch(self) -> "Story":
        """Turn off the lamp."""
        self.do(lamp={"is_toggled": False})
        return self

    def place(self) -> "Story":
        """Put the mug on the desk."""
        self.do(mug={"parent": "desk", "support_chain": ("desk",)})
        return self


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


def closed(
    story: RecordBuilder, claims: dict[int, ChoreClaim] | None, status: str = "fail", **raw: str
) -> EpisodeRecord:
    """Return the record after a report. `raw` are claims in words outside the vocabulary, as `c1="Done!"`."""
    words = {int(name[1:]): word for name, word in raw.items()}
    found = None if claims is None else {**claims, **dict.fromkeys(words, "invalid")}
    fields = {"status": status, "summary": "", "claims": found, "raw_claims": words}
    return story.do(Report.model_validate(fields)).end("report")
