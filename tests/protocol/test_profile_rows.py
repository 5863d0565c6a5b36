"""The table of profiles: each has an identity and a prompt of its own, and the paper's two are as they were."""

import pytest

from vigil.protocol.actions import STATUSES
from vigil.protocol.claims import CLAIM_LINE, CLAIM_TABLE
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE, Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES, STOP_LINE, ProfileRow
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
    stop = [] if row.has_report else ["- navigate | look | interact_pixel | stop", "stop:", STOP_LINE]
    assert added == [*(new for _, new in row.replaced), *stop, *claims, *expected]
    of_reports = 0 if row.has_report else 5 + len(STATUSES)  # the list of skills, a report's lines, its statuses
    assert len(dropped) == len(row.replaced) + of_reports + bool(row.first_rule)


def test_nothing_in_the_prompt_without_reports_speaks_of_a_report() -> None:
    for variant in ("default", "neutral_report"):
        text = policy_text(Profile(name=PROFILE_NAMES["stop_only"], prompt_variant=variant))
        assert "report" not in text.casefold()
        assert all(f"- {status}:" not in text for status in STATUSES)
