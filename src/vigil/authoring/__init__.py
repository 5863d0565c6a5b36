"""Authoring: code that proposes, solves and reviews episodes, and freezes packs of them."""
