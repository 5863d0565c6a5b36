"""The engine: it receives AI2-THOR's actions one at a time, and answers each with metadata and images."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vigil.errors import SimulatorError, VigilError
from vigil.thor.actions.action import Action
from vigil.thor.actions.missing import MISSING
from vigil.thor.actions.table import ACTIONS
from vigil.thor.base.agents import act_as
from vigil.thor.base.errors import ActionFailed
from vigil.thor.base.images import Image, Wanted, agent_images, camera_images
from vigil.thor.base.metadata import agent_metadata, cameras
from vigil.thor.base.world import World


@dataclass(frozen=True, slots=True)
class EngineResponse:
    """The engine's answer to an action."""

    metadata: dict[str, Any]
    """All metadata. If `is_patch`, only those fields of the agent's metadata that changed."""
    images: list[Image] = field(default_factory=list)
    is_patch: bool = False


class ThorEngine:
    """An engine that carries out actions in a world; the connections (pipes and HTTP) send it the client's actions."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._results: dict[int, dict[str, Any]] = {}
        """Metadata of the last action of each agent."""

    def first_response(self) -> EngineResponse:
        """Return the answer that is sent before the first action."""
        return self._full_response(_STARTED, 0)

    def respond(self, sent: Mapping[str, Any]) -> EngineResponse:
        """Carry out one action and return the answer, which also says whether and why the action failed."""
        name, number = str(sent.get("action")), sent.get("sequenceId", 0)
        action = ACTIONS.get(name)
        failure, returned = None, None
        try:
            returned = self._carried_out(action, name, sent)
        except ActionFailed as found:
            failure = found
        except VigilError as found:  # the world refuses what the action asks for, and the engine goes on
            failure = ActionFailed(str(found))
        result = _result(name, failure, returned)
        is_fast = self._world.settings.fast_action_emit and self._world.serves_patches
        if action is not None and action.only_reads and failure is None and is_fast:
            return EngineResponse({**result, "agentId": self._world.active}, is_patch=True)
        if sent.get("renderInstanceSegmentation") is True:
            return self._with_masks(result, number, _wanted(sent))
        return self._full_response(result, number, _wanted(sent))

    def _carried_out(self, action: Action | None, name: str, sent: Mapping[str, Any]) -> Any:
        if action is None:
            reason = f" ({MISSING[name]})" if name in MISSING else ""
            raise ActionFailed(f"Invalid action: {name}{reason}", code="InvalidAction")
        act_as(self._world, sent.get("agentId") or 0)
        if action.takes_anything and not action.parameters:
            return action.handler(self._world, **{key: value for key, value in sent.items() if key != "action"})
        return action.handler(self._world, **action.arguments(sent))

    def _with_masks(self, result: dict[str, Any], number: int, wanted: Wanted) -> EngineResponse:
        """Return an answer with instance masks, for an action that asks for masks although the settings do not."""
        world, settings = self._world, self._world.settings
        world.settings = settings.model_copy(update={"render_instance_segmentation": True})
        try:
            return self._full_response(result, number, wanted)
        finally:
            world.settings = settings

    def _full_response(self, result: dict[str, Any], number: int, wanted: Wanted = "all") -> EngineResponse:
        world, acting = self._world, self._world.active
        self._results[acting] = result
        agents: list[dict[str, Any]] = []
        metadata = {
            "agents": agents,
            "thirdPartyCameras": cameras(world),
            "activeAgentId": acting,
            "sequenceId": number,
        }
        numbers = sorted([acting, *world.waiting])
        for each in numbers:
            act_as(world, each)
            agents.append({**agent_metadata(world), **self._results.get(each, _STARTED)})
        pictures: list[Image] = []
        try:
            for each in numbers:
                act_as(world, each)
                pictures += agent_images(world, wanted)
            return EngineResponse(metadata, [*pictures, *camera_images(world, wanted)])
        except SimulatorError as error:
            agents[acting].update(
                lastActionSuccess=False, errorMessage=f"No picture could be drawn: {error}", errorCode=None
            )
            return EngineResponse(metadata)
        finally:
            act_as(world, acting)


def _wanted(sent: Mapping[str, Any]) -> Wanted:
    """Return which images an action asks for: normally all.

    With `renderImage=False`, an action asks for no image or, if it also asks for masks, for all images except "rgb".
    """
    if sent.get("renderImage") is not False:
        return "all"
    return "without colours" if sent.get("renderInstanceSegmentation") else "none"


def _result(action: str, failure: ActionFailed | None, returned: Any) -> dict[str, Any]:
    return {
        "lastAction": action,
        "lastActionSuccess": failure is None,
        "errorMessage": "" if failure is None else str(failure),
        "errorCode": None if failure is None else failure.code,
        "actionReturn": returned,
    }


_STARTED = _result("Initialize", None, None)
"""Metadata of the last action of an agent that has not acted yet."""
