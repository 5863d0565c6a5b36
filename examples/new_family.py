"""A new family made of existing parts: search and approach, which combines View Search and Distance Approach.

    python examples/new_family.py

The script registers the family, drafts an episode of it in a generated house, checks it by the rules of all packs,
and plays it with the solver and with an agent that claims success immediately.
"""

import numpy as np

import vigil
from vigil.agents.scripted import scripted_agent
from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.house_context import HouseContext, TaskSpec
from vigil.authoring.review.validate import Validator
from vigil.authoring.solving.solvers import privileged_agent
from vigil.env import Env
from vigil.protocol.episode import Episode
from vigil.protocol.families import register_family
from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading
from vigil.protocol.goals import AgentNearTarget
from vigil.sim import make_simulator


def drafts(context: HouseContext):
    """Yield episodes that start where the object to approach is out of view, whichever way the agent turns."""
    for thing in context.things(lambda thing: not thing.is_structure and 0.4 < max(thing.asset.size) < 1.9):
        for place in context.starts(context.away_from(thing, 2.5, 12.0), tried=20):
            if not context.is_visible_from(place, thing):
                text = f"Find {context.phrase(thing.id)} and go up to it, to within about one and a half metres."
                start, goal = context.facing(place, thing, 0.0, 180.0), AgentNearTarget(object_id=thing.id)
                yield context.draft("SA", TaskSpec(start, text, goal, {"target": thing.id}))
                break


register_family(
    FamilySpec(
        code="SA",
        name="Search and Approach",
        tier="compositional",
        visible_at_start=False,
        max_steps=30,
        max_invalid=8,
        skills=("navigate", "look", "report"),
        goal_kinds=("agent_near_target",),
        kinds={"seek": DraftKind(drafts)},
        grading=StreamGrading("actions", easy=5, medium=9),
    )
)


def first_valid(simulator, house: vigil.House) -> Episode:
    """Return the first draft that no rule rejects."""
    context = HouseContext(simulator, house, np.random.default_rng(0))
    found = [draft for draft, _ in zip(drafts(context), range(6), strict=False)]
    return next(draft for draft in found if Validator(simulator).validate(draft, house).is_valid)


def main() -> None:
    house = vigil.generate_house(12, "3")
    simulator = make_simulator("fake", assets=AssetDatabase.default())  # only rays: this does not need pictures
    with Env(simulator, lambda episode: house, vigil.Profile()) as env:
        episode = first_valid(simulator, house)
        print(episode.instruction)
        for agent in (privileged_agent("solver", episode, simulator), scripted_agent("always_success")):
            outcome = vigil.score(episode, vigil.play(episode, env, agent))
            print(f"{agent.name}: {outcome.label} after {outcome.steps} steps, W {outcome.W}, family {outcome.family}")


if __name__ == "__main__":
    main()
