"""`vigil prompt`."""

from typing import Annotated

from vigil.agents.model import Conversation, Message
from vigil.agents.picture import Picture
from vigil.cli.text import say
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.pack import Pack
from vigil.prompt import INSTRUCTION_SLOT, policy_sha256, policy_version, rendered_sha256
from vigil.runner.settings import RunSettings, profile_of
from vigil.runner.shared_settings import AskedCoordinates, AskedProfile, AskedVariant, PackName
from vigil.setting import Setting

OneEpisode = Annotated[str | None, Setting("Fill in this episode's instruction.", metavar="ID")]
OneModel = Annotated[str | None, Setting("Coordinates as for this model.", metavar="MODEL")]


def prompt(
    pack: PackName = "starter",
    episode: OneEpisode = None,
    profile: AskedProfile = "baseline",
    prompt_variant: AskedVariant = "default",
    coordinates: AskedCoordinates = None,
    model: OneModel = None,
) -> None:
    """Examples:
    vigil prompt
    vigil prompt --episode procthor_fridge_seed116 --model qwen/qwen3-vl-plus
    """
    asked = RunSettings(profile=profile, prompt_variant=prompt_variant, coordinates=coordinates, model=model)
    condition = profile_of(asked)
    instruction = INSTRUCTION_SLOT if episode is None else Pack.load(pack).episode(episode).instruction
    sha256 = policy_sha256(condition) if episode is None else rendered_sha256(instruction, condition)
    picture = Picture(b"", condition.image_format)
    for message in Conversation(condition, instruction).messages(picture, None):
        print(f"--- {message.role} ---")
        print(_text(message))
    feedback = " with the feedback on the action before" if condition.has_feedback else ""
    say(
        (
            f"{policy_version(condition)}; SHA-256 of the system message {sha256}",
            f"Later requests have up to {condition.history_turns} past turns as text between the two, and the current "
            f"frame{feedback}.",
        )
    )


def _text(message: Message) -> str:
    if message.picture is None:
        return message.text
    return f"{message.text}\n[picture: {FRAME_WIDTH} x {FRAME_HEIGHT}, {message.picture.media_type}]"
