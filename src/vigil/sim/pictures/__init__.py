"""Pictures of assets, single things and houses for people, who can judge from them whether things look right."""
