"""Messages of `vigil pack propose` and `make` about drafts, and the location of a pack's drafts."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

from vigil.authoring.drafting.drafts import DraftsFile
from vigil.authoring.drafting.generation import GenerationProgress, GenerationSettings
from vigil.authoring.language.sentences import Forms
from vigil.authoring.packing.assemble import PackRequest
from vigil.authoring.packing.verify import VerificationSettings
from vigil.packs.private import is_secret
from vigil.protocol.families import FAMILIES

FormsName = Literal["public", "held-out", "all"]
FormsOption = Annotated[
    FormsName | None,
    typer.Option(
        "--forms",
        help="Sentence forms in which instructions are written: public (those of published packs), "
        "held-out (those that published packs do not use), or all.",
        show_default="all for `vigil pack make` with a secret seed, otherwise public",
    ),
]


def forms_named(name: FormsName) -> Forms:
    """Return the half of the sentence forms that an option names."""
    return "held_out" if name == "held-out" else name


def progress_callback(show: Callable[[int, int, str], None]) -> Callable[[GenerationProgress], None]:
    """Return a callback that shows the progress of draft generation."""
    return lambda now: show(now.houses, now.of, f"{now.kept} drafts  {now.rejected} rejected")


def drafts_summary(file: DraftsFile) -> None:
    """Print what a drafts file holds, and the number rejected by each rule."""
    proposed = file.read()
    for family in FAMILIES:
        done = [row for row in proposed.done if row.family == family]
        if done:
            kept, seconds = sum(row.kept for row in done), sum(row.seconds for row in done)
            reasons = ", ".join(f"{rule} {count}" for rule, count in proposed.reasons.get(family, {}).items())
            rate = f"{60 * kept / seconds:.0f} a minute" if seconds else "-"
            print(f"{family}: {kept} drafts in {len(done)} houses ({rate}); rejected: {reasons or 'none'}")
    count = len(proposed.drafts) + len(proposed.closures)
    print(f"{file.path}: {count} drafts, {len(proposed.rejections)} rejected")


def drafting_for_pack(
    out: Path, pack_request: PackRequest, verification: VerificationSettings
) -> tuple[DraftsFile, GenerationSettings]:
    """Return the drafts file next to a pack, and the settings to generate it."""
    out.parent.mkdir(parents=True, exist_ok=True)
    settings = GenerationSettings(
        pack_request.families,
        pack_request.seed,
        pack_request.max_per_house,
        backend=verification.backend,
        assets=verification.assets,
        forms=pack_request.forms,
        is_seed_secret=pack_request.is_seed_secret and is_secret(pack_request.seed),
    )
    return DraftsFile(out.with_name(f"{out.name}.drafts.jsonl")), settings
