"""What readers of a blind round are asked: the kinds of rounds, how pictures are laid out, and the forms of answers."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

RoundKind = Literal["near", "far", "state", "held", "starts", "pairs"]
DrawnBy = Literal["before", "after"]
"""Renderer of a picture: that of an older tree, or this one's."""
NonEmptyText = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class _BaseAnswer(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    n: int


class NamedAnswer(_BaseAnswer):
    """Question about a marked thing: what it is, and its state."""

    answers: list[NonEmptyText] = Field(min_length=1)
    """Guesses, the best one first."""
    state: NonEmptyText


class HeldAnswer(_BaseAnswer):
    """Whether the viewer holds something."""

    held: bool
    what: str


class ArtefactsAnswer(_BaseAnswer):
    """Question about drawing errors."""

    artefacts: list[NonEmptyText]


class VoteAnswer(_BaseAnswer):
    """Which of two pictures is the better one."""

    more_real: Literal["A", "B"]
    clearer: Literal["A", "B"]
    why: str


RoundAnswer = NamedAnswer | HeldAnswer | ArtefactsAnswer | VoteAnswer


@dataclass(frozen=True, slots=True)
class RoundLayout:
    """How a kind of round is laid out and answered."""

    cell_px: tuple[int, int]
    columns: int
    rows: int
    answer: type[RoundAnswer]
    blank: dict[str, object]
    """An empty answer."""
    question: str


FRAME_CELL_PX, CROP_CELL_PX = (640, 480), (400, 300)
_RULES = """Look at every sheet once, one after the other, and write the answers of a sheet before the next. Leave
none out. You must not know the program that drew the pictures: open no code, no page of its documentation, and no key
file. Answer what you see. The answers are lines of JSON in answers.jsonl, one for each picture, found there by its
number n: fill them in."""
_NAME = """In each picture four white corners, edged black, stand around ONE thing.
- answers: what that thing is, in one to three everyday words: the thing, not what it stands on. A second guess may
  follow.
- state: of a thing that can be open or closed, on or off: the one that it is in the picture. Of a machine with a door
  say both ("closed, off"); a tap is on when water runs, a candle or a hot plate when it burns or glows. Of others: "-".
"""
_HELD = """The pictures are what somebody sees who moves through rooms. In some this viewer holds a thing.
- held: true or false.
- what: the thing held, or what lies nearest.
"""
_ARTEFACTS = """Each picture shows a room. Which faults of drawing does it have? Light, shade, reflections, textures
or edges that are so wrong that a viewer would be misled or would notice within seconds, at normal size: shadows that
are hard, saw-toothed or detached; dark or bright patches without a cause; light that leaks; streaks, dotted lines,
moire; flat black areas; things that vanish before what is behind them; mirrors that show nothing. No faults are: a
simple style, plain furniture, few pixels, odd colours, things in odd places.
- artefacts: a list of "what and where", in a few words each; [] when there are none.
"""
_VOTE = """Each sheet shows one place twice, drawn by two programs: A on the left, B on the right, sides drawn by lot.
- more_real: "A" or "B": which looks more like a photograph of a real room?
- clearer: "A" or "B": in which does one see better what the things are, where they stand and in which state?
- why: a short reason. Decide each; there are no ties.
"""

_NAMING = RoundLayout(CROP_CELL_PX, 3, 3, NamedAnswer, {"answers": [], "state": ""}, _NAME)
LAYOUTS: dict[RoundKind, RoundLayout] = {
    "near": _NAMING,
    "far": _NAMING,
    "state": _NAMING,
    "held": RoundLayout(FRAME_CELL_PX, 2, 2, HeldAnswer, {"held": None, "what": ""}, _HELD),
    "starts": RoundLayout(FRAME_CELL_PX, 2, 2, ArtefactsAnswer, {"artefacts": None}, _ARTEFACTS),
    "pairs": RoundLayout(FRAME_CELL_PX, 2, 1, VoteAnswer, {"more_real": "", "clearer": "", "why": ""}, _VOTE),
}


def instructions(kind: RoundKind) -> str:
    """Return the instructions for readers of a round."""
    return f"{_RULES}\n\n{LAYOUTS[kind].question}"
