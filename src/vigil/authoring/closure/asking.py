"""Functions and sentences that several kinds of tasks share: starts near a thing, phrases that say where the thing lies
(such as "the book on the desk"), and orders to put a thing on another.
"""

from dataclasses import replace

from vigil.authoring.closure.tasks import LEVEL_DEG, NEAR_M
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.proposals import CLEAR_PX, shows_px
from vigil.authoring.language.disambiguation import first_meaning
from vigil.authoring.language.referring import DescribedThing, Phrase, referents
from vigil.authoring.language.sentences import SEARCH_ORDERS
from vigil.base.geometry import Pose
from vigil.scene.things import Thing

_CLAIMS = ("I do not know where {target} is", "Where is {target}?")
PLACED_ORDERS = SEARCH_ORDERS.with_halves(lambda half: (form for form in half if not form.startswith(_CLAIMS)))
"""Orders to search for a target that do not ask where it is: the phrase for the target already names its place."""
PUT_ON = (
    "Put {target} on {receptacle}.",
    "Please put {target} on {receptacle}.",
    "Pick up {target} and put it on {receptacle}.",
    "Take {target} and set it down on {receptacle}.",
    "I would like you to put {target} on {receptacle}.",
)


def phrase_by_support(context: HouseContext, item: DescribedThing, *, may_colour: bool = True) -> Phrase | None:
    """Return an unambiguous phrase that says what a thing lies on ("the book on the desk"); None if there is none."""
    items = list(context.items.values())
    if item.support is None or {each.id for each in referents(Phrase(item.support), items)} != {item.support_id}:
        return None
    phrases = [item.on_support, *([replace(item.on_support, colour=item.colour)] if may_colour else [])]
    return first_meaning(phrases, item, items)


def start_near(context: HouseContext, thing: Thing, hidden: str | None = None, min_px: int = CLEAR_PX) -> Pose | None:
    """Return a start from which at least `min_px` pixels of a nearby thing are visible in the current setup.

    The thing with the id `hidden`, if given, is fully out of view. None if there is no such start.
    """
    return context.start_seeing(
        thing,
        NEAR_M,
        LEVEL_DEG,
        shows_px(min_px),
        lambda pose: hidden is None or context.is_out_of_view_from(pose, hidden),
    )
