"""`vigil review`: the reviewer's pages. Each verdict is written to the review file before the page confirms it."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from fastapi import Body, FastAPI
from fastapi.responses import HTMLResponse, Response
from pydantic import BaseModel, ConfigDict, ValidationError

from vigil.assets.database import AssetDatabase
from vigil.authoring.closure.expected_reports import expected_reports_of_drafts, expected_reports_of_pack
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
from vigil.base.geometry import wrap_deg
from vigil.errors import SettingError, first_error
from vigil.packs.files import HOUSES
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import TargetSize
from vigil.protocol.house import House
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings
from vigil.scoring.goal_words import describe_goal
from vigil.web.drawing import RenderService
from vigil.web.phrases import action_words, click_of
from vigil.web.plan import plan_of
from vigil.web.site import Address, make_site, page, png

VIEWS_AROUND = 8
"""Number of views from the start pose, each turned by 45 degrees from the last."""


@dataclass(frozen=True, slots=True)
class ReviewSet:
    """Episodes to review, with their solutions and the folder of their houses."""

    name: str
    episodes: tuple[Episode, ...]
    solutions: dict[str, tuple[Action, ...]]
    houses: Path
    expected_reports: dict[str, str] = field(default_factory=dict)
    """Id of an episode of the closure-stress suite -> its expected closing report, in words."""

    @classmethod
    def of_pack(cls, pack: Pack) -> "ReviewSet":
        """Return the episodes of a pack, for review."""
        solutions = {name: solution.actions for name, solution in pack.solutions.items()}
        return cls(pack.name, pack.episodes, solutions, pack.folder / HOUSES, expected_reports_of_pack(pack))

    @classmethod
    def of_drafts(cls, path: Path) -> "ReviewSet":
        """Return the drafts in a file of `vigil pack propose`, including drafts of the closure-stress suite.

        Raises SettingError if the file does not have drafts.
        """
        file = DraftsFile(path)
        proposed = file.read()
        drafts = proposed.drafts
        if not drafts:
            raise SettingError(f"Drafts file {str(path)!r} does not have drafts yet. `vigil pack propose` adds some.")
        solutions = {draft.episode.id: draft.actions for draft in drafts}
        episodes = tuple(draft.episode for draft in drafts)
        return cls(path.name, episodes, solutions, file.houses, expected_reports_of_drafts(proposed))

    def house_path(self, episode: Episode) -> Path:
        """Return the file of an episode's house."""
        return self.houses / f"{episode.house.name}.json"


class VerdictForm(BaseModel):
    """A verdict on an episode, as the page sends it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    verdict: Verdict
    instruction: str | None = None
    target_size: TargetSize | None = None
    text: str = ""


class ReviewSession:
    """One reviewer's session: the episodes in their order, and the file of verdicts."""

    def __init__(
        self,
        review_set: ReviewSet,
        path: Path,
        reviewer: str,
        seed: int = 0,
        render_settings: RenderSettings | None = None,
    ) -> None:
        """Open the review file. Raises RecordError if it is unreadable, SettingError on an invalid name."""
        self.review_set = review_set
        self.path = path
        self.reviewer = reviewer
        self.render_settings = render_settings or RenderSettings()
        database = self.render_settings.asset_database
        self.assets = AssetDatabase.from_file(database)
        self.queue = queue(review_set.episodes, seed)
        self.by_id = {episode.id: episode for episode in self.queue}
        if not path.parent.is_dir():
            raise SettingError(f"--file {str(path)!r}: folder {str(path.parent)!r} does not exist. Make it first.")
        self._review(self.queue[0], VerdictForm(verdict="approve"))
        read_reviews(path)

    def say(self, episode: Episode, said: VerdictForm) -> None:
        """Write a verdict to the file. Raises SettingError if the verdict is incomplete."""
        append_review(self.path, self._review(episode, said))

    def _review(self, episode: Episode, said: VerdictForm) -> Review:
        try:
            return Review(
                at=datetime.now(UTC),
                reviewer=self.reviewer,
                episode_id=episode.id,
                episode_sha256=episode_sha256(episode),
                **said.model_dump(),
            )
        except ValidationError as error:
            raise SettingError(f"{first_error(error, 'the review')}.") from None


