"""AI2-THOR's messages for refused actions, and the protocol's refusal that stands for each message.

Messages also contain names, exceptions and traces, so each row of the tables below has only a part of a message. The
first row whose part occurs in a message is used. A message that fits no row is logged as a warning and means `UNKNOWN`.
"""

import logging
import re

from vigil.protocol.house import EXTERIOR
from vigil.protocol.world import RefusalCode
from vigil.sim.core.handling import InteractionResult

UNKNOWN: RefusalCode = "blocked_by_object"
"""Refusal that is used for a message that fits no row."""
AGENT = "agent"
"""Name for the agent itself, if it is the obstacle that blocks a motion."""

OUT_OF_SIGHT: tuple[tuple[str, RefusalCode], ...] = (
    ("not found within the specified visibility", "nothing_hit"),
    ("visible but not interactable", "nothing_hit"),
    ("is not currently Visible", "nothing_hit"),
)
"""Rows (part of a message, refusal) for messages which say that THOR finds no point of the object in view."""
MESSAGES: tuple[tuple[str, RefusalCode], ...] = (
    ("is not an Openable object", "not_openable"),
    ("object is not toggleable", "not_toggleable"),
    ("controlled by another sim object", "not_toggleable"),
    ("Target is broken", "not_toggleable"),
    ("must have the property CanPickup", "not_pickupable"),
    ("already on!", "already_so"),
    ("already off!", "already_so"),
    ("Target must be OFF to open", "interlock"),
    ("Target must be closed to Toggle On", "interlock"),
    ("collided with the agent", "blocked_by_agent"),
    ("collided with agent", "blocked_by_agent"),
    ("collided with FPSController", "blocked_by_agent"),
    ("Openable object collided with", "blocked_by_object"),
    ("carries something", "object_occupied"),
    ("has something in it already", "hand_full"),
    ("would cause it to collide and clip into something", "blocked_by_object"),
    ("isn't holding anything", "hand_empty"),
    ("Nothing is in the agent's hand", "hand_empty"),
    ("is NOT a receptacle", "not_a_receptacle"),
    ("cannot be placed in", "not_a_receptacle"),
    ("is CLOSED", "receptacle_closed"),
    ("is full right now", "no_room"),
    ("No valid positions to place object found", "no_room"),
    ("can't be dropped", "no_room"),
    ("a held item", "blocked_by_object"),
    ("from moving by", "path_blocked"),
    ("Scene bounds do not contain", "path_blocked"),
    *OUT_OF_SIGHT,
    ("No SimObject found", "nothing_hit"),
    ("no sim objects found", "nothing_hit"),
    ("beyond your visibilityDistance", "nothing_hit"),
)
"""Rows (part of a message, refusal) for all messages."""

_BLOCKERS = (re.compile(r"collided with (.+)$"), re.compile(r"([^:]+?) is blocking "))
_LOG = logging.getLogger(__name__)


def refusal_of(message: str) -> InteractionResult:
    """Return the protocol's refusal that a message of THOR means, and THOR's name of what was in the way, if known."""
    code: RefusalCode | None = next((code for part, code in MESSAGES if part in message), None)
    if code is None:
        _LOG.warning("AI2-THOR refused an action for an unknown reason, taken for %s: %s", UNKNOWN, message)
        return InteractionResult(UNKNOWN)
    if "Scene bounds" in message:
        return InteractionResult(code, EXTERIOR)
    if code == "blocked_by_agent":
        return InteractionResult(code, AGENT)
    if code not in ("path_blocked", "blocked_by_object"):
        return InteractionResult(code)
    words = message.partition(". trace")[0].strip()
    found = next(filter(None, (pattern.search(words) for pattern in _BLOCKERS)), None)
    return InteractionResult(code, found[1].strip() if found else None)


def is_out_of_sight(message: str) -> bool:
    """Return whether THOR refused because it found no point of the object in view."""
    return any(part in message for part, _ in OUT_OF_SIGHT)
