"""A client of a server: plays episodes through it without a simulator."""

import base64
import http.client
import json
import urllib.error
import urllib.request
from typing import Any
from urllib.parse import urlsplit

from tenacity import Retrying, retry_if_exception, stop_after_delay, wait_exponential

from vigil.agents.frame_encoding import EncodedFrame
from vigil.errors import InfrastructureError, SettingError
from vigil.integrations.serve.messages import SESSION_HEADER, action_of
from vigil.protocol.actions import Reply
from vigil.protocol.observation import Cues, Feedback
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.records.reply_truncation import truncate_for_record
from vigil.runner.workers.messages import EncodedObservation

REQUEST_SECONDS = 180.0
"""Time limit of one request, in seconds. A request that is not answered within this time is sent again."""
PATIENCE_SECONDS = 600.0
"""Time in seconds during which a failed request is sent again."""
MAX_ANSWER_BYTES = 16 * 1024 * 1024


class ServerFault(InfrastructureError):
    """A request that a server did not carry out."""

    def __init__(self, message: str, status: int = 0) -> None:
        super().__init__(message)
        self.status = status


class SessionEnded(Exception):
    """The server has ended the session of an episode."""


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Refuses redirects, because they would send the token to another address."""

    def redirect_request(self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str) -> None:
        """Return None: urllib then treats the redirect as an error."""


class RemoteEnvironment:
    """The environment that a server at an address offers."""

    def __init__(self, url: str, token: str = "", patience_s: float = PATIENCE_SECONDS) -> None:
        """Set the address. Failed requests are sent again for `patience_s` seconds. Raises SettingError."""
        if urlsplit(url).scheme not in ("http", "https") or not urlsplit(url).hostname:
            raise SettingError(
                f"--env {url!r} is not the address of a server. Give an address such as http://127.0.0.1:8380."
            )
        self.url = url.rstrip("/")
        self._token, self._patience_s = token, patience_s
        self._open = urllib.request.build_opener(_NoRedirect).open

    def contract(self) -> dict[str, Any]:
        """Return the server's description of its episodes. Raises InfrastructureError or SettingError."""
        return self._send(self._request("GET", "/contract"))

    def reset(self) -> "RemoteEpisode | None":
        """Begin the next episode; None if no episode is left. Raises InfrastructureError or SettingError."""
        answer = self._post("/reset", {})
        return None if answer["done"] else RemoteEpisode(self, answer["observation"])

    def step(self, session: str, moment: int, action: dict[str, Any]) -> dict[str, Any]:
        """Return the server's answer to a reply. Raises SessionEnded, InfrastructureError or SettingError."""
        return self._post("/step", {"action": action, "moment": moment}, session)

    def _request(self, method: str, path: str, body: Any = None, session: str = "") -> urllib.request.Request:
        headers = {"Content-Type": "application/json", **({SESSION_HEADER: session} if session else {})}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        data = None if body is None else json.dumps(body, ensure_ascii=False).encode()
        return urllib.request.Request(self.url + path, data, headers, method=method)

    def _post(self, path: str, body: Any, session: str = "") -> dict[str, Any]:
        retrying = Retrying(
            retry=retry_if_exception(
                lambda error: isinstance(error, ServerFault) and (error.status in (0, 429) or error.status >= 500)
            ),
            stop=stop_after_delay(self._patience_s),
            wait=wait_exponential(multiplier=0.5, max=10),
            reraise=True,
        )
        return retrying(self._send, self._request("POST", path, body, session))

    def _send(self, request: urllib.request.Request) -> dict[str, Any]:
        try:
            with self._open(request, timeout=REQUEST_SECONDS) as answer:
                return json.loads(answer.read(MAX_ANSWER_BYTES))
        except urllib.error.HTTPError as error:
            with error:
                said = error.read(1000).decode("utf-8", "replace")
            if error.code == 410:
                raise SessionEnded from None
            if error.code == 401:
                raise SettingError(f"{self.url} needs a token: give --env-token, or set VIGIL_ENV_TOKEN.") from None
            raise ServerFault(f"{self.url} answered {error.code}: {said}", error.code) from None
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise ServerFault(f"{self.url} cannot be reached or does not answer: {error}.") from None


class RemoteEpisode:
    """One episode that is played through a server."""

    def __init__(self, environment: RemoteEnvironment, first: dict[str, Any]) -> None:
        self._environment = environment
        self._session, self._moment = str(first["session"]), int(first["moment"])
        self.instruction = str(first["instruction"])
        self.first = _seen(first)

    def step(self, reply: Reply, profile: Profile) -> EncodedObservation | None:
        """Return the observation after a reply; None if the episode is over. Raises InfrastructureError."""
        cut = truncate_for_record(reply, read_reply(reply, profile).answer)
        try:
            answer = self._environment.step(self._session, self._moment, action_of(cut))
        except SessionEnded:
            return None
        self._moment = int(answer["observation"]["moment"])
        return None if answer["done"] else _seen(answer["observation"])


def _seen(observation: dict[str, Any]) -> EncodedObservation:
    frame = observation["frame"]
    picture = EncodedFrame(base64.b64decode(frame["data"]), frame["media_type"].removeprefix("image/"))
    feedback = observation.get("feedback")
    cues = {name: observation[name] for name in Cues.model_fields if name in observation}
    return EncodedObservation(
        picture, None if feedback is None else Feedback.model_validate(feedback), Cues(**cues) if cues else None
    )
