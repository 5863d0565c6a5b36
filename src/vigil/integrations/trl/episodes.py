"""Episodes as rows of a data set for TRL, and the factory of the environments that play them."""

from functools import partial
from typing import Any

from vigil.integrations.sources import bounded_rows, source_of
from vigil.integrations.trl.environments import Environment, VigilReplies, VigilSkills
from vigil.integrations.trl.options import TrlOptions
from vigil.packs.private import check_revealed
from vigil.protocol.prompt import system_prompt


class Episodes:
    """Episodes of a stream or a pack: rows that name episodes, and environments that play them.

    All rollouts of a group get the same row, so they play the same episode.
    """

    def __init__(self, **options: Any) -> None:
        """Take the fields of `TrlOptions` as `options`. Raises SettingError or PackMismatch if they are invalid."""
        self.options = TrlOptions.of(options)
        self.source = source_of(self.options, self.options.workers, self.options.limit)
        check_revealed(
            self.source.public_name,
            self.source.is_private,
            "The data set and the logs of a trainer",
            reveals=self.options.reveal_private_pack,
            by="reveal_private_pack=True",
        )

    def rows(self) -> list[dict[str, Any]]:
        """Return one row for each episode, with the prompt and the episode's id. A row does not contain the goal.

        Raises SettingError if the stream is endless.
        """
        prompt_of = partial(system_prompt, profile=self.options.condition)
        return [
            {
                # The first frame is added to the last message when an environment is reset.
                "prompt": [
                    {"role": "system", "content": [{"type": "text", "text": prompt_of(episode.instruction)}]},
                    {"role": "user", "content": []},
                ],
                "episode_id": episode.id,
                "house": house,
                "source": self.source.name,
            }
            for episode, house in bounded_rows(self.source)
        ]

    def environment(self) -> Environment:
        """Return a new environment. Give this method to a trainer as its `environment_factory`."""
        kind = VigilReplies if self.options.actions == "text" else VigilSkills
        return kind(self.source, self.options)

    def close(self) -> None:
        """End the background processes of a stream."""
        self.source.close()
