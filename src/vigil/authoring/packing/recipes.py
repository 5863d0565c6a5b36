"""Recipes: the houses, seed and options from which a pack is made, and the SHA-256 that the pack must have.

A recipe does not contain houses of third-party datasets. It identifies each house by its position in the dataset and
its hash, so that everyone who has the dataset can make a pack with the same bytes. Packaged recipes are in
`vigil/data/recipes`.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from importlib.metadata import version
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.drafts import DRAFTS_VERSION, MAX_LINES, UNVERSIONED_DRAFTS, HouseOrigin
from vigil.authoring.drafting.procthor import DATASET
from vigil.authoring.drafting.sources import HouseInFile, dataset_houses, read_all
from vigil.authoring.language.sentences import Forms
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.packing.suites import SuiteName, TaskKind
from vigil.base.files import read_file
from vigil.base.json_files import read_json
from vigil.base.versions import PackVersions, schema_validator
from vigil.errors import HouseError, PackMismatch, SettingError, did_you_mean, first_error
from vigil.packs.files import NAME_PATTERN
from vigil.packs.pack import asset_mismatch
from vigil.protocol.families import Family
from vigil.scoring.levels import Level

RECIPE_SCHEMA = 2
PACKAGED = Path(str(files("vigil") / "data" / "recipes"))
LIBRARIES = ("vigil-bench", "mujoco", "numpy", "scipy", "shapely")
"""Libraries whose version may change floats and therefore the bytes of a pack."""
MAX_STARTS = 1000


class Recipe(BaseModel):
    """The settings from which a pack in third-party houses is made, with references to these houses.

    `PackRequest` describes the fields that both have.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_version: Annotated[int, schema_validator(RECIPE_SCHEMA)] = RECIPE_SCHEMA
    name: str = Field(pattern=NAME_PATTERN)
    houses_from: str = ""
    """Text that says where the dataset can be downloaded."""
    seed: int = Field(ge=0, lt=2**256)
    families: tuple[Family, ...]
    per_family: int = Field(ge=1, le=MAX_LINES)
    max_per_house: int = Field(ge=1, le=MAX_LINES)
    backend: str
    asset_database_sha256: str | None = None
    versions: PackVersions
    made_with: dict[str, str]
    """Versions of Python and libraries with which the pack was made."""
    pack_sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    drafted_in: int | None = Field(default=None, ge=1)
    one_family_per_house: bool = False
    levels: tuple[Level, ...] = ()
    is_robust: bool = False
    starts: int = Field(default=1, ge=1, le=MAX_STARTS)
    forms: Forms = "public"
    templates: tuple[str, ...] = Field(default=(), exclude_if=lambda names: not names)
    """Written if not empty."""
    drafts: int = Field(default=UNVERSIONED_DRAFTS, ge=1)
    """Version of the drafts and their wording."""
    suite: SuiteName | None = None
    """Suite of the pack; `tasks` then replaces families and levels. None for a pack of families."""
    tasks: dict[TaskKind, int] = Field(default_factory=dict)
    houses: tuple[HouseOrigin, ...] = Field(min_length=1, max_length=MAX_LINES)

    @property
    def request(self) -> PackRequest:
        """The request for the pack that the recipe describes."""
        return PackRequest(**{name: getattr(self, name) for name in _SHARED})

    def notes(self) -> list[str]:
        """Return texts about installed versions that differ from the recipe's, so that the bytes may differ, too."""
        here = made_with()
        changed = [
            f"{name} {was} (here {here.get(name)})" for name, was in self.made_with.items() if here.get(name) != was
        ]
        versions = self.versions.note(f"Recipe {self.name!r}")
        return [
            *([versions] if versions else []),
            *([f"The recipe was made with {', '.join(changed)}: the bytes may differ."] if changed else []),
        ]

    def save(self, path: Path) -> None:
        """Write the recipe to a file, with one line for each house."""
        rows = [house.model_dump_json(exclude={"line"}, exclude_none=True) for house in self.houses]
        head = self.model_dump_json(indent=1, exclude={"houses"})
        path.write_text(head.removesuffix("\n}") + ',\n "houses": [\n  ' + ",\n  ".join(rows) + "\n ]\n}\n", "utf-8")

    @classmethod
    def load(cls, place: str) -> "Recipe":
        """Return the recipe in the file `place`, or the packaged recipe with the name `place`.

        Raises SettingError if the recipe does not exist or is invalid.
        """
        packaged = {path.stem: path for path in sorted(PACKAGED.glob("*.json"))}
        path = packaged.get(place, Path(place))
        if not path.exists():
            names = ", ".join(packaged)
            raise SettingError(
                f"Recipe {place!r} does not exist.{did_you_mean(place, packaged)} Packaged recipes: {names}."
            )
        try:
            return cls.model_validate(read_json(read_file(path, f"Recipe {str(path)!r}", SettingError)))
        except ValidationError as error:
            raise SettingError(f"Recipe {str(path)!r}: {first_error(error)}.") from None
        except ValueError as error:
            raise SettingError(f"Recipe {str(path)!r} is not JSON: {error}.") from None


