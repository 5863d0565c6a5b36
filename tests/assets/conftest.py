"""What the tests of shapes and of assets share."""

from collections.abc import Callable

import numpy as np
import pytest

from vigil.assets.kernel.asset import Mesh


def _assert_well_made(mesh: Mesh, least_agreement: float = 0.3, *, strays: float = 0.0) -> None:
    """Faces refer to vertices, normals are unit and on the side to which their faces wind; some may stray."""
    assert all(np.isfinite(part).all() for part in (mesh.vertices, mesh.normals, mesh.uvs))
    assert mesh.vertices.dtype == mesh.normals.dtype == mesh.uvs.dtype == np.float32
    assert mesh.faces.dtype == np.int32
    assert len(mesh.normals) == len(mesh.uvs) == len(mesh.vertices)
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-4
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    solid = areas > 1e-9
    agreement = np.einsum("ij,ikj->ik", across[solid] / areas[solid, None], mesh.normals[mesh.faces[solid]]).mean(1)
    assert np.mean(agreement <= least_agreement) <= strays


@pytest.fixture(scope="session")
def assert_well_made() -> Callable[..., None]:
    """The check that a mesh is sound."""
    return _assert_well_made
