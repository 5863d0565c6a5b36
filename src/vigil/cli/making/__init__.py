"""Parts that the pack-making verbs share: messages about drafting, and packs of suites."""
