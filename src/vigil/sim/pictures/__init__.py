"""Pictures of assets, single things and houses, with which people can judge whether the shown things look right."""
