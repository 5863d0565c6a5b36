"""Other instructions for the same episode. They differ from the original only in the sentence form."""

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np

from vigil.authoring.chores import sentences as chores
from vigil.authoring.closure.asking import PUT_ON
from vigil.authoring.closure.kinds.all_of.tasks import EVERY, EVERYTHING
from vigil.authoring.closure.kinds.already.tasks import MAKE_SURE_ALL
from vigil.authoring.closure.kinds.silent_refusal.tasks import PUT_IN
from vigil.authoring.families.cr.drafts import CONSTRAINTS
from vigil.authoring.families.da.drafts import APPROACH
from vigil.authoring.families.pg.drafts import POINT
from vigil.authoring.families.sm.drafts import CHAINS, SEQUENCES
from vigil.authoring.families.sv.drafts import BURNING_OR_NOT, QUESTIONS
from vigil.authoring.families.vs.drafts import SEARCH
from vigil.authoring.language.rewording import rewordings
from vigil.authoring.language.sentences import ORDERS, SEARCH_ORDERS, Sentences
from vigil.base.numbered_list import read_list, write_list
from vigil.packs.pack import CHORES_SUITE
from vigil.protocol.families import Family
from vigil.scoring.closure import SUITE

TRIED_FORMS = 4
"""Number of other sentences of a chore that are tried."""


def _apart(table: Sentences) -> tuple[Sentences, ...]:
    """Return two tables: the forms in which a second place may directly follow the target's place, and all other forms.

    Which of the two an instruction has depends on its target: "the cup on the desk on the shelf" is misread.
    """
    stacked = ("{target} on", "{target} into", "{target} inside")
    is_stacked = {form: any(words in form for words in stacked) for form in table.of("all")}
    return tuple(
        table.with_halves(lambda half, side=side: [form for form in half if is_stacked[form] is side])
        for side in (True, False)
    )


FAMILY_FORMS: dict[Family, tuple[Sentences, ...]] = {
    "PG": (POINT,),
    "DA": (APPROACH,),
    "VS": (SEARCH,),
    "SV": (*QUESTIONS.values(), BURNING_OR_NOT),
    "AI": (ORDERS,),
    "SI": (SEARCH_ORDERS,),
    "SM": (*SEQUENCES.values(), *CHAINS.values()),
    "CR": (*CONSTRAINTS.values(), ORDERS),
}
"""Family -> tables of sentence forms; the forms of one table mean the same."""
CHORE_FORMS = (
    *_apart(chores.PUT_ON_ORDERS),
    *_apart(chores.PUT_INTO_ORDERS),
    *_apart(chores.PUT_AWAY),
    *(chores.ACT_ORDERS, chores.MAKE_SURE, chores.QUESTIONS, chores.IF_SO, chores.IF_AT_FIRST),
    chores.CLOSE_EVERY_DRAWER,
)
_PLAIN = (EVERY, *EVERYTHING.values(), *MAKE_SURE_ALL.values())
CLOSURE_FORMS = (
    *(SEARCH_ORDERS, ORDERS, chores.MAKE_SURE, chores.IF_SO),
    *_apart(chores.PUT_AWAY),
    *(apart for forms in (PUT_ON, PUT_IN) for apart in _apart(Sentences(forms, ()))),
    *(Sentences(forms, ()) for forms in _PLAIN),
)
"""Tables of the closure-stress suite. Some do not have a held-out half."""


def other_instructions(text: str, family: Family, suite: str | None, rng: np.random.Generator) -> Iterator[str]:
    """Yield the instruction in other sentence forms, held-out forms first. In a list, every line changes."""
    if suite == CHORES_SUITE:
        yield from _other_lists(text, rng)
    else:
        yield from rewordings(text, CLOSURE_FORMS if suite == SUITE else FAMILY_FORMS[family], rng)


def _other_lists(text: str, rng: np.random.Generator) -> Iterator[str]:
    opening, lines = text.split("\n")[0], read_list(text)
    tables: list[tuple[str, Sequence[Sentences]]] = [(opening, (chores.OPENINGS,))]
    tables += [(line, CHORE_FORMS) for line in lines]
    found = [list(islice(rewordings(said, forms, rng), TRIED_FORMS)) for said, forms in tables]
    if all(found):
        for index in range(max(map(len, found))):
            first, *rest = (each[index % len(each)] for each in found)
            yield write_list(first, rest)
