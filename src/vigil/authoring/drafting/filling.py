"""Objects in and on others: which objects may be put where, and setups in which a container holds an object."""

from collections.abc import Iterator
from functools import partial

from vigil.assets.catalog import CATALOG
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import is_target
from vigil.authoring.review.containers import BELONGS_IN, belongs_in
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.supports import is_level, surface_frame, surface_named
from vigil.scene.things import Thing

TRIED_CONTENTS = 3
"""Number of objects that are tried as the content of each container."""


def can_hold(receptacle: Thing, thing: Thing) -> bool:
    """Return whether a receptacle can hold a thing, judging by the categories of the two."""
    return CATALOG[receptacle.category].can_hold(CATALOG[thing.category])


def can_be_put(thing: Thing, receptacle: Thing) -> bool:
    """Return whether a task may ask to put a thing at a receptacle: it can be held there and is not there yet."""
    is_free = thing.is_pickupable and is_target(thing) and thing.parent != receptacle.id
    return is_free and can_hold(receptacle, thing)


def filled(context: HouseContext) -> Iterator[tuple[Thing, Thing, Setup]]:
    """Yield (container, object, setup): in the setup, the container is closed and holds the object.

    The setup places the object inside unless the object is there already.
    """
    for container in context.things(lambda thing: thing.is_openable and thing.category in BELONGS_IN):
        shut = {container.id: ObjectSetup(openness=0.0)}
        belongs = partial(belongs_in, container, context.items[container.id].room)
        for thing in context.things(belongs)[:TRIED_CONTENTS]:
            surface = surface_named(container, thing.surface) if thing.parent == container.id else None
            if surface is not None and surface.needs_opening and thing.is_pickupable:
                yield container, thing, Setup(objects=shut)
            elif (placement := _place_inside(thing, container)) is not None:
                yield container, thing, Setup(objects={**shut, thing.id: ObjectSetup(placement=placement)})


def _place_inside(thing: Thing, container: Thing) -> Placement | None:
    """Return a placement of a thing in the middle of a level surface inside a container; None if it fits on none."""
    size = thing.asset.size
    for surface in container.asset.surfaces:
        frame = surface_frame(container, surface, 0.0)
        fits = size.x <= surface.size_x and size.z <= surface.size_z and size.y <= surface.clearance
        if surface.needs_opening and fits and is_level(frame):
            point = frame.shift
            position = thing.position._replace(x=float(point[0]), y=float(point[1]) + size.y / 2, z=float(point[2]))
            rotation = container.rotation._replace(x=0.0, z=0.0)
            return Placement(position=position, rotation=rotation, parent=container.id)
    return None
