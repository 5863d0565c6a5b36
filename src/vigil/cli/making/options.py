"""Options of `vigil pack propose`, `build` and `make`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from vigil.authoring.drafting.amounts import PER_HOUSE, TRIED
from vigil.authoring.drafting.procthor import FORM
from vigil.authoring.packing.requests import MAX_PER_HOUSE, PER_FAMILY, PackRequest
from vigil.authoring.packing.suites import KINDS_IN_WORDS, SUITES, SuiteName
from vigil.base.settings import Setting
from vigil.cli.arguments import Robust, SeedFile
from vigil.errors import SettingError, check_known
from vigil.packs.private import chosen_seed
from vigil.protocol.families import FAMILIES, parse_kinds
from vigil.runner.shared_settings import ApiKeyEnv, AssetFile, Backend, BaseUrl, Families, Workers
from vigil.scoring.levels import LEVELS, Level, parse_levels

if TYPE_CHECKING:
    from vigil.authoring.language.sentences import Forms
    from vigil.authoring.packing.verify import VerificationSettings
    from vigil.authoring.review.reviews import Review

HOUSES_PER_EPISODE, MIN_HOUSES = 1.12, 12
"""The number of houses used first is HOUSES_PER_EPISODE times the episodes of a family, but at least MIN_HOUSES."""
BUDGET = 10
"""Default maximum number of houses, as a multiple of the number of houses used first."""
HousePlaces = Annotated[
    tuple[str, ...],
    Setting(
        "Houses in which the episodes take place: a file (.json, .jsonl, .jsonl.gz), or houses of "
        f"ProcTHOR-10K as {FORM}; may be repeated.",
        name="houses",
    ),
]
OutFolder = Annotated[
    Path, Setting("Folder for the pack: new or empty. The drafts are saved in files next to this folder.")
]


@dataclass(frozen=True, kw_only=True)
class Common:
    """Options of every verb that makes drafts or packs, such as families, seed and simulator."""

    families: Families = ()
    suite: Annotated[
        SuiteName | None,
        Setting(
            "Make episodes of this suite instead of the usual families. If a pack is made, --per-family then sets "
            "the number of tasks of each kind; two twin episodes count as one task."
        ),
    ] = None
    templates: Annotated[
        tuple[str, ...],
        Setting(
            "Draft only this template, which is one kind of task of a family, e.g. put_into (SM) or obstacle (CR); may "
            "be repeated. If several families have a template of this name, each is limited to it. Families for which "
            "no template is named use all of their templates.",
            name="template",
            unset="all",
            read=parse_kinds,
            repeats=True,
        ),
    ] = ()
    seed: Annotated[
        int | None,
        Setting(
            "Random seed with which houses and drafts are made and episodes are chosen. For a private pack, keep the "
            "seed secret: anyone who has it can make the same pack.",
            minimum=0,
        ),
    ] = None
    seed_file: SeedFile = None
    workers: Workers = None
    backend: Backend = "mujoco"
    assets: AssetFile = None

    @property
    def chosen_seed(self) -> int | None:
        """The seed that was given, as a number or in a file; None if no seed was given. Raises SettingError."""
        return chosen_seed(self.seed, self.seed_file)

    def check_suite(self, **given: object) -> None:
        """Raise SettingError if an option is given that a suite does not have; the message names the option."""
        for name, value in {"family": self.families, "template": self.templates, **given}.items():
            if self.suite and value:
                option = name.replace("_", "-")
                raise SettingError(
                    f"--suite and --{option} exclude each other: a suite does not have that option. Leave one out."
                )


@dataclass(frozen=True, kw_only=True)
class Content(Common):
    """Options that say what a pack contains."""

    name: Annotated[str, Setting("Name of the new pack.")]
    per_family: Annotated[int, Setting("Number of episodes of each family in the new pack.", minimum=1)] = PER_FAMILY
    kinds: Annotated[
        tuple[str, ...],
        Setting(
            "Kind of task to include, for a pack of a suite; KIND:N asks for N tasks of this kind; may be repeated. "
            f"Kinds of each suite: {KINDS_IN_WORDS}.",
            name="kind",
            unset="all",
        ),
    ] = ()
    max_per_house: Annotated[
        int, Setting("Maximum number of episodes of one family that take place in the same house.", minimum=1)
    ] = MAX_PER_HOUSE
    levels: Annotated[
        tuple[Level, ...],
        Setting(
            f"Difficulty level of the episodes to choose: {', '.join(LEVELS)}, or all for these four; may be repeated. "
            "Each named level gets an equal share of the episodes. If unset, levels are not considered.",
            name="level",
            unset="any",
            read=parse_levels,
            repeats=True,
        ),
    ] = ()
    robust: Robust = False
    review_files: Annotated[
        tuple[Path, ...],
        Setting(
            "File with reviewers' verdicts on the drafts, written by `vigil review`; may be repeated.",
            name="review",
            other_name="reviews",
        ),
    ] = ()

    @property
    def reviews(self) -> "list[Review]":
        """The reviews in all files. Raises SettingError if a file is missing, RecordError if a line is invalid."""
        from vigil.authoring.review.reviews import read_reviews

        for path in self.review_files:
            if not path.is_file():
                raise SettingError(f"Review file {str(path)!r} does not exist.")
        return [review for path in self.review_files for review in read_reviews(path)]

    @property
    def verification(self) -> "VerificationSettings":
        """Settings for verifying candidates. Raises SettingError if the asset database is invalid."""
        from vigil.assets.database import AssetDatabase
        from vigil.authoring.packing.verify import VerificationSettings
        from vigil.runner.workers.pool import worker_count

        database = AssetDatabase.from_file(self.assets)
        return VerificationSettings(self.backend, database, worker_count(self.workers), self.robust)

    def request(self, **more: Any) -> PackRequest:
        """Return the request for the pack; `more` are fields of it that are not options. Raises SettingError."""
        from vigil.assets.database import AssetDatabase

        return PackRequest(
            self.name,
            self.per_family,
            self.chosen_seed or 0,
            self.max_per_house,
            families=self.families or tuple(FAMILIES),
            tasks=self.tasks(),
            backend=self.backend,
            asset_database_sha256=AssetDatabase.from_file(self.assets).sha256,
            levels=self.levels,
            is_robust=self.robust,
            templates=self.templates,
            **more,
        )

    def tasks(self) -> dict[str, int]:
        """Return the number of tasks by kind, in the table's order; empty without a suite. Raises SettingError.

        The option value `KIND` asks for `per_family` tasks of this kind; `KIND:TASKS` asks for TASKS tasks. If no kind
        is named, all kinds are made.
        """
        if self.suite is None:
            if self.kinds:
                raise SettingError("--kind is for a suite's pack: give --suite closure too, or --family instead.")
            return {}
        known = SUITES[self.suite].kinds
        found: dict[str, int] = {}
        for name in self.kinds:
            kind, colon, count = name.partition(":")
            check_known("Kind", kind, known, "Kinds:")
            if colon and (not count.isdecimal() or int(count) < 1):
                raise SettingError(
                    f"--kind {name}: {count!r} is not a number of tasks. Write --kind {kind}:20, for instance."
                )
            found[kind] = int(count) if colon else self.per_family
        return {kind: found.get(kind, self.per_family) for kind in known if kind in found or not found}


@dataclass(frozen=True, kw_only=True)
class Drafting:
    """Options that determine how drafts are made: in which houses, from which starts, and in which sentence forms."""

    rooms: Annotated[
        str,
        Setting(
            "Numbers of rooms, or names of house specs (e.g. kitchen), separated by commas; one house after the other "
            "is generated with the next of them."
        ),
    ] = "mixed"
    hardest_of: Annotated[
        int,
        Setting(
            "Number of start positions that are tried for each draft; the start that makes the episode hardest is "
            "used.",
            minimum=1,
        ),
    ] = 1
    form_names: Annotated[
        Literal["public", "held-out", "all"] | None,
        Setting(
            "Sentence forms in which instructions are written: public (the forms that published packs use), "
            "held-out (forms that published packs never use), or all.",
            name="forms",
            unset="all for `vigil pack make` with a secret seed, otherwise public",
        ),
    ] = None

    def forms(self, default: "Forms") -> "Forms":
        """Return the sentence forms that the user chose (public, held-out or all), or else `default`."""
        return "held_out" if self.form_names == "held-out" else self.form_names or default

    def specs(self, suite: SuiteName | None) -> list[str]:
        """Return the specs of the houses to generate: numbers of rooms, or names such as `kitchen`."""
        if suite is not None and self.rooms == "mixed":
            return list(SUITES[suite].houses)
        return [name.strip() for name in self.rooms.split(",")]


@dataclass(frozen=True, kw_only=True)
class Proposing:
    """Options that say who proposes drafts, in which houses, and how many."""

    houses: HousePlaces = ()
    seeds: Annotated[
        str | None,
        Setting(
            "Seeds of the houses to generate, as FIRST:END (END itself is not used). Give either this or --houses."
        ),
    ] = None
    limit: Annotated[
        int | None, Setting("Use only the first N houses of each value of --houses; all if unset.", minimum=1)
    ] = None
    grammar: Annotated[
        bool, Setting("Propose episodes with the built-in grammar. This is the default; the alternative is --model.")
    ] = False
    model: Annotated[
        str | None, Setting("Model that proposes the episodes instead of the grammar, as provider/model.")
    ] = None
    base_url: BaseUrl = None
    api_key_env: ApiKeyEnv = None
    per_house: Annotated[
        int, Setting("Maximum number of valid drafts that are kept for each family in a house.", minimum=1)
    ] = PER_HOUSE
    tries: Annotated[int, Setting("Maximum number of drafts that are tried for each family in a house.", minimum=1)] = (
        TRIED
    )


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """Options that say in which houses a pack is made, and how many of them are used."""

    houses: HousePlaces = ()
    count: Annotated[
        int | None,
        Setting(
            "Number of houses in which drafts are made at the start; more follow if the pack still lacks episodes "
            "(--max-houses). If unset: all of --houses, or a number of generated houses that fits --per-family.",
            minimum=1,
        ),
    ] = None
    max_houses: Annotated[
        int | None,
        Setting(
            "Maximum number of houses to use. While the pack lacks episodes, more houses are added, up to this number.",
            minimum=1,
            unset=f"{BUDGET} times the number of houses at the start",
        ),
    ] = None
    one_family_per_house: Annotated[bool, Setting("Use each house for only one family; the families take turns.")] = (
        False
    )

    def first(self, per_family: int) -> int | None:
        """Return the number of houses in which drafts are made first; None if all of --houses are used at once."""
        if self.count is not None or self.houses:
            return self.count
        return max(MIN_HOUSES, round(HOUSES_PER_EPISODE * per_family))

    def most(self, per_family: int) -> int | None:
        """Return the number of houses that may be used; None if all of --houses may be used. Raises SettingError."""
        first = self.first(per_family)
        if first is None:
            if self.max_houses is not None:
                raise SettingError("--max-houses needs --count: without --count, all of --houses are used.")
            return None
        if self.max_houses is not None and self.max_houses < first:
            raise SettingError(
                f"--max-houses is {self.max_houses}, but --count makes the first drafts in {first} houses. "
                "Raise --max-houses, or lower --count."
            )
        return self.max_houses or BUDGET * first


@dataclass(frozen=True, kw_only=True)
class Building:
    """Options that say from which drafts a pack is built, and what its manifest says."""

    drafts: Annotated[
        tuple[Path, ...],
        Setting(
            "File with drafts from which the episodes are chosen, written by `vigil pack propose`; may be repeated."
        ),
    ] = ()
    earlier_drafts: Annotated[
        Path | None,
        Setting(
            "File with drafts of an earlier version of the pack; these drafts are chosen before those of --drafts."
        ),
    ] = None
    version: Annotated[str, Setting("Version of the pack, which is written into its manifest.")] = "1"
    aliases: Annotated[
        tuple[str, ...], Setting("Additional name of the pack (an alias); may be repeated.", name="alias")
    ] = ()
    description: Annotated[str, Setting("One sentence that describes the pack, for its manifest and its card.")] = ""
