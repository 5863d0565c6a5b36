"""Showcase: pictures of assets, single things and houses for people, and whether things look right."""
