"""`vigil challenge`: packs from a secret seed. Until a deadline, only hashes of the seed and the pack are published.

The file of a challenge says how its pack is made, and its hashes bind the author to the seed and the pack's bytes.
After the seed was added to the file, anyone can make the pack again and compare the bytes.
"""

import os
import secrets
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from pydantic import AwareDatetime, Field, TypeAdapter, ValidationError

from vigil.base.files import read_file
from vigil.base.models import FrozenModel
from vigil.base.settings import Setting, check_settings
from vigil.cli.making.options import Content, Drafting, Drawing, OutFolder
from vigil.cli.pack_making import make_from
from vigil.cli.text import print_note
from vigil.errors import SettingError, first_error
from vigil.packs.files import NAME_PATTERN
from vigil.packs.private import MIN_SECRET_SEED, read_seed, seed_sha256
from vigil.runner.shared_settings import Workers

_PRIVATE = {"seed", "seed_file", "workers", "assets", "review_files", "houses"}
"""Options that a challenge's file leaves out: the secret seed, options for one machine, and options that challenges do
not have."""
_SHA256 = r"^[0-9a-f]{64}$"
_Part = TypeVar("_Part", Content, Drawing, Drafting)
ChallengeFile = Annotated[Path, typer.Argument(metavar="CHALLENGE", help="File of the challenge.")]


class Challenge(FrozenModel):
    """The content of a challenge's file: how the pack is made, the hashes of seed and pack, and the deadline."""

    schema_version: int = Field(default=1, ge=1, le=1)
    name: str = Field(pattern=NAME_PATTERN)
    deadline: AwareDatetime
    """Time by which runs must have ended. Until then, the seed is not published."""
    seed_sha256: str = Field(pattern=_SHA256)
    pack_sha256: str = Field(pattern=_SHA256)
    options: dict[str, dict[str, Any]]
    """Options of `vigil pack make` without the seed, in three groups: `content`, `drawing` and `drafting`."""
    drafts: int
    """Version of the code that makes drafts and their wording."""
    made_with: dict[str, str]
    """Versions of Python and of libraries that may change the bytes."""
    seed: int | None = Field(default=None, ge=MIN_SECRET_SEED)
    """The seed; None until it is revealed."""

    @classmethod
    def read(cls, path: Path) -> "Challenge":
        """Return the challenge in a file. Raises SettingError."""
        try:
            return cls.model_validate_json(read_file(path, f"Challenge {str(path)!r}", SettingError))
        except ValidationError as error:
            raise SettingError(f"Challenge {str(path)!r}: {first_error(error)}.") from None

    def write(self, path: Path) -> None:
        """Write the challenge to a file."""
        path.write_text(self.model_dump_json(indent=1, exclude_none=True) + "\n", "utf-8")

    def matches(self, seed: int) -> bool:
        """Return whether `seed` is the seed whose hash the challenge contains."""
        return seed_sha256(self.name, seed) == self.seed_sha256

    def making(self) -> tuple[Content, Drawing, Drafting]:
        """Return the options with which the pack is made again. Raises SettingError if they are invalid."""
        from vigil.protocol.families import Family

        def read(kind: type[_Part]) -> _Part:
            reader = TypeAdapter(kind)
            reader.rebuild(_types_namespace={"Family": Family})  # its module imports this name for type checkers only
            return reader.validate_python(self.options.get(kind.__name__.lower(), {}))

        try:
            content, drawing, drafting = read(Content), read(Drawing), read(Drafting)
        except ValidationError as error:
            raise SettingError(f"The challenge's options are invalid: {first_error(error)}.") from None
        for part in (content, drawing, drafting):
            check_settings(part)
        return replace(content, name=self.name, seed=self.seed), drawing, drafting


