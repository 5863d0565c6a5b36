"""Packing: from drafts to a frozen pack, and what is measured and said about it."""