_SHARED = Recipe.model_fields.keys() & {each.name for each in fields(PackRequest)}
"""Names of the settings that a request and a recipe share."""


def recipe_of(request: PackRequest, origins: Iterable[HouseOrigin], pack_sha256: str) -> Recipe:
    """Return the recipe of a pack that was not reviewed and whose houses are all third-party."""
    return Recipe(
        **{name: getattr(request, name) for name in _SHARED},
        versions=PackVersions.current(),
        made_with=made_with(),
        pack_sha256=pack_sha256,
        drafts=DRAFTS_VERSION,
        suite=request.suite,
        houses=tuple(origins),
    )


def made_with() -> dict[str, str]:
    """Return the installed versions of Python and of libraries that may change floats."""
    return {"python": ".".join(map(str, sys.version_info[:2])), **{name: version(name) for name in LIBRARIES}}


def check_drafts(recipe: Recipe) -> None:
    """Raise SettingError if the recipe has another version of drafts, with which the bytes would differ."""
    if recipe.drafts != DRAFTS_VERSION:
        raise SettingError(
            f"Recipe {recipe.name!r} was made with version {recipe.drafts} of the drafts and their wording; this "
            f"package has version {DRAFTS_VERSION}, which makes other episodes. Install the package that wrote the "
            "recipe, or make a new pack of the same houses with vigil pack make."
        )


def check_assets(recipe: Recipe, given: AssetDatabase) -> None:
    """Raise SettingError unless `given` is the recipe's asset database, on which the sizes of things depend."""
    fault = asset_mismatch(f"Recipe {recipe.name!r}", recipe.asset_database_sha256, given.sha256)
    if fault is not None:
        raise SettingError(fault)


def sources_of(recipe: Recipe, given: Sequence[str], report: Callable[[str], None]) -> list[HouseInFile]:
    """Return the sources of the recipe's houses. ProcTHOR's houses are downloaded; others are in the files `given`.

    `report` gets a line that announces a download. Raises SettingError if a file is missing.
    """
    found: list[HouseInFile] = []
    for (dataset, split, revision), group in groupby(
        recipe.houses, lambda each: (each.dataset, each.split, each.revision)
    ):
        rows = list(group)
        if dataset == DATASET:
            found += dataset_houses(split or "", [row.index or 0 for row in rows], report, revision or "")
            continue
        path = _file(dataset, given, sum(row.dataset != DATASET for row in recipe.houses) == len(rows))
        found += [HouseInFile(path, None if row.index is None else row.index + 1, row.name, dataset) for row in rows]
    return found


def _file(dataset: str, given: Sequence[str], is_only_one: bool) -> Path:
    """Return the file in `given` that has the name of a dataset.

    If `is_only_one`, the recipe has one dataset only, and a single file is returned whatever its name. Raises
    SettingError if there is no such file.
    """
    same = [place for place in given if Path(place).name == dataset]
    if not same and is_only_one and len(given) == 1:
        same = list(given)
    if not same or not Path(same[0]).is_file():
        raise SettingError(f"The recipe needs the houses in file {dataset!r}: give this file with --houses.")
    return Path(same[0])


OnHouse = Callable[[int], None]
"""Function that is called with the number of houses read so far."""


def origins_of(sources: Iterable[HouseInFile], on_house: OnHouse = lambda number: None) -> list[HouseOrigin]:
    """Return the origin of each house, with its hash. Raises HouseError at the first invalid house."""
    found: list[HouseOrigin] = []
    for source, house in read_all(sources):
        if isinstance(house, HouseError):
            raise house
        found.append(source.origin(house))
        on_house(len(found))
    return found


def check_houses(recipe: Recipe, sources: Iterable[HouseInFile], on_house: OnHouse = lambda number: None) -> None:
    """Raise PackMismatch if a house is missing or differs from the recipe's. The message names the first such house."""
    wanted = {row.name: row.sha256 for row in recipe.houses}
    for number, (source, house) in enumerate(read_all(sources), start=1):
        place = f"House {number} of {len(wanted)} in recipe {recipe.name!r} ({source.name!r})"
        if isinstance(house, HouseError):
            raise PackMismatch(f"{place} is missing: {house}")
        if house.sha256 != wanted[source.name]:
            raise PackMismatch(
                f"{place} has SHA-256 {house.sha256}, but the recipe says {wanted[source.name]}. The file is another "
                "version of the dataset; use the version that the recipe names."
            )
        on_house(number)
