"""The light that falls on a scene: rays cast once from vertices and texels, and averaged along surfaces."""
