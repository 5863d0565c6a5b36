"""The smallest house document that loads."""

from typing import Any

from vigil.protocol.house import House


def bare_house(name: str = "house", *object_ids: str) -> House:
    """Return one square room without walls, doors or windows, with plain objects of the given ids."""
    corners = [(0, 0), (0, 4), (4, 4), (4, 0)]
    data: dict[str, Any] = {
        "rooms": [
            {
                "id": "room|1",
                "roomType": "Kitchen",
                "floorPolygon": [{"x": x, "y": 0, "z": z} for x, z in corners],
                "floorMaterial": {"name": "wood/oak"},
            }
        ],
        "walls": [],
        "doors": [],
        "windows": [],
        "objects": [
            {
                "id": object_id,
                "assetId": "vigil_Apple_1",
                "position": {"x": 1, "y": 1, "z": 1},
                "rotation": {"x": 0, "y": 0, "z": 0},
            }
            for object_id in object_ids
        ],
        "proceduralParameters": {},
        "metadata": {"name": name},
    }
    return House(name, data)
