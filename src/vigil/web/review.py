"""`vigil review`: the auditor's pages. A verdict is in the review file before the page says so."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from fastapi import Body, FastAPI
from fastapi.responses import HTMLResponse, Response
from pydantic import BaseModel, ConfigDict, ValidationError

from vigil.actions import Action
from vigil.assets.sizes import AssetDatabase
from vigil.authoring.drafting.drafts import DraftsFile
from vigil.authoring.review.reviews import (
    Decision,
    Review,
    Verdict,
    agreement,
    append_review,
    decisions,
    episode_sha256,
    queue,
    read_reviews,
)
from vigil.episode import FAMILIES, Episode, Size
from vigil.errors import SettingError, first_fault
from vigil.house import House
from vigil.pack import HOUSES, Pack
from vigil.pose import wrap_deg
from vigil.web.drawing import Drawer, Look, Scene
from vigil.web.phrases import action_words, click_of, goal_words
from vigil.web.plan import plan_of
from vigil.web.site import Address, make_site, page

AROUND = 8
"""Views from the start, each turned on by 45 degrees."""


@dataclass(frozen=True, slots=True)
class Pile:
    """What is reviewed: episodes with their solutions, and the folder of their houses."""

    name: str
    episodes: tuple[Episode, ...]
    solutions: dict[str, tuple[Action, ...]]
    houses: Path

    @classmethod
    def of_pack(cls, pack: Pack) -> "Pile":
        """Returns the episodes of a pack."""
        solutions = {name: solution.actions for name, solution in pack.solutions.items()}
        return cls(pack.name, pack.episodes, solutions, pack.folder / HOUSES)

    @classmethod
    def of_drafts(cls, path: Path) -> "Pile":
        """Returns the drafts of a file of `vigil pack propose`. Raises SettingError when it holds none."""
        file = DraftsFile(path)
        drafts = file.read().drafts
        if not drafts:
            raise SettingError(f"Drafts file {str(path)!r} holds no draft yet. `vigil pack propose` adds some.")
        solutions = {draft.episode.id: draft.actions for draft in drafts}
        return cls(path.name, tuple(draft.episode for draft in drafts), solutions, file.houses)

    def house_path(self, episode: Episode) -> Path:
        """Returns the file of an episode's house."""
        return self.houses / f"{episode.house.name}.json"


class Said(BaseModel):
    """A verdict as the page sends it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    verdict: Verdict
    instruction: str | None = None
    difficulty: Size | None = None
    text: str = ""


class Desk:
    """One reviewer's desk: the queue, and the file of verdicts."""

    def __init__(self, pile: Pile, path: Path, reviewer: str, seed: int = 0, look: Look | None = None) -> None:
        """Raises RecordError when the review file cannot be read, SettingError for a name that makes no sense."""
        self.pile = pile
        self.path = path
        self.reviewer = reviewer
        self.look = look or Look()
        database = self.look.asset_database
        self.assets = AssetDatabase.of(database)
        self.queue = queue(pile.episodes, seed)
        self.by_id = {episode.id: episode for episode in self.queue}
        if not path.parent.is_dir():
            raise SettingError(f"--file {str(path)!r}: folder {str(path.parent)!r} does not exist. Make it first.")
        self._review(self.queue[0], Said(verdict="approve"))
        read_reviews(path)

    def say(self, episode: Episode, said: Said) -> None:
        """Writes a verdict. Raises SettingError when it is not whole."""
        append_review(self.path, self._review(episode, said))

    def _review(self, episode: Episode, said: Said) -> Review:
        try:
            return Review(
                at=datetime.now(UTC),
                reviewer=self.reviewer,
                episode_id=episode.id,
                episode_sha256=episode_sha256(episode),
                **said.model_dump(),
            )
        except ValidationError as error:
            raise SettingError(f"{first_fault(error, 'the review')}.") from None


def make_review(desk: Desk, drawer: Drawer, address: Address | None = None) -> FastAPI:
    """Returns the application. Raises SettingError when the address needs a token."""
    site = make_site(address or Address())
    _add_pages(site, desk)
    _add_pictures(site, desk, drawer)
    return site


