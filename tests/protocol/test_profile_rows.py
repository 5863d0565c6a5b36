"""The table of profiles: each has an identity and a prompt of its own, and the paper's two are as they were."""

import pytest

from vigil.protocol.claims import CLAIM_LINE, CLAIM_TABLE
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE, Profile
from vigil.protocol.profiles.rows import PROFILES, ProfileRow
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


@pytest.mark.parametrize("row", ROWS)
def test_the_prompt_differs_from_the_baselines_only_in_rules_and_claims(row: ProfileRow) -> None:
    ours, base = (policy_text(profile).splitlines() for profile in (Profile(name=row.name), BASE))
    added = [line for line in ours if line not in base]
    dropped = [line for line in base if line not in ours]
    expected = [f"- {rule}" for rule in (*([row.first_rule] if row.first_rule else []), *row.rules)]
    claims = [CLAIM_LINE, *CLAIM_TABLE] if row.has_claims else []
    assert added == [*claims, *expected]
    assert len(dropped) == bool(row.first_rule)
