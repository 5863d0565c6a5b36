"""From houses to a frozen pack: what `vigil pack build`, `make` and `remake` share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vigil.authoring.drafting.drafts import DraftsFile, HouseOrigin
from vigil.authoring.drafting.generation import generate_drafts
from vigil.authoring.drafting.sources import Source
from vigil.authoring.packing.assemble import PackRequest, assemble, candidates
from vigil.authoring.packing.candidate_checks import checker, house_finder
from vigil.authoring.packing.levels import measured_levels
from vigil.authoring.packing.recipes import Recipe, recipe_of
from vigil.authoring.packing.verify import VerificationSettings, bundles
from vigil.authoring.review.reviews import Review
from vigil.cli.making.closure import build_suite, draft_suite, suite_request
from vigil.cli.making.drafting import drafting_of, drafts_summary, shown_on
from vigil.cli.progress import progress
from vigil.closure import Kind
from vigil.levels import EpisodeLevel
from vigil.pack import Pack


@dataclass(frozen=True, slots=True)
class Making:
    """How a pack is made of houses: what is drafted in them, and what is chosen of it."""

    request: PackRequest
    verification: VerificationSettings
    reviews: Sequence[Review] = ()
    is_spread: bool = False
    """Whether each house is asked for one family alone, in turn."""
    starts: int = 1
    """Starts drawn for each draft, of which the hardest is kept."""
    tasks: Mapping[Kind, int] | None = None
    """Tasks of each kind of a suite; None for a pack of the families."""

    def pack(self, out: Path, sources: Sequence[Source]) -> Pack:
        """Proposes in all houses, or goes on, with the drafts beside `out`, and freezes the pack into it."""
        file = self._drafted(out, sources)
        drafts_summary(file)
        if self.tasks is None:
            return freeze_drafts(out, [file], self.reviews, self.request, self.verification)
        return build_suite(out, [file], suite_request(self.request, self.tasks), self.reviews, self.verification)

    def _drafted(self, out: Path, sources: Sequence[Source]) -> DraftsFile:
        with progress("houses") as show:
            if self.tasks is not None:
                return draft_suite(out, sources, self.request, self.verification, shown_on(show))
            file, settings = drafting_of(out, self.request, self.verification)
            settings = replace(settings, is_spread=self.is_spread, starts=self.starts)
            workers = self.verification.workers
            generate_drafts(file, sources, settings, workers=workers, on_progress=shown_on(show))
            return file

    def recipe(self, origins: Sequence[HouseOrigin], pack: Pack, drafted_in: int | None) -> Recipe:
        """Returns by what others make the same pack of the same houses; `drafted_in` are those drawn of them."""
        return recipe_of(
            self.request,
            origins,
            pack.sha256,
            backend=self.verification.backend,
            drafted_in=drafted_in,
            is_spread=self.is_spread,
            starts=self.starts,
            tasks=self.tasks,
        )


def freeze_drafts(
    out: Path,
    files: Sequence[DraftsFile],
    reviews: Sequence[Review],
    pack_request: PackRequest,
    verification: VerificationSettings,
    *,
    kept: DraftsFile | None = None,
) -> Pack:
    """Freezes a pack of the families out of drafts, and says what it holds."""
    levels = _levels(files, reviews, pack_request, verification, kept)
    with progress("checks") as show:
        check = checker(files, verification, lambda now: show(now.done, now.of, f"{now.faulty} left out"))
        pack, bad = assemble(out, files, reviews, pack_request, check, kept=kept, levels=levels)
    for findings in bad.values():
        print(f"left out: {findings[0]}")
    print(f"{out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
    print(f"reviewed: {pack.manifest.meta['reviews']}")
    return pack


def _levels(
    files: Sequence[DraftsFile],
    reviews: Sequence[Review],
    pack_request: PackRequest,
    verification: VerificationSettings,
    kept: DraftsFile | None,
) -> dict[str, EpisodeLevel] | None:
    """Returns the level of every draft that may enter; None where the pack does not ask for levels."""
    if not pack_request.levels:
        return None
    pool = [each for each in candidates(files, reviews, kept) if each.episode.family in pack_request.families]
    solved = {candidate.episode.id: candidate.draft.actions for candidate in pool}
    work = bundles([candidate.episode for candidate in pool], solved, house_finder(files))
    with progress("levels") as show:
        return {found.episode_id: found for found in measured_levels(work, verification, show)}
