"""Starts from which one thing is seen from nearby, and another is not."""

from vigil.authoring.closure.tasks import LEVEL_DEG, NEAR_M, is_out_of_view_from
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import CLEAR_PX, is_seen
from vigil.base.geometry import Pose
from vigil.scene.things import Thing


def start_near(context: HouseContext, thing: Thing, hidden: str | None = None, min_px: int = CLEAR_PX) -> Pose | None:
    """Return a start that sees a thing from nearby with at least `min_px` pixels, in the current setup.

    The thing with the id `hidden` is fully out of view. None without such a start.
    """
    return context.start_seeing(
        thing,
        NEAR_M,
        LEVEL_DEG,
        is_seen(min_px),
        lambda pose: hidden is None or is_out_of_view_from(context, pose, hidden),
    )
