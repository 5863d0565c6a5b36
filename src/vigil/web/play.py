"""`vigil play`: the page for a person who plays. The server has only this page and never sends hidden state."""

from typing import Annotated, Any

from fastapi import Body, FastAPI, Request
from fastapi.responses import HTMLResponse, Response
from pydantic import BaseModel, ConfigDict, Field

from vigil.protocol.actions import INTENTS
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.web import phrases
from vigil.web.play_session import PlaySession
from vigil.web.site import Address, make_site, page

MAX_TEXT = 64 * 1024


class PlayerReply(BaseModel):
    """A reply from the page: the number of the view that the person saw, and the exact text to record."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    moment: int = Field(ge=0)
    text: str = Field(max_length=MAX_TEXT)


def make_play(play_session: PlaySession, address: Address | None = None) -> FastAPI:
    """Return the application. Raises SettingError if the address needs a token and does not have one."""
    site = make_site(address or Address())

    @site.get("/", response_class=HTMLResponse)
    def play(request: Request) -> Response:
        aimed = {name: phrases.INTENTS[name] for name, spec in INTENTS.items() if spec.needs_pixel}
        values = {"intents": aimed, "statuses": phrases.STATUSES, "width": FRAME_WIDTH, "height": FRAME_HEIGHT}
        return page("play.html", title="Play", **values)

    @site.get("/state")
    async def state() -> dict[str, Any]:
        return await play_session.state()

    @site.post("/next")
    async def next_episode() -> dict[str, Any]:
        return await play_session.next()

    @site.post("/reply")
    async def reply(answer: Annotated[PlayerReply, Body()]) -> dict[str, Any]:
        return await play_session.reply(answer.moment, answer.text)

    return site
