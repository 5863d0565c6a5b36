"""Checking whether a run is a valid entry: its replies are played again, and its figures are computed again."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd
from pydantic import BaseModel, ConfigDict, Field

from vigil.errors import PackMismatch, RecordError, SimulatorError, shorten
from vigil.packs.pack import PACKAGED, Pack, manifest_sha256, packaged_names
from vigil.packs.private import is_private, redact_ids
from vigil.protocol.prompt import policy_sha256
from vigil.records.costs import Tokens
from vigil.records.record import RunHeader, read_header
from vigil.runner.settings import VerifySettings
from vigil.runner.verify_run import OnProgress, Verification, simulation_of, verify_runs
from vigil.scoring.saved_run import SavedRun, read_run
from vigil.web.leaderboard.bundle import Entry
from vigil.web.leaderboard.measures import RANKED_BY, Figures, Measures, changed_figures, measures_of, own_signs
from vigil.web.leaderboard.metadata import Division, EntryMetadata, Tier, division_of, reasons_against
from vigil.web.leaderboard.settings import CheckSettings

MAX_LISTED = 3
"""Maximum number of differences that a refusal lists."""
MAX_FAULT_CHARS = 500
ID_DIGITS = 12


class CheckedEntry(BaseModel):
    """An entry that passed the check."""

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    metadata: EntryMetadata
    header: RunHeader
    suite: str | None
    is_private: bool
    """Whether the pack is private. The site does not show plays of a private pack."""
    checked: str
    """A sentence for readers that says what was checked."""
    tokens: Tokens
    figures: Figures
    tables: tuple[str, ...]
    regimes: tuple[str, ...]
    signs: tuple[str, ...]
    plays: pd.DataFrame = Field(exclude=True, repr=False)
    """The plays (see `Measures`), which the cache stores in a separate file."""
    bundle_sha256: str = ""
    tier: Tier = "re_simulated"
    """Tier in which the entry is ranked: the tier that the check proves, or the tier that the maintainers chose."""

    @property
    def id(self) -> str:
        """Id of the entry: the first digits of the run's hash."""
        return self.header.sha256[:ID_DIGITS]

    @property
    def division(self) -> Division:
        """Division in which the entry is ranked."""
        return division_of(self.header, self.metadata)

    @property
    def profile(self) -> str:
        """Name of the profile, followed by the prompt variant and the reply policy if they are not the default."""
        profile = self.header.spec.profile
        differs = {
            profile.prompt_variant: profile.prompt_variant != "default" and not profile.has_custom_prompt,
            profile.reply_policy: profile.reply_policy != "strict",
        }
        return ", ".join([profile.name, *(name for name, is_so in differs.items() if is_so)])

    @property
    def ranked_by(self) -> str:
        """Name of the figure by which the entry is ranked."""
        return RANKED_BY[self.suite]

    @property
    def cost(self) -> float | None:
        """Cost of the run's replies, from the prices in its header; None without prices."""
        return None if self.header.prices is None else self.header.prices.cost(self.tokens)

    @property
    def thinking(self) -> Literal["on", "off", "unknown"]:
        """Whether the model thought, according to its answers or, if they do not show it, the settings."""
        said = [each.thinking for each in (self.header.answered, *(s.answered for s in self.header.resumed)) if each]
        return "on" if "on" in said or self.header.has_reasoning else "off" if "off" in said else "unknown"


def known_packs(folders: tuple[Path, ...] = ()) -> dict[str, Path]:
    """Return {SHA-256: folder} of the packs that come with VIGIL and of those in `folders`. Raises PackMismatch."""
    return {manifest_sha256(folder): folder for folder in (*(PACKAGED / name for name in packaged_names()), *folders)}


