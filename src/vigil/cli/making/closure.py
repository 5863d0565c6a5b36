"""`--suite closure` of `vigil pack propose`, `build` and `make`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from vigil.authoring.closure.generation import AUTHOR, FAMILY, closure_worker
from vigil.authoring.closure.packing import ClosureRequest, freeze_closure
from vigil.authoring.closure.verify import recertifier
from vigil.authoring.drafting.drafts import ClosureDraft, DraftsFile
from vigil.authoring.drafting.generation import GenerationProgress, GenerationSettings, generate_drafts
from vigil.authoring.drafting.sources import HouseSource
from vigil.authoring.packing.assemble import PackRequest
from vigil.authoring.packing.candidate_checks import house_finder
from vigil.authoring.packing.verify import VerificationSettings
from vigil.authoring.review.reviews import Review
from vigil.authoring.review.validate import Finding
from vigil.cli.making.drafting import drafting_for_pack
from vigil.errors import SettingError, did_you_mean
from vigil.packs.pack import Pack
from vigil.scoring.closure import KINDS, Kind

Suite = Annotated[
    Literal["closure"] | None,
    typer.Option(
        "--suite",
        help="Make episodes of this suite instead of the usual families. In a pack, --per-family then sets "
        "the number of tasks of each kind; a pair of twins is one task.",
    ),
]
Kinds = Annotated[
    list[str] | None,
    typer.Option(
        "--kind",
        help="Kind of task of the suite to include, or KIND:N for N tasks of the kind; may be repeated. "
        f"Kinds: {', '.join(KINDS)}.",
        show_default="all",
    ),
]
SMALL_HOUSES = ("2", "kitchen", "2", "bedroom", "2", "living-room")
"""Meaning of `--rooms mixed` in the suite, whose houses make reaching easy."""


def suite_settings(settings: GenerationSettings) -> GenerationSettings:
    """Return `settings` adapted to the suite's drafts."""
    return replace(settings, families=(FAMILY,), author=AUTHOR)


def refuse_with_suite(**given: object) -> None:
    """Raise SettingError, naming the option, when an option is given that a suite does not have."""
    for name, value in given.items():
        if value:
            option = name.replace("_", "-")
            raise SettingError(
                f"--suite and --{option} exclude each other: a suite does not have that option. Leave one out."
            )


def refuse_without_suite(kind: Sequence[str] | None) -> None:
    """Raise SettingError when kinds are given without a suite."""
    if kind:
        raise SettingError("--kind is for a suite's pack: give --suite closure too, or --family instead.")


def parse_tasks(names: Sequence[str], per_kind: int) -> dict[Kind, int]:
    """Return the number of tasks by kind, in the table's order.

    `KIND` asks for `per_kind` tasks, `KIND:TASKS` for that number; without names, all kinds. Raises SettingError.
    """
    found: dict[str, int] = {}
    for name in names:
        kind, colon, count = name.partition(":")
        if kind not in KINDS:
            raise SettingError(f"Kind {kind!r} does not exist.{did_you_mean(kind, KINDS)} Kinds: {', '.join(KINDS)}.")
        if colon and (not count.isdecimal() or int(count) < 1):
            raise SettingError(
                f"--kind {name}: {count!r} is not a number of tasks. Write --kind {kind}:20, for instance."
            )
        found[kind] = int(count) if colon else per_kind
    return {kind: found.get(kind, per_kind) for kind in KINDS if kind in found or not names}


def build_suite(
    out: Path,
    files: Sequence[DraftsFile],
    request: ClosureRequest,
    reviews: Sequence[Review],
    verification: VerificationSettings,
) -> Pack:
    """Freeze a pack of the suite and print what it holds; episodes that reviewers reworded are certified again."""

    def check(task: ClosureDraft) -> list[Finding]:
        simulator = verification.simulator()
        try:
            return recertifier(simulator, house_finder(files))(task)
        finally:
            simulator.close()

    pack, bad = freeze_closure(out, files, request, reviews, check)
    for finding in bad:
        print(f"left out: {finding}")
    print(f"{out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
    print(", ".join(f"{name}: {count}" for name, count in pack.manifest.meta["kinds"].items()))
    print(f"reviewed: {pack.manifest.meta['reviews']}")
    return pack


def draft_suite(
    out: Path,
    sources: Sequence[HouseSource],
    pack_request: PackRequest,
    verification: VerificationSettings,
    on_progress: Callable[[GenerationProgress], None],
) -> DraftsFile:
    """Propose the suite's tasks in all houses, or continue, and return the drafts file next to the pack."""
    file, settings = drafting_for_pack(out, pack_request, verification)
    generate_drafts(
        file,
        sources,
        suite_settings(settings),
        workers=verification.workers,
        make_worker=closure_worker,
        on_progress=on_progress,
    )
    return file


def suite_request(pack_request: PackRequest, tasks: Mapping[Kind, int]) -> ClosureRequest:
    """Return the suite's pack request for a general pack request and the number of tasks by kind."""
    return ClosureRequest(
        pack_request.name,
        pack_request.per_family,
        pack_request.seed,
        pack_request.max_per_house,
        tuple(tasks),
        tasks,
        version=pack_request.version,
        description=pack_request.description,
        aliases=pack_request.aliases,
        is_seed_secret=pack_request.is_seed_secret,
        asset_database_sha256=pack_request.asset_database_sha256,
    )
