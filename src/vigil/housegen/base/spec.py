"""House specs: the rooms, area and ceiling of a house to generate, and the table of named specs."""

from collections import Counter
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from vigil.assets.catalog import ROOMS
from vigil.errors import SettingError, did_you_mean
from vigil.housegen.base.tables import TABLES

RoomKind = Literal["Kitchen", "LivingRoom", "Bedroom", "Bathroom"]

MAX_ROOMS = 10
"""Greatest number of rooms in a house."""

AREA_M2: dict[str, tuple[float, float, float]] = TABLES["room_area"]
"""Smallest, median and largest area (m2) of a room, by its kind."""

SINGLE_ROOM_SCALE: dict[str, float] = {"Kitchen": 1.75, "LivingRoom": 1.3, "Bedroom": 1.5, "Bathroom": 1.25}
"""Factor on the area of a room that is the only room of its house (as in ProcTHOR)."""


class HouseSpec(BaseModel):
    """Specification of a house to generate. The seed decides which of `choices` is used."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    choices: tuple[tuple[RoomKind, ...], ...] = Field(min_length=1)
    """Lists of kinds of rooms; a house has the rooms of one list."""
    area_m2: float | None = Field(default=None, gt=0.0)
    """Total floor area (m2). If None, the area of each room is drawn at random for its kind."""
    ceiling_m: tuple[float, float] = (2.5, 3.0)
    """Least and greatest height (m) of the ceiling."""
    clutter: float = Field(default=1.0, ge=0.0, le=2.0)
    """Factor by which the number of small objects is multiplied."""

    @field_validator("choices", mode="before")
    @classmethod
    def _check_kinds(cls, choices: Any, info: ValidationInfo) -> Any:
        named = [kind for rooms in choices for kind in rooms] if isinstance(choices, tuple | list) else []
        for kind in named:
            if kind not in AREA_M2:
                raise SettingError(
                    f"House spec {info.data.get('name')!r}: kind of room {kind!r} does not exist."
                    f"{did_you_mean(str(kind), AREA_M2)} Choose from {', '.join(AREA_M2)}."
                )
        return choices

    @model_validator(mode="after")
    def _check_sizes(self) -> "HouseSpec":
        for rooms in self.choices:
            if not 1 <= len(rooms) <= MAX_ROOMS:
                raise SettingError(f"House spec {self.name!r}: {len(rooms)} rooms; a house has 1 to {MAX_ROOMS}.")
            least = sum(AREA_M2[kind][0] for kind in rooms)
            most = sum(AREA_M2[kind][2] for kind in rooms) * (SINGLE_ROOM_SCALE[rooms[0]] if len(rooms) == 1 else 1.0)
            if self.area_m2 is not None and not least <= self.area_m2 <= most:
                counts = ", ".join(f"{number} {kind}" for kind, number in Counter(rooms).items())
                raise SettingError(
                    f"House spec {self.name!r}: {counts} do not fit in {self.area_m2:g} m2; they need {least:g} to "
                    f"{most:g} m2. Change area_m2 or the rooms."
                )
        low, high = self.ceiling_m
        if not 2.3 <= low <= high <= 5.0:
            raise SettingError(
                f"House spec {self.name!r}: ceiling_m is {self.ceiling_m}; give two heights from 2.3 to 5.0 m, the "
                "lower one first."
            )
        return self


SPECS: dict[str, HouseSpec] = {
    name: HouseSpec.model_validate(
        {"name": name, "choices": [[ROOMS[letter] for letter in one] for one in text.split()]}
    )
    for name, text in TABLES["specs"].items()
}


def spec_for(name: str) -> HouseSpec:
    """Return the spec called `name`; "4" means "4-room". Raises SettingError."""
    wanted = f"{name}-room" if name.isdigit() else name
    if wanted not in SPECS:
        raise SettingError(
            f"House spec {name!r} is not known.{did_you_mean(name, SPECS)} Known: {', '.join(SPECS)}; "
            f"or 1 to {MAX_ROOMS} rooms."
        )
    return SPECS[wanted]