def new(
    out: OutFolder,
    content: Content,
    drawing: Drawing,
    drafting: Drafting,
    deadline: Annotated[
        str, Setting("Time at which the seed may be revealed, e.g. 2027-03-01T12:00+00:00.", metavar="TIME")
    ],
) -> None:
    """Example: vigil challenge new --name spring --seed-file seed.txt --deadline 2027-03-01 --out packs/spring

    A seed file that does not exist is made, with a new seed: keep it secret. The pack is made as by `vigil pack make`.
    Publish only the file OUT.challenge.json.
    """
    from vigil.authoring.drafting.drafts import DRAFTS_VERSION
    from vigil.authoring.packing.recipes import made_with

    ends = _time(deadline)
    if content.seed_file is None or content.seed is not None:
        raise SettingError("A challenge needs a secret seed: give --seed-file, and leave out --seed.")
    if drawing.houses or content.review_files or content.assets:
        raise SettingError(
            "Anyone must be able to make a challenge's pack again: leave out --houses, --review and --assets."
        )
    if not content.seed_file.exists():
        _write_seed(content.seed_file)
    pack = make_from(out, content, drawing, drafting)
    parts = {"content": content, "drawing": drawing, "drafting": drafting}
    options = {name: {k: v for k, v in asdict(part).items() if k not in _PRIVATE} for name, part in parts.items()}
    published = Challenge(
        name=content.name,
        deadline=ends,
        seed_sha256=str(pack.manifest.meta["seed_sha256"]),
        pack_sha256=pack.sha256,
        options=options,
        drafts=DRAFTS_VERSION,
        made_with=made_with(),
    )
    file = out.with_name(f"{out.name}.challenge.json")
    published.write(file)
    print(f"{file}: publish this file. Keep {out} and {content.seed_file} secret until {ends.isoformat()}.")


def reveal(
    challenge: ChallengeFile,
    seed_file: Annotated[Path, Setting("File with the secret seed of the challenge.")],
    early: Annotated[bool, Setting("Reveal the seed before the deadline.")] = False,
) -> None:
    """Example: vigil challenge reveal packs/spring.challenge.json --seed-file seed.txt"""
    found, seed = Challenge.read(challenge), read_seed(seed_file)
    if not found.matches(seed):
        raise SettingError(
            f"The seed in {str(seed_file)!r} is not the seed of challenge {found.name!r}: their hashes differ."
        )
    if datetime.now(UTC) < found.deadline and not early:
        raise SettingError(
            f"The deadline, {found.deadline.isoformat()}, has not passed. To reveal it now, give --early."
        )
    found.model_copy(update={"seed": seed}).write(challenge)
    print(f"{challenge}: the seed is in this file now. Publish it; `vigil challenge check` makes the pack again.")


def check(challenge: ChallengeFile, out: OutFolder, workers: Workers = None) -> None:
    """Example: vigil challenge check spring.challenge.json --out packs/spring"""
    from vigil.authoring.drafting.drafts import DRAFTS_VERSION
    from vigil.authoring.packing.recipes import made_with

    found = Challenge.read(challenge)
    if found.seed is None:
        raise SettingError(
            f"Challenge {found.name!r} cannot be checked, because its seed is still secret. It may be revealed from "
            f"{found.deadline.isoformat()} on."
        )
    if not found.matches(found.seed):
        print(f"The seed in {challenge} is not the one that was published as a hash.")
        raise typer.Exit(2)
    if found.drafts != DRAFTS_VERSION:
        raise SettingError(
            f"Challenge {found.name!r} was made with version {found.drafts} of the drafts, but this package has "
            f"version {DRAFTS_VERSION}. Install vigil-bench {found.made_with.get('vigil-bench', '')}."
        )
    here = made_with()
    for name, version in found.made_with.items():
        if here.get(name) != version:
            print_note(f"The challenge was made with {name} {version} (here {here.get(name)}): the bytes may differ.")
    content, drawing, drafting = found.making()
    pack = make_from(out, replace(content, workers=workers), drawing, drafting)
    if pack.sha256 != found.pack_sha256:
        print(f"not the challenge's pack: that has sha256 {found.pack_sha256}")
        raise typer.Exit(2)
    print("the same bytes as the challenge's pack")


def _time(text: str) -> datetime:
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise SettingError(
            f"--deadline {text!r} is not a time. Write e.g. 2027-03-01 or 2027-03-01T12:00+00:00."
        ) from None
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)


def _write_seed(path: Path) -> None:
    """Write a new secret seed to a file that only its owner can read."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(f"{MIN_SECRET_SEED + secrets.randbits(128)}\n")
