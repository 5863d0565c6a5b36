"""Private packs: secret seeds, names that do not reveal the seeds, and the check whether a pack is private.

A pack is private if its manifest has only the hash of its seed (`seed_sha256`). All code that writes output meant to
leave the machine calls `is_private` or `check_revealed`. Source: decision 46.
"""

import hashlib
import hmac
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from vigil.errors import SettingError

MIN_SECRET_SEED = 2**64
"""Smallest secret seed. A smaller seed can be found by trying all of them."""
SEED_SHA256 = "seed_sha256"
"""Key in a manifest's `meta` under which the hash of a secret seed stands; only private packs have the key."""
REVEAL = "--reveal-private-pack"
REVEAL_HELP = "Allow output that shows instructions, ids, replies or frames of a private pack (refused by default)."
NEW_SEED = "python3 -c 'import secrets; print(secrets.randbits(128))'"
NAME_DIGITS = 20
"""Number of hex digits of the keyed hash (80 bits) in the name of a private episode or house."""
MAX_SEED_BYTES = 1024
_SEED = re.compile(r"[0-9]{1,300}")


def is_private(meta: Mapping[str, Any]) -> bool:
    """Return whether the pack whose manifest has this `meta` is private: its seed and content must stay secret."""
    return SEED_SHA256 in meta


def check_revealed(pack: str, private: bool, what: str, *, reveals: bool, by: str = REVEAL) -> None:
    """Raise SettingError if the output `what` would show a private pack without the user's permission.

    `reveals` is True if the user gave the permission with the option `by`.
    """
    if private and not reveals:
        raise SettingError(
            f"Pack {pack!r} is private: it was made from a secret seed. {what} would reveal it to all readers; "
            "only hashes and rates may be shared, as `vigil score`, `vigil report` and `vigil export --format "
            f"every-eval-ever` write them. If the pack may be revealed, give {by}."
        )


def redact_ids(remarks: Iterable[str], ids: Iterable[str]) -> list[str]:
    """Return `remarks` with each of the episode `ids` replaced by a placeholder."""
    any_id = re.compile("|".join(map(re.escape, sorted(ids, key=len, reverse=True))) or r"(?!)")
    return [any_id.sub("(an episode)", remark) for remark in remarks]


def is_secret(seed: int) -> bool:
    """Return whether a seed is so long that it cannot be found by trying all seeds."""
    return seed >= MIN_SECRET_SEED


def seed_sha256(name: str, *seeds: int) -> str:
    """Return the SHA-256 of the text "NAME SEED", or "NAME SEED SEED ..." for several seeds.

    The hash commits the author to the secret seed. When the seed is published, anyone can check that it is the same
    seed.
    """
    return hashlib.sha256(" ".join([name, *map(str, sorted(seeds))]).encode()).hexdigest()


def secret_name(seed: int, kind: str, what: bytes) -> str:
    """Return a name such as `house_1f0c...` for the house or episode (`kind`) that `what` identifies.

    Without the seed, the name reveals nothing.
    """
    return f"{kind}_{_keyed(seed, kind, what).hex()[:NAME_DIGITS]}"


def secret_subseed(seed: int, kind: str, what: bytes) -> int:
    """Return a 128-bit seed for the part of a pack that `kind` and `what` identify, derived from the secret seed.

    The new seed does not reveal any other seed.
    """
    return MIN_SECRET_SEED + int.from_bytes(_keyed(seed, f"seed of {kind}", what)[:16], "big")


def read_seed(path: Path) -> int:
    """Return the secret seed in a file that contains one whole number. Raises SettingError."""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_SEED_BYTES + 1).decode("ascii").strip()
    except (OSError, ValueError) as error:
        raise SettingError(
            f"Seed file {str(path)!r} cannot be read ({error}). Write one: {NEW_SEED} > {path}"
        ) from None
    if not _SEED.fullmatch(text) or not is_secret(int(text)):
        raise SettingError(
            f"Seed file {str(path)!r} does not hold a seed that can be kept secret: expected one whole "
            f"number of 2^64 or more, and nothing else. Write one: {NEW_SEED} > {path}"
        )
    return int(text)


def chosen_seed(seed: int | None, file: Path | None) -> int | None:
    """Return the seed that the user gave, as a number or in a file; None if neither is given.

    Raises SettingError if both are given.
    """
    if seed is not None and file is not None:
        raise SettingError("--seed and --seed-file exclude each other. Leave one out.")
    return seed if file is None else read_seed(file)


def _keyed(seed: int, kind: str, what: bytes) -> bytes:
    return hmac.digest(str(seed).encode(), kind.encode() + b"\n" + what, "sha256")
