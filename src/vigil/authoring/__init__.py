"""Authoring: proposing, solving and reviewing episodes, and freezing packs of them."""
