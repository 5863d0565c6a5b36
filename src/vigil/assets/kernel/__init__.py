"""The kernel of assets: what an asset is, meshes, materials, colours, and the builder."""
