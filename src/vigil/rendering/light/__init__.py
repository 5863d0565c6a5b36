"""The light on a scene: computed once with rays from vertices and texels, then averaged along surfaces."""
