"""VIGIL's episodes for GRPO with TRL: a data set, a factory of environments, and a processor.

    from vigil.integrations.trl import Episodes, protocol_processor, valid_replies

    episodes = Episodes(pack="stream:7", family="PG", limit=64)

The trainer gets `Dataset.from_list(episodes.rows())`, `environment_factory=episodes.environment` and
`reward_funcs=[valid_replies]` (docs/trl.md). Nothing here needs TRL.
"""

from vigil.integrations.options import TrlOptions
from vigil.integrations.trl.environments import Environment, Episodes, VigilReplies, VigilSkills, valid_replies
from vigil.integrations.trl.processors import protocol_processor

__all__ = [
    "Environment",
    "Episodes",
    "TrlOptions",
    "VigilReplies",
    "VigilSkills",
    "protocol_processor",
    "valid_replies",
]
