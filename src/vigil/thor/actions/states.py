"""Actions that set the flags of objects: sliced, cooked, dirty, filled, used up and broken. Shapes stay as they are."""

from functools import partial
from typing import Any

from vigil.protocol.world import ObjectSetup
from vigil.scene.things import Thing
from vigil.thor.actions.action import Action
from vigil.thor.actions.handling import AT, WHICH, target_of
from vigil.thor.base.errors import ActionFailed, bad_argument
from vigil.thor.base.properties import PROPERTIES
from vigil.thor.base.world import World

LIQUIDS = ("water", "coffee", "wine")


def _set_flag(flag: str, value: bool, world: World, fillLiquid: str | None = None, **asked: Any) -> None:
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


def need_property(thing: Thing, flag: str) -> None:
    """Raise ActionFailed when a flag can never be set for a thing, e.g. when a table is to be cooked."""
    ability, categories = PROPERTIES[flag]
    if thing.category not in categories:
        raise ActionFailed(f"{thing.id} is not {ability}, so {flag} cannot change")


def _set_states(world: World, SetObjectStates: dict[str, Any]) -> None:
    asked, change = SetObjectStates, SetObjectStates.get("stateChange")
    wanted = [each for each in world.things() if asked.get("objectType") in (None, "", each.category)]
    flags = {ability: flag for flag, (ability, _) in PROPERTIES.items()}
    if change == "openable":
        setup = ObjectSetup(openness=float(bool(asked.get("isOpen"))))
        world.apply_changes({each.id: setup for each in wanted if each.is_openable})
    elif change == "toggleable":
        setup = ObjectSetup(is_toggled=bool(asked.get("isToggled")))
        world.apply_changes({each.id: setup for each in wanted if each.is_toggleable})
    elif change in flags:
        flag = flags[change]
        new = {flag: bool(asked.get(flag))}
        liquid = {"fillLiquid": "water" if new[flag] else None} if flag == "isFilledWithLiquid" else {}
        for each in wanted:
            if each.category in PROPERTIES[flag][1]:
                world.flags.setdefault(each.id, {}).update({**new, **liquid})
    else:
        raise bad_argument(f"stateChange {change!r} is not one of openable, toggleable, {', '.join(flags)}")


def _breakable(world: World, objectId: str) -> None:
    need_property(world.thing(objectId), "isBroken")
    world.unbreakable.discard(objectId)


_ONLY_FLAG = "only the flag in metadata changes, not the shape; running machines do not change it"
_ALL_AT_ONCE = "every object of the type changes at once, and no object is blocked; flags change only in metadata"
_FILL, _FILLED = f"{AT}, string fillLiquid", "objectId fillLiquid | x y fillLiquid"
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
        Action(name, partial(_set_flag, flag, value), AT, WHICH, lacks=_ONLY_FLAG)
        for name, (flag, value) in _FLAG_ACTIONS.items()
    ),
    Action("FillObjectWithLiquid", partial(_set_flag, "isFilledWithLiquid", True), _FILL, _FILLED, lacks=_ONLY_FLAG),
    Action("SetObjectStates", _set_states, "object SetObjectStates", "SetObjectStates", lacks=_ALL_AT_ONCE),
    Action("MakeObjectBreakable", _breakable, "string objectId", "objectId"),
)
