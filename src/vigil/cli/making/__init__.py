"""What the verbs that make packs share: what is said of drafting, and the packs of suites."""
