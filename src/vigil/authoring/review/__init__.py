"""Review: the rules, replays, negative controls and reviewers that decide whether an episode is valid."""
