"""Review: the rules, replays, negative controls and reviewers' verdicts that decide whether an episode is valid."""
