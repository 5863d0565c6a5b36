"""Meshes are refined without seams."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tests.support.cabinet_scene import drawn_block
from vigil.assets.kernel.asset import Mesh
from vigil.rendering.meshes import refined


def areas(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


@pytest.mark.parametrize("longest", [0.15, 0.5, 1.2])
def test_refined_meshes_keep_their_surface_without_seams(longest: float) -> None:
    before = drawn_block()
    (after,) = refined([before], longest)
    corners = after.vertices[after.faces]
    assert np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max() <= longest + 1e-6
    assert areas(after).sum() == pytest.approx(areas(before).sum())
    assert (areas(after) > 0.0).all()
    where = [tuple(point) for point in np.round(after.vertices, 5)]
    edges = Counter(
        tuple(sorted((where[face[side]], where[face[(side + 1) % 3]]))) for face in after.faces for side in range(3)
    )
    assert set(edges.values()) == {2}  # a closed surface stays closed


def test_a_fine_mesh_is_left_as_it_is() -> None:
    mesh = drawn_block()
    assert refined([mesh], 3.0)[0] is mesh


def test_meshes_are_refined_together_as_they_are_alone() -> None:
    block = drawn_block()
    meshes = [block, replace(block, vertices=0.1 * block.vertices), replace(block, vertices=2.0 * block.vertices)]
    together = refined(meshes, 0.3)
    for mesh, found in zip(meshes, together, strict=True):
        (alone,) = refined([mesh], 0.3)
        for each in ("vertices", "normals", "uvs", "faces"):
            assert np.array_equal(getattr(found, each), getattr(alone, each))
