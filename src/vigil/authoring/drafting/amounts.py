"""Default amounts of drafts, in a module without imports, so that help texts can name them."""

PER_HOUSE = 3
"""Maximum number of valid drafts that are kept for each family in a house."""
TRIED = 20
"""Maximum number of drafts that are tried for each family in a house."""