def make_review(session: ReviewSession, render_service: RenderService, address: Address | None = None) -> FastAPI:
    """Return the application. Raises SettingError if the address needs a token and does not have one."""
    site = make_site(address or Address())
    _add_pages(site, session)
    _add_pictures(site, session, render_service)
    return site


def _add_pages(site: FastAPI, session: ReviewSession) -> None:
    @site.get("/", response_class=HTMLResponse)
    def listing() -> Response:
        reviews = read_reviews(session.path)
        rows = [(episode, decisions(episode, reviews)) for episode in session.queue]
        mine = [found.get(session.reviewer, Decision()).judgement for _, found in rows]
        others = sorted({review.reviewer for review in reviews} - {session.reviewer})
        compared = {name: agreement(session.queue, reviews, session.reviewer, name) for name in others}
        first = next((episode.id for (episode, _), done in zip(rows, mine, strict=True) if done is None), None)
        values = {"rows": rows, "done": sum(done is not None for done in mine), "compared": compared, "first": first}
        return page("queue.html", title="Review", session=session, families=FAMILIES, **values)

    @site.get("/episodes/{episode_id}", response_class=HTMLResponse)
    def review(episode_id: str) -> Response:
        episode = session.by_id[episode_id]
        return page("review.html", title=episode_id, session=session, episode=episode, **_values(session, episode))

    @site.post("/episodes/{episode_id}/verdict")
    def verdict(episode_id: str, said: Annotated[VerdictForm, Body()]) -> dict[str, Any]:
        episode = session.by_id[episode_id]
        session.say(episode, said)
        mine = decisions(episode, read_reviews(session.path))[session.reviewer]
        return {
            "judgement": mine.judgement,
            "instruction": mine.instruction,
            "target_size": mine.target_size,
            "notes": list(mine.notes),
        }


def _values(session: ReviewSession, episode: Episode) -> dict[str, Any]:
    """Return the values with which the template renders an episode's page."""
    ids = [each.id for each in session.queue]
    place = ids.index(episode.id)
    solution = session.review_set.solutions[episode.id]
    return {
        "mine": decisions(episode, read_reviews(session.path)).get(session.reviewer, Decision()),
        "goal": describe_goal(episode.goal),
        "closing": session.review_set.expected_reports.get(episode.id),
        "family": FAMILIES[episode.family],
        "place": place + 1,
        "plan": plan_of(House.load(session.review_set.house_path(episode), episode.house.sha256), session.assets),
        "data": {
            "url": f"/episodes/{episode.id}",
            "steps": [{"words": action_words(action, None), "click": click_of(action)} for action in solution],
            "around": VIEWS_AROUND,
            "ids": sorted(set(episode.bindings.values()) | episode.goal.ids()),
            "before": ids[place - 1] if place else None,
            "after": ids[place + 1] if place + 1 < len(ids) else None,
        },
    }


def _add_pictures(site: FastAPI, session: ReviewSession, render_service: RenderService) -> None:
    @site.get("/episodes/{episode_id}/solution/{step}.png")
    def solved(episode_id: str, step: int) -> Response:
        episode = session.by_id[episode_id]
        actions = session.review_set.solutions[episode_id]
        if not 1 <= step <= len(actions):
            raise KeyError(step)
        done = tuple(action for action in actions[: step - 1] if action.skill_name != "report")
        return png(render_service.picture(_moment_of(session, episode, done)))

    @site.get("/episodes/{episode_id}/around/{turn}.png")
    def around(episode_id: str, turn: int) -> Response:
        episode = session.by_id[episode_id]
        if not 0 <= turn < VIEWS_AROUND:
            raise KeyError(turn)
        yaw = wrap_deg(episode.start.rotation + turn * 360.0 / VIEWS_AROUND)
        start = episode.start.model_copy(update={"rotation": yaw, "horizon": 15.0})
        return png(render_service.picture(_moment_of(session, episode.model_copy(update={"start": start}))))


def _moment_of(session: ReviewSession, episode: Episode, actions: tuple = ()) -> EpisodeMoment:
    return EpisodeMoment(
        session.render_settings,
        session.review_set.house_path(episode),
        episode.house.sha256,
        episode.start,
        episode.setup,
        actions,
    )
