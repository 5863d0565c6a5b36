"""Disclosure: the choice of hidden facts that an export includes, because the user requested them."""

from dataclasses import dataclass
from typing import Annotated

from vigil.base.settings import Setting
from vigil.packs.private import REVEAL_HELP

AnswerKey = Annotated[
    bool,
    Setting(
        "Include the answer key: targets, correct labels, and the step at which each goal first held. "
        "For the formats hf and every-eval-ever."
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Disclosure:
    """Which hidden facts to include in an export; none by default."""

    answer_key: AnswerKey = False
    reveal_private_pack: Annotated[bool, Setting(REVEAL_HELP)] = False


NO_DISCLOSURE = Disclosure()
