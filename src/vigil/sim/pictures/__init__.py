"""Pictures of assets, single things and houses, with which people can judge whether these look right."""
