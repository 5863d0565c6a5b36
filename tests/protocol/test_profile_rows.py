"""The table of profiles: each has an identity and a prompt of its own, and the paper's two are as they were."""

import pytest

from vigil.protocol.actions import INTENTS, STATUSES
from vigil.protocol.claims import CLAIM_LINE, CLAIM_TABLE
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE, Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES, ProfileRow
from vigil.protocol.prompt import policy_sha256, policy_text, policy_version

ROWS = [pytest.param(row, id=row.short) for row in PROFILES.values()]
BASE = Profile()


def test_the_papers_profiles_have_one_prompt_which_no_row_changes() -> None:
    feedback = Profile(name=ACTION_FEEDBACK)
    assert [row.name for row in PROFILES.values() if row.is_papers] == [BASELINE, ACTION_FEEDBACK]
    assert (policy_sha256(feedback), policy_version(feedback)) == (policy_sha256(BASE), policy_version(BASE))
    assert policy_sha256(BASE).startswith("b5b57325078379ca")


@pytest.mark.parametrize("row", ROWS)
def test_a_profile_has_its_own_name_and_its_own_hash(row: ProfileRow) -> None:
    profile = Profile(name=row.name)
    others = [Profile(name=name) for name in PROFILES if name not in (row.name, ACTION_FEEDBACK, BASELINE)]
    assert profile.row is row
    assert policy_sha256(profile) not in {policy_sha256(other) for other in others}
    assert policy_version(profile) not in {policy_version(other) for other in others}


SCHEMA = {"stop_only": 5 + len(STATUSES), "named_objects": 4 + len(INTENTS)}
"""Name of a profile with another action schema -> number of lines of the baseline's that it does not have."""


@pytest.mark.parametrize("row", ROWS)
def test_the_prompt_differs_from_the_baselines_only_in_what_its_row_says(row: ProfileRow) -> None:
    ours, base = (policy_text(profile).splitlines() for profile in (Profile(name=row.name), BASE))
    added = [line for line in ours if line not in base]
    dropped = [line for line in base if line not in ours]
    rules = [*([row.first_rule] if row.first_rule else []), *row.rules]
    claims = [CLAIM_LINE, *CLAIM_TABLE] if row.has_claims else []
    wanted = {*claims, *(f"- {rule}" for rule in rules)}
    said = {new for _, new in row.replaced} | {f"- {new}" for _, new in row.replaced}
    assert len([line for line in added if line in said]) == len(row.replaced)
    assert len(dropped) == len(row.replaced) + SCHEMA.get(row.short, 0) + bool(row.first_rule)
    if row.short not in SCHEMA:
        assert set(added) == wanted
        assert len(added) == len(wanted)


def test_nothing_in_the_prompt_without_reports_speaks_of_a_report() -> None:
    for variant in ("default", "neutral_report"):
        text = policy_text(Profile(name=PROFILE_NAMES["stop_only"], prompt_variant=variant))
        assert "report" not in text.casefold()
        assert all(f"- {status}:" not in text for status in STATUSES)
