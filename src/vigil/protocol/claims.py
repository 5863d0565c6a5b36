"""Claims: what a report says about each chore of a list, under a profile that asks for claims.

This module has both the prompt's words about claims and the code that reads claims, so that the two always agree.
Source: `protocol.md` section 9.
"""

import re
from typing import Any, Final, get_args

from vigil.base.json_files import is_object
from vigil.protocol.actions import ChoreClaim, ReplyFault, Report

ARGUMENT: Final = "claims"
"""Name of the argument of `report` that has the claims."""
CLAIM_LINE = f"- {ARGUMENT} (object, required): Claim about each chore, by its number (Table claims)"
CLAIM_TABLE = (
    "Table claims:",
    'One claim for each chore of the list, as in {"1": "success", "2": "invalid", "3": "off", "4": "unknown"}.',
    "- success: What the chore asks for is true now; also if it was true before, or if its condition asks for no act",
    "- fail, invalid: What the chore asks for is not true now, "
    "because it was not or cannot be done; both words count alike",
    "- unsafe: What the chore asks for is not true now, because of a safety concern",
    "- on, off, open, closed: Observed state, only for a chore that asks which of two states something is in",
    "- unknown: No claim about the chore",
    "The status is about the list as a whole: success only if what every chore asks for is true.",
)
_CLAIMS: dict[str, ChoreClaim] = {claim: claim for claim in get_args(ChoreClaim)}
_NUMBER = re.compile(r"[1-9][0-9]{0,2}")


def with_claims(report: Report, given: dict[str, Any]) -> Report:
    """Return `report` with its claims, which are read from `given`, the arguments in the reply. Raises ReplyFault."""
    if ARGUMENT not in given:
        raise ReplyFault("malformed_action", "missing_argument", ARGUMENT)
    claims = given[ARGUMENT]
    if not is_object(claims):
        raise ReplyFault("malformed_action", "ill_typed", f"{ARGUMENT}: {type(claims).__name__}")
    found: dict[int, ChoreClaim] = {}
    raw: dict[int, str] = {}
    for key, value in claims.items():
        if not _NUMBER.fullmatch(key.strip()):
            raise ReplyFault("malformed_action", "not_a_chore", f"{ARGUMENT}: {ascii(key)[:80]}")
        number = int(key)
        if number in found:
            raise ReplyFault("malformed_action", "duplicate_chore", f"{ARGUMENT}: {number}")
        if not isinstance(value, str):
            raise ReplyFault("malformed_action", "ill_typed", f"{ARGUMENT}.{number}: {type(value).__name__}")
        claim = _CLAIMS.get(value.strip().casefold())
        found[number] = claim or "invalid"
        if claim is None:
            raw[number] = value
    return report.model_copy(update={"claims": dict(sorted(found.items())), "raw_claims": dict(sorted(raw.items()))})
