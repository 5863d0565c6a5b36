"""What `vigil pack propose`, `build` and `make` do with `--suite closure`."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from vigil.authoring.closure.generation import AUTHOR, FAMILY
from vigil.authoring.closure.packing import ClosureRequest, freeze_closure
from vigil.authoring.drafting.drafts import DraftsFile
from vigil.authoring.drafting.generation import GenerationSettings
from vigil.errors import SettingError
from vigil.pack import Pack

Suite = Annotated[
    Literal["closure"] | None,
    typer.Option("--suite", help="A suite's pack; --per-family is then tasks (single, or twins) of each kind."),
]
SMALL_HOUSES = ("2", "kitchen", "2", "bedroom", "2", "living-room")
"""What `--rooms mixed` stands for in the suite, where reaching is to be easy."""


def suite_settings(settings: GenerationSettings) -> GenerationSettings:
    """Returns settings as the suite's drafts are generated with them."""
    return replace(settings, families=(FAMILY,), author=AUTHOR)


def refuse_with_suite(**given: object) -> None:
    """Raises SettingError on options that a suite does not have, by name."""
    for name, value in given.items():
        if value:
            raise SettingError(f"--suite and --{name} exclude each other: a suite has kinds of its own. Leave one out.")


def build_suite(out: Path, files: Sequence[DraftsFile], request: ClosureRequest) -> Pack:
    """Freezes a pack of the suite and says what it holds."""
    pack = freeze_closure(out, files, request)
    print(f"{out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
    print(", ".join(f"{name}: {count}" for name, count in pack.manifest.meta["kinds"].items()))
    return pack
