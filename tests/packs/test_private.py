"""Secret seeds: which are accepted, what their names and hashes reveal, and what private packs may give away."""

from pathlib import Path

import pytest

from vigil.errors import SettingError
from vigil.packs.private import (
    MIN_SECRET_SEED,
    check_revealed,
    chosen_seed,
    is_private,
    redact_ids,
    secret_name,
    secret_subseed,
    seed_sha256,
)

SEED = MIN_SECRET_SEED + 7


def test_a_seed_is_read_from_a_file_of_one_number(tmp_path: Path) -> None:
    file = tmp_path / "seed"
    file.write_text(f" {SEED}\n")
    assert chosen_seed(None, file) == SEED
    assert (chosen_seed(3, None), chosen_seed(None, None)) == (3, None)
    with pytest.raises(SettingError, match="exclude each other"):
        chosen_seed(3, file)


@pytest.mark.parametrize("text", ["", "7", str(MIN_SECRET_SEED - 1), f"{SEED} {SEED}", f"-{SEED}", "1" * 2000, "é"])
def test_a_seed_that_can_be_guessed_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "seed"
    file.write_text(text)
    with pytest.raises(SettingError, match="Write one: "):
        chosen_seed(None, file)


def test_a_missing_seed_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"'.*/absent' cannot be read"):
        chosen_seed(None, tmp_path / "absent")


def test_names_and_seeds_of_parts_depend_on_the_seed_and_on_every_word() -> None:
    words = [(SEED, "house", b"1"), (SEED + 1, "house", b"1"), (SEED, "episode", b"1"), (SEED, "house", b"2")]
    assert len({secret_name(*each).partition("_")[2] for each in words}) == 4
    assert len({secret_subseed(*each) for each in words}) == 4
    assert min(secret_subseed(*each) for each in words) >= MIN_SECRET_SEED
    assert secret_name(*words[0]) == secret_name(*words[0])


def test_the_hash_of_seeds_does_not_depend_on_their_order() -> None:
    assert seed_sha256("pack", SEED, SEED + 1) == seed_sha256("pack", SEED + 1, SEED)
    assert seed_sha256("pack", SEED) != seed_sha256("other", SEED)
    assert is_private({"seed_sha256": seed_sha256("pack", SEED)})
    assert not is_private({"seed": 7})


def test_ids_are_redacted_the_longest_first() -> None:
    assert redact_ids(["a_1 and a_12 differ"], ["a_1", "a_12"]) == ["(an episode) and (an episode) differ"]
    assert redact_ids(["nothing"], []) == ["nothing"]


def test_a_private_pack_is_revealed_only_on_request() -> None:
    check_revealed("pack", private=False, what="A frame", reveals=False)
    check_revealed("pack", private=True, what="A frame", reveals=True)
    with pytest.raises(SettingError, match=r"'pack' is private.*A frame would reveal it.*--reveal-private-pack"):
        check_revealed("pack", private=True, what="A frame", reveals=False)
