"""From drafts to a pack: propose in as many houses as are needed, measure levels, check and freeze."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from vigil.authoring.closure.generation import FAMILY
from vigil.authoring.drafting.drafts import DraftsFile, house_in
from vigil.authoring.drafting.generation import FAMILY_GRAMMAR, GenerationProgress, GenerationSettings, generate_drafts
from vigil.authoring.drafting.sources import HouseSource
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.episode_measures import measured_levels
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.selection import Missing, TooFewDrafts, candidates
from vigil.authoring.packing.suites import SUITES
from vigil.authoring.packing.verify import VerificationSettings, VerificationTask, candidate_checker, house_batches
from vigil.authoring.review.reviews import Review
from vigil.cli.progress import ShowProgress, progress
from vigil.packs.pack import Pack
from vigil.packs.private import is_secret
from vigil.protocol.families import FAMILIES
from vigil.scoring.levels import EpisodeLevel

MIN_STEP, STEP_SHARE = 4, 4
"""Houses that are added at a time while a pack lacks episodes: 1 / STEP_SHARE of the number of houses used first, but
at least MIN_STEP."""


class PackFreezer:
    """Freezes one pack. It can be called again with more drafts, and measures the level of each episode only once."""

    def __init__(
        self, out: Path, request: PackRequest, reviews: Sequence[Review], checks: VerificationSettings
    ) -> None:
        self._out = out
        self._request = request
        self._reviews = reviews
        self._checks = checks
        self._levels: dict[str, EpisodeLevel] = {}

    def freeze(self, files: Sequence[DraftsFile], previous: DraftsFile | None = None) -> Pack:
        """Freeze the pack from the drafts in `files`, print what it contains, and return it. Raises TooFewDrafts.

        Drafts in `previous`, which is from an earlier version of the pack, are chosen first.
        """
        levels = self._measured_levels(files, previous) if self._request.levels else None
        with progress("checks") as show:
            check = candidate_checker(
                files, self._checks, lambda done, of, faulty: show(done, of, f"{faulty} left out")
            )
            pack, bad = assemble(
                self._out, files, self._reviews, self._request, check, previous=previous, levels=levels
            )
        for findings in bad.values():
            print(f"left out: {findings[0]}")
        print(f"{self._out}: {len(pack.episodes)} episodes in {pack.manifest.houses} houses, sha256 {pack.sha256}")
        if self._request.suite:
            print(", ".join(f"{name}: {count}" for name, count in pack.manifest.meta["kinds"].items()))
        print(f"reviewed: {pack.manifest.meta['reviews']}")
        return pack

    def _measured_levels(self, files: Sequence[DraftsFile], previous: DraftsFile | None) -> Mapping[str, EpisodeLevel]:
        """Return the level of every candidate episode by id. Each is measured only once."""
        pool = [each.task for each in candidates(files, self._reviews, previous)]
        request = self._request
        pool = [task for task in pool if task.group in request.quotas]
        pool = [task for task in pool if request.admits(task.drafts[0].episode.family, task.kind)]
        fresh = [VerificationTask.of_draft(task) for task in pool if task.drafts[0].episode.id not in self._levels]
        with progress("levels") as show:
            work = house_batches(fresh, lambda episode: house_in(files, episode.house.name))
            self._levels |= {found.episode_id: found for found in measured_levels(work, self._checks, show)}
        return self._levels


def make_pack(
    out: Path,
    sources: Sequence[HouseSource],
    request: PackRequest,
    reviews: Sequence[Review],
    checks: VerificationSettings,
) -> Pack:
    """Propose drafts until they are enough for the request, and freeze the pack. Continues an interrupted call.

    Drafts are made in the first `request.drafted_in` houses. While some families lack drafts, more houses are added for
    these families, a quarter of that number at a time. The pack thus depends on the order of the houses and on the
    request; houses that were not needed do not change it. Raises TooFewDrafts when all houses are used and something is
    missing.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    file = DraftsFile(out.with_name(f"{out.name}.drafts.jsonl"))
    freezer = PackFreezer(out, request, reviews, checks)
    first = request.drafted_in or len(sources)
    begin, end = 0, first
    families, missing = request.families, ()
    while True:
        settings = drafting_settings(request, families, checks)
        with progress("houses") as show:
            report = progress_callback(show, request.quotas, missing)
            generate_drafts(file, sources[begin:end], settings, workers=checks.workers, on_progress=report)
        if begin == 0:
            print_drafts(file)
        try:
            return freezer.freeze([file])
        except TooFewDrafts as error:
            missing = error.missing
        if end >= len(sources):
            raise TooFewDrafts(_spent_message(file, len(sources), request, missing), missing)
        families = tuple(family for family in request.families if any(family == each.group for each in missing))
        begin, end = end, min(end + max(MIN_STEP, first // STEP_SHARE), len(sources))
        print(f"missing after house {begin} of at most {len(sources)}: {_listed(missing)}")


def drafting_settings(
    request: PackRequest, families: tuple[str, ...], checks: VerificationSettings
) -> GenerationSettings:
    """Return the settings for making drafts of some families, or of a suite, for a pack."""
    return GenerationSettings(
        (FAMILY,) if request.suite else families,
        request.seed,
        request.max_per_house,
        backend=checks.backend,
        assets=checks.assets,
        one_family_per_house=request.one_family_per_house,
        starts=request.starts,
        forms=request.forms,
        is_seed_secret=request.is_seed_secret and is_secret(request.seed),
        grammar=SUITES[request.suite].grammar if request.suite else FAMILY_GRAMMAR,
        templates=request.templates,
    )


def progress_callback(
    show: ShowProgress, quotas: Mapping[str, int] | None = None, missing: Sequence[Missing] = ()
) -> Callable[[GenerationProgress], None]:
    """Return a callback that shows the progress of draft generation, and what a pack still lacks.

    `missing` is what the last selection lacked. If it is empty, families and kinds with fewer drafts than their quota
    are shown.
    """

    def report(now: GenerationProgress) -> None:
        short = {group: quota - now.kept.get(group, 0) for group, quota in (quotas or {}).items()}
        lacking = _listed(missing) or ", ".join(f"{group} {count}" for group, count in short.items() if count > 0)
        facts = [f"{sum(now.kept.values())} drafts", f"{now.rejected} rejected"]
        show(now.houses, now.of, "  ".join([*facts, *([f"missing: {lacking}"] if lacking else [])]))

    return report


def print_drafts(file: DraftsFile) -> None:
    """Print the number of drafts in a file, and the number of proposals that each rule rejected."""
    proposed = file.read()
    for family in FAMILIES:
        done = [row for row in proposed.done if row.family == family]
        if done:
            kept, seconds = sum(row.kept for row in done), sum(row.seconds for row in done)
            reasons = ", ".join(f"{rule} {count}" for rule, count in proposed.reasons.get(family, {}).items())
            rate = f"{60 * kept / seconds:.0f} a minute" if seconds else "-"
            print(f"{family}: {kept} drafts in {len(done)} houses ({rate}); rejected: {reasons or 'none'}")
    print(f"{file.path}: {len(proposed.tasks)} drafts, {len(proposed.rejections)} rejected")


def _listed(missing: Sequence[Missing]) -> str:
    return ", ".join(map(str, missing))


def _spent_message(file: DraftsFile, houses: int, request: PackRequest, missing: Sequence[Missing]) -> str:
    """Return the message for when all houses are used: what is missing, and how to continue."""
    go_on = "give more --houses" if request.drafted_in is None else "give the same command with a larger --max-houses"
    return (
        f"Pack {request.name!r} is not complete: drafts were made in all {houses} houses that it may use, but there "
        f"are only {_listed(missing)}. The drafts are saved in {str(file.path)!r}. To go on, {go_on}; or freeze a "
        "smaller pack from these drafts with `vigil pack build --drafts`."
    )