def _add_pages(site: FastAPI, desk: Desk) -> None:
    @site.get("/", response_class=HTMLResponse)
    def listing() -> Response:
        reviews = read_reviews(desk.path)
        rows = [(episode, decisions(episode, reviews)) for episode in desk.queue]
        mine = [found.get(desk.reviewer, Decision()).judgement for _, found in rows]
        others = sorted({review.reviewer for review in reviews} - {desk.reviewer})
        compared = {name: agreement(desk.queue, reviews, desk.reviewer, name) for name in others}
        first = next((episode.id for (episode, _), done in zip(rows, mine, strict=True) if done is None), None)
        values = {"rows": rows, "done": sum(done is not None for done in mine), "compared": compared, "first": first}
        return page("queue.html", title="Review", desk=desk, families=FAMILIES, **values)

    @site.get("/episodes/{episode_id}", response_class=HTMLResponse)
    def review(episode_id: str) -> Response:
        episode = desk.by_id[episode_id]
        return page("review.html", title=episode_id, desk=desk, episode=episode, **_values(desk, episode))

    @site.post("/episodes/{episode_id}/verdict")
    def verdict(episode_id: str, said: Annotated[Said, Body()]) -> dict[str, Any]:
        episode = desk.by_id[episode_id]
        desk.say(episode, said)
        mine = decisions(episode, read_reviews(desk.path))[desk.reviewer]
        return {
            "judgement": mine.judgement,
            "instruction": mine.instruction,
            "difficulty": mine.difficulty,
            "notes": list(mine.notes),
        }


def _values(desk: Desk, episode: Episode) -> dict[str, Any]:
    """Returns what the page of an episode shows."""
    ids = [each.id for each in desk.queue]
    place = ids.index(episode.id)
    solution = desk.pile.solutions[episode.id]
    return {
        "mine": decisions(episode, read_reviews(desk.path)).get(desk.reviewer, Decision()),
        "goal": goal_words(episode.goal),
        "family": FAMILIES[episode.family],
        "place": place + 1,
        "plan": plan_of(House.load(desk.pile.house_path(episode)), desk.assets),
        "data": {
            "url": f"/episodes/{episode.id}",
            "steps": [{"words": action_words(action, None), "click": click_of(action)} for action in solution],
            "around": AROUND,
            "ids": sorted(set(episode.bindings.values()) | episode.goal.ids()),
            "before": ids[place - 1] if place else None,
            "after": ids[place + 1] if place + 1 < len(ids) else None,
        },
    }


def _add_pictures(site: FastAPI, desk: Desk, drawer: Drawer) -> None:
    @site.get("/episodes/{episode_id}/solution/{step}.png")
    def solved(episode_id: str, step: int) -> Response:
        episode = desk.by_id[episode_id]
        actions = desk.pile.solutions[episode_id]
        if not 1 <= step <= len(actions):
            raise KeyError(step)
        done = tuple(action for action in actions[: step - 1] if action.skill_name != "report")
        return _png(drawer.picture(_scene(desk, episode, done)))

    @site.get("/episodes/{episode_id}/around/{turn}.png")
    def around(episode_id: str, turn: int) -> Response:
        episode = desk.by_id[episode_id]
        if not 0 <= turn < AROUND:
            raise KeyError(turn)
        yaw = wrap_deg(episode.start.rotation + turn * 360.0 / AROUND)
        start = episode.start.model_copy(update={"rotation": yaw, "horizon": 15.0})
        return _png(drawer.picture(_scene(desk, episode.model_copy(update={"start": start}))))


def _scene(desk: Desk, episode: Episode, actions: tuple = ()) -> Scene:
    return Scene(desk.look, desk.pile.house_path(episode), episode.start, episode.setup, actions)


def _png(data: bytes) -> Response:
    return Response(data, media_type="image/png", headers={"Cache-Control": "private, max-age=600"})
