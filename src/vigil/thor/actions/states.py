"""Actions that set the flags of objects: sliced, cooked, dirty, filled, used up and broken. Shapes stay as they are."""

from collections.abc import Callable
from typing import Any

from vigil.scene.things import Thing
from vigil.thor.actions.action import Action
from vigil.thor.actions.handling import AT, WHICH, target_of
from vigil.thor.base.errors import ActionFailed
from vigil.thor.base.properties import PROPERTIES
from vigil.thor.base.world import World

LIQUIDS = ("water", "coffee", "wine")


def _setter(flag: str, *, value: bool = True) -> Callable[..., None]:
    def change(world: World, fillLiquid: str | None = None, **asked: Any) -> None:
        thing, _, _ = target_of(world, **asked)
        if flag == "isFilledWithLiquid" and value and fillLiquid not in LIQUIDS:
            raise ActionFailed(f"fillLiquid {fillLiquid!r} is not one of {', '.join(LIQUIDS)}")
        need_property(thing, flag)
        if flag == "isBroken" and thing.id in world.unbreakable:
            raise ActionFailed(f"{thing.id} is unbreakable: call MakeObjectBreakable first")
        flags = world.flags.setdefault(thing.id, {})
        if bool(flags.get(flag)) == value:
            raise ActionFailed(f"{thing.id} already has {flag}={value}")
        flags |= {flag: value, **({"fillLiquid": fillLiquid} if flag == "isFilledWithLiquid" else {})}

    return change


def need_property(thing: Thing, flag: str) -> None:
    """Raise ActionFailed when a flag can never be set for a thing, e.g. when a table is to be cooked."""
    ability, categories = PROPERTIES[flag]
    if thing.category not in categories:
        raise ActionFailed(f"{thing.id} is not {ability}, so {flag} cannot change")


def _breakable(world: World, objectId: str) -> None:
    need_property(world.thing(objectId), "isBroken")
    world.unbreakable.discard(objectId)


_ONLY_FLAG = "only the flag in metadata changes, not the shape; running machines do not change it"
_FLAG_ACTIONS = {
    "SliceObject": ("isSliced", True),
    "CookObject": ("isCooked", True),
    "DirtyObject": ("isDirty", True),
    "CleanObject": ("isDirty", False),
    "EmptyLiquidFromObject": ("isFilledWithLiquid", False),
    "UseUpObject": ("isUsedUp", True),
    "BreakObject": ("isBroken", True),
}

ACTIONS = (
    *(
        Action(name, _setter(flag, value=value), AT, WHICH, lacks=_ONLY_FLAG)
        for name, (flag, value) in _FLAG_ACTIONS.items()
    ),
    Action(
        "FillObjectWithLiquid",
        _setter("isFilledWithLiquid"),
        f"{AT}, string fillLiquid",
        "objectId fillLiquid | x y fillLiquid",
        lacks=_ONLY_FLAG,
    ),
    Action("MakeObjectBreakable", _breakable, "string objectId", "objectId"),
)
