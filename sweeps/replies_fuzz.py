"""Fuzzes the parser of replies, and the record's round trip of parsed replies.

    python -m sweeps.replies_fuzz                            10^6 replies: 200 pieces of 5,000
    python -m sweeps.replies_fuzz --piece 3 --case 17        one reply again

For every reply, `parse_text` returns and never raises; text and bytes agree; what the strict policy accepts, the
lenient one accepts as the same action, and the strict one states correctly what the lenient one would do; numbers are
finite and pixels are in the frame; stored as JSON and read again, the step is equal and its reply parses to the same;
the time is bounded. Replies of known form (reasoning at the head, text after the object, depth, size) are accepted or
refused as protocol.md section 2.3 says.
"""

import random
import sys
import time
from collections import Counter
from functools import partial

from sweeps.support import pieces
from sweeps.support.pieces import Failure, PieceResult, Sweep
from sweeps.support.reply_forms import ReplyForm, any_form
from vigil.base.geometry import Pose, Vec3
from vigil.base.json_lines import dump_line
from vigil.protocol.actions import (
    Coordinates,
    InteractPixel,
    InvalidAction,
    Look,
    Navigate,
    ParsedReply,
    Reply,
    ReplyPolicy,
)
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import Profile
from vigil.protocol.replies import parse_text, read_reply
from vigil.protocol.world import WorldState
from vigil.records.record import StepRecord

PER_PIECE = 5000
SECONDS, SECONDS_PER_MB = 0.1, 4.0
"""Limits on the processor time of one parse and on its growth, far above the actual times."""
WORLD = WorldState(agent=Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0))
MAX_MAGNITUDE_DIGITS = 310

Parsed = ParsedReply | InvalidAction


def main() -> int:
    """Run the sweep."""
    options = pieces.parser(__doc__ or "", 200).parse_args()
    work = partial(fuzz, options.seed, options.case, PER_PIECE)
    return pieces.run(Sweep("replies_fuzz", {"seed": options.seed}, work), options)


def fuzz(seed: int, case: int | None, count: int, piece: int) -> PieceResult:
    """Return the results of a piece's replies, or of one of them."""
    result = PieceResult()
    for number in range(count) if case is None else (case,):
        form = any_form(random.Random(f"{seed}/{piece}/{number}"))
        again = f"--piece {piece} --case {number}"
        for kind, detail in faults_of(form, result.counts):
            result.failures.append(Failure(kind, f"{detail}; reply {_shown(form.text)}", again))
        result.counts["replies"] += 1
    return result


def faults_of(form: ReplyForm, counts: Counter[str]) -> list[tuple[str, str]]:
    """Return what does not hold of a reply, as (kind, detail), and count the reply by its kind."""
    try:
        return _faults(form, counts)
    except Exception as error:  # noqa: BLE001 - any exception at all is what is looked for
        return [("an exception", f"{type(error).__name__}: {error}")]


def _faults(form: ReplyForm, counts: Counter[str]) -> list[tuple[str, str]]:
    strict, seconds = _timed(form.text, "pixel", "strict")
    lenient, more = _timed(form.text, "pixel", "lenient")
    counts[_name(strict)] += 1
    faults = [*_expected(form, strict), *_policies(strict, lenient), *_bytes_agree(form.text, strict)]
    for coordinates in ("pixel", "normalized_1000"):
        faults += _stored(form.text, coordinates)
    allowed = SECONDS + SECONDS_PER_MB * len(form.text) / 1e6
    if max(seconds, more) > allowed:
        faults.append(("slow", f"{max(seconds, more):.2f} s for {len(form.text)} characters, {allowed:.2f} s allowed"))
    return faults


def _expected(form: ReplyForm, found: Parsed) -> list[tuple[str, str]]:
    if form.is_refused and not (isinstance(found, InvalidAction) and found.kind == "protocol_failure"):
        return [("accepted against the protocol", _name(found))]
    if form.same_as is None:
        return []
    if form.is_action and isinstance(found, InvalidAction):
        return [("refused against the protocol", f"{found.reason} {found.detail}")]
    if found != parse_text(form.same_as):
        return [("not the same as its object alone", _name(found))]
    return []


def _policies(strict: Parsed, lenient: Parsed) -> list[tuple[str, str]]:
    if isinstance(strict, ParsedReply):
        return [] if lenient == strict else [("strict accepts, lenient differs", _name(lenient))]
    if strict.would_parse_leniently != isinstance(lenient, ParsedReply):
        return [("strict says wrongly what lenient would do", f"{_name(strict)} and {_name(lenient)}")]
    return []


def _bytes_agree(text: str | bytes, found: Parsed) -> list[tuple[str, str]]:
    try:
        other: str | bytes = text.decode() if isinstance(text, bytes) else text.encode()
    except UnicodeError:
        is_refused = isinstance(found, InvalidAction) and found.reason == "not_utf8"
        return [] if is_refused else [("not UTF-8, and not refused for it", _name(found))]
    return [] if parse_text(other) == found else [("text and bytes differ", _name(found))]


def _stored(text: str | bytes, coordinates: Coordinates) -> list[tuple[str, str]]:
    reply = Reply.model_validate({"text": text})
    found = read_reply(reply, Profile(coordinates=coordinates)).parsed
    faults = [] if isinstance(found, InvalidAction) else _out_of_range(found)
    step = StepRecord(
        index=1,
        reply=reply,
        action=None if isinstance(found, InvalidAction) else found.action,
        invalid=found if isinstance(found, InvalidAction) else None,
        ignored_keys=() if isinstance(found, InvalidAction) else found.ignored_keys,
        world=WORLD,
    )
    line = dump_line(step)
    again = StepRecord.model_validate_json(line)
    if again != step or dump_line(again) != line:
        faults.append(("stored and read again it differs", coordinates))
    if read_reply(again.reply, Profile(coordinates=coordinates)).parsed != found:
        faults.append(("the stored reply parses to something else", coordinates))
    return faults


def _out_of_range(found: ParsedReply) -> list[tuple[str, str]]:
    action = found.action
    if isinstance(action, Navigate | Look) and not 0.0 < action.magnitude < float("inf"):
        return [("a magnitude that is none", repr(action.magnitude))]
    if not isinstance(action, InteractPixel) or action.intent == "drop":
        return []
    x, y = action.x, action.y
    is_inside = x is not None and y is not None and 0 <= x < FRAME_WIDTH and 0 <= y < FRAME_HEIGHT
    return [] if is_inside else [("a pixel outside of the frame", f"{x}, {y}")]


def _timed(text: str | bytes, coordinates: Coordinates, policy: ReplyPolicy) -> tuple[Parsed, float]:
    """Return the parsed reply and the processor time of parsing, the least of three if the first is long."""
    seconds: list[float] = []
    while True:
        began = time.process_time()
        found = parse_text(text, coordinates, policy)
        seconds.append(time.process_time() - began)
        if seconds[-1] < SECONDS or len(seconds) == 3:
            return found, min(seconds)


def _name(found: Parsed) -> str:
    return "accepted" if isinstance(found, ParsedReply) else f"{found.kind}.{found.reason}"


def _shown(text: str | bytes) -> str:
    shown = ascii(text)
    return shown if len(shown) <= 400 else f"{shown[:200]} ... {shown[-200:]} ({len(text)} long)"


if __name__ == "__main__":
    sys.exit(main())
