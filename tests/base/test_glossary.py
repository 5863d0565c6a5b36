"""The glossary has every term that is scored, once."""

from typing import get_args

import pytest

from tests.support.published_runs import PUBLISHED
from vigil.base.glossary import RESULTS, SECTIONS, TERMS, term_of
from vigil.scoring.outcomes import Label, OutcomeCategory, Subtype
from vigil.scoring.rates import CONDITIONAL, RATES

ALL = [term for terms in SECTIONS.values() for term in terms]


def test_a_term_is_explained_once_and_has_an_address_of_its_own() -> None:
    assert len({term.name for term in ALL}) == len({term.anchor for term in ALL}) == len(ALL) == len(TERMS)
    names = [name for terms in RESULTS.values() for term in terms for name in (term.name, *term.aliases)]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", [*get_args(Label), *get_args(Subtype), "W", "W_strict", "Stop", "NoRep"])
def test_what_is_scored_has_a_term(name: str) -> None:
    assert name in TERMS


def test_categories_and_rates_have_terms() -> None:
    categories = {term.name.replace(" ", "_").replace("-", "_") for term in RESULTS["The four categories"]}
    assert categories == set(get_args(OutcomeCategory))
    assert all(term_of("Δ (pp)" if name == "Delta" else f"{name} %") for name in RATES)
    assert {"P_B_W1", "P_FR_W0", "P_rep_W0", "P_norep_W1"} < set(CONDITIONAL)
    assert all(name in TERMS["family"].text for name in PUBLISHED)


@pytest.mark.parametrize(
    ("heading", "name"),
    [
        ("W %", "W"),
        ("Δ (pp) [95\u00a0%]", "Δ"),
        ("P(FR | W=0) % [95\u00a0%]", "P(FR | W=0)"),
        ("Lag (steps) [95\u00a0%]", "closure lag"),
        ("Houses", None),
    ],
)
def test_a_heading_leads_to_its_term(heading: str, name: str | None) -> None:
    found = term_of(heading)
    assert (found and found.name) == name


def test_a_text_is_made_of_sentences() -> None:
    assert TERMS["NR"].text == "No report: the step budget ran out."
    assert all(term.text.endswith(".") and ".." not in term.text for term in ALL)
    assert TERMS["Δ"].anchor == "delta"
    assert TERMS["P(B | W=1)"].anchor == "p-b-w-1"