@dataclass(frozen=True, slots=True)
class CandidateRun:
    """A run that may become an entry: every episode is scored, and the metadata agree with the run's header."""

    run: SavedRun
    metadata: EntryMetadata
    pack: Pack

    @classmethod
    def read(cls, folder: Path, metadata: EntryMetadata, packs: Mapping[str, Path]) -> "CandidateRun":
        """Return the run in a folder. `packs` are the known packs.

        Raises RecordError that says why the run is not a valid entry, or PackMismatch if its pack is not known.
        """
        header = read_header(folder)
        _refuse_if(
            [f"{each}." for each in reasons_against(header, metadata)],
            "the run and its metadata do not make a valid entry",
        )
        if policy_sha256(header.spec.profile) != header.spec.prompt_policy_sha256:
            raise RecordError(
                f"the run's prompt {header.spec.prompt_policy!r} has a different text in this version of VIGIL, so the "
                "run cannot be checked"
            )
        pack = _pack_of(header, packs)
        with _hiding_ids(pack):
            run = read_run(folder, pack.folder)
            _refuse_if(_missing_plays(run, pack), "the run is not complete")
        return cls(run, metadata, pack)

    @property
    def is_replayed(self) -> bool:
        """Whether the run is played again."""
        return self.metadata.tier != "self_reported"

    @property
    def checked_with(self) -> tuple[object, ...]:
        """Facts that must be equal for candidates to be checked together."""
        return self.is_replayed, *simulation_of(self.run)

    def conclude(self, found: Verification | Exception) -> tuple[CheckedEntry, Measures]:
        """Return the run as an entry with its measures, after its verification. Raises RecordError that says why the
        run is not a valid entry, or SimulatorError if it could not be played again."""
        header, metadata = self.run.header, self.metadata
        with _hiding_ids(self.pack):
            if isinstance(found, Exception):
                raise found
            if lost := [each for each in found.differences if each.fact == "simulator"]:
                raise SimulatorError(f"The run could not be played again: {lost[0]}.")
            _refuse_if([f"{each}." for each in found.differences], "playing the run again gave other results")
            measures = measures_of(self.run, self.pack)
        entry = CheckedEntry(
            metadata=metadata,
            header=header,
            suite=self.pack.manifest.suite,
            is_private=is_private(self.pack.manifest.meta),
            checked=_sentence(found, self.is_replayed),
            tokens=self.run.table.tokens.total,
            figures=measures.figures,
            tables=measures.tables,
            regimes=measures.regimes,
            signs=tuple(own_signs(header, metadata, measures.plays, measures.timing_faults)),
            plays=measures.plays,
            tier="re_simulated" if self.is_replayed else "self_reported",
        )
        return entry, measures


def verify_candidates(
    candidates: Sequence[CandidateRun], settings: CheckSettings, on_progress: OnProgress = lambda _done, _total: None
) -> list[Verification | Exception]:
    """Return the verifications of candidates with equal `checked_with`, or the errors that ended them."""
    is_replayed = candidates[0].is_replayed
    verify = VerifySettings(
        frames=settings.frames and is_replayed,
        records_only=not is_replayed,
        workers=settings.workers,
        asset_database=settings.asset_database,
    )
    return verify_runs([each.run for each in candidates], verify, on_progress=on_progress)


def _pack_of(header: RunHeader, packs: Mapping[str, Path]) -> Pack:
    place = packs.get(header.spec.pack_sha256)
    if place is None:
        raise PackMismatch(
            f"the run's pack {header.spec.pack!r} with SHA-256 {header.spec.pack_sha256[:ID_DIGITS]}... is not known "
            "here: give its folder with --pack"
        )
    pack = Pack.load(place, header.spec.pack_sha256)
    if pack.name != header.spec.pack:
        raise RecordError(
            f"the run's header calls its pack {header.spec.pack!r}, but the pack with the same hash is {pack.name!r}"
        )
    return pack


@contextmanager
def _hiding_ids(pack: Pack) -> Generator[None, None, None]:
    """Remove the ids of a private pack's episodes from the messages of RecordErrors in the `with` block."""
    try:
        yield
    except RecordError as fault:
        if not is_private(pack.manifest.meta):
            raise
        said = redact_ids([str(fault)], [episode.id for episode in pack.episodes])
        raise RecordError(said[0]) from None


def check_claims(claimed: Entry, measures: Measures) -> None:
    """Raise RecordError if figures or frames in a bundle's entry differ from those that its records give."""
    _refuse_if(
        [f"{each}." for each in changed_figures(claimed.figures, measures.figures)],
        "the figures that the bundle claims do not follow from its records",
    )
    if claimed.frames != measures.frames:
        raise RecordError("the hash of frames that the bundle states is not the one that follows from its records")


def _missing_plays(run: SavedRun, pack: Pack) -> list[str]:
    table, spec = run.table, run.header.spec
    scored = sum(row.outcome is not None for row in table.rows.values())
    wanted = len(pack.episodes) * spec.epochs
    found = [note for note in table.notes if table.left_out or table.partial_line_number is not None]
    if scored != wanted or len(spec.episode_ids) != len(pack.episodes):
        found.append(f"{scored} of {wanted} plays are scored; an entry has every episode of its pack.")
    return found


def _refuse_if(faults: list[str], what: str) -> None:
    faults = [shorten(fault, MAX_FAULT_CHARS) for fault in faults]
    if faults:
        more = f" And {len(faults) - MAX_LISTED} more." if len(faults) > MAX_LISTED else ""
        raise RecordError(f"{what}: {' '.join(faults[:MAX_LISTED])}{more}")


def _sentence(found: Verification, is_replayed: bool) -> str:
    if not is_replayed:
        return f"{found.checked} records are consistent; they were not played again."
    how = "to the last bit" if found.is_exact else "within 1 mm and 0.01 degrees, with the same verdicts"
    frames = f" {found.frames} frames were drawn again and are equal." if found.frames else ""
    return f"{found.checked} plays were played again and are equal {how}.{frames}"
