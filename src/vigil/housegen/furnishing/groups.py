"""Furniture groups: a bed with side tables, a desk with its chair, a sofa with its table, a kitchen run, ..."""

import numpy as np

from vigil.housegen.base.models import AssetModel, Rect, asset_model, draw_model, most_similar, turned_rect
from vigil.housegen.base.randomness import chance, pick
from vigil.housegen.furnishing.group_placement import STAND_M, FurnitureGroup, GroupMember, front_access

COUNTER_VARIANTS = 12
"""Number of variants of counters from which the generator draws."""
COUNTER_DEPTH_M = 0.61
"""Depth (m) of the straight part of a counter; a counter with a deeper box is L-shaped."""
RUN_GAP_M = 0.01
"""Gap (m) between the pieces of a kitchen run."""
BED_TABLE_GAP_M = 0.06
SEAT_GAP_M = 0.06
"""Distance (m) between a chair and its table."""
STOOL_GAP_M = 0.05
"""Distance (m) between a stool and its kitchen island."""
STOOL_SPACING_M = 0.2
"""Least gap (m) between two stools. At a long island, the stools are spread over STOOL_SHARE of its length."""
STOOL_SHARE = 0.6
CHAIR_PULL_M = 0.2
"""Depth (m) of the floor behind a dining chair that is kept free so that the chair can be pulled back."""
SEAT_ROOM_M = 0.3
"""Depth (m) of the floor behind a chair that is kept free for sitting down."""
BED_RUG_SHARE = 0.75
"""Share of beds that have a rug at the foot, if the rug fits."""
RUG_UNDER_BED_M = 0.25
"""Distance (m) from a bed's foot to the middle of the rug, measured towards the head."""
RUG_BEFORE_SOFA_M = 0.05
BED_SIDE_M = (0.5, 0.9, 0.2)
"""Floor next to a bed for getting in (m): width, distance from the wall, and distance from the foot."""
SOFA_FRONT_M = 0.4
"""Depth (m) of the floor in front of a sofa that is kept free for sitting down."""
COFFEE_TABLE_GAP_M = 0.42
ARMCHAIR_GAP_M = (0.25, 0.3)
"""Distances (m) from a sofa to an armchair: to the side of the sofa, and in front of it."""
DRAWER_EDGE_M = 0.05
"""Least distance (m) from a chair to the end of its desk, so that the desk's drawers are free."""
KNEE_HALF_M = 0.1
"""The floor kept free in front of a desk's drawers begins at this distance (m) from the desk's middle."""
SCREEN_OVERHANG_M = 0.1
"""How much (m) a television may be wider than its stand."""
SCREEN_BACK_M = 0.02
"""A television is this far (m) behind the middle of its stand."""
TWO_SEATS_M = 1.25
"""A table longer than this (m) has two seats on each long side."""
LONG_SIDES_FIRST = 0.7
"""Share of tables away from walls that get chairs at their long sides first, before their ends."""
COUNTER_FRONT_M = 0.8
"""Least depth (m) of the floor that is kept free in front of a kitchen run."""
ISLAND_FRONT_M = 0.4
"""Depth (m) of the floor kept free in front of a kitchen island, in addition to STAND_M."""
VANITY_FRONT_M = 0.7
CURTAIN_SHARE = 0.35
"""Share of bathtubs with a shower curtain, if the curtain fits."""
CURTAIN_GAP_M = 0.01
TUB_ACCESS_M = (0.3, 0.6)
"""Floor that is kept free along a bathtub: its distance (m) from the tub's ends, and its depth (m)."""
BASIN_EDGE_M = 0.02
"""Distance (m) of a basin from the counter's front edge."""
BASIN_MARGIN_M = 0.06
"""A counter must be deeper than the basin in it by at least this (m)."""


def bed_group(rng: np.random.Generator, tables: int) -> FurnitureGroup:
    """Return a bed with its head at the wall, and up to two equal side tables."""
    bed, table = draw_model("Bed", rng), draw_model("SideTable", rng)
    members = [GroupMember(bed, 0.0, bed.size.z / 2)]
    side = pick(rng, (-1, 1))
    access: list[Rect] = []
    for index in range(tables):
        sign = side if index == 0 else -side
        x = sign * (bed.size.x / 2 + BED_TABLE_GAP_M + table.size.x / 2)
        members.append(GroupMember(table, x, table.size.z / 2))
        depth = front_access(table)
        access.append((x - table.size.x / 2, table.size.z, x + table.size.x / 2, table.size.z + depth))
    half = bed.size.x / 2
    rug = draw_model("Rug", rng)
    if chance(rng, BED_RUG_SHARE) and rug.size.x / 2 <= half + (table.size.x if tables == 2 else 0.0):
        members.append(GroupMember(rug, 0.0, bed.size.z - RUG_UNDER_BED_M))
    edge = side * half if tables else half
    width, begin, end = BED_SIDE_M
    access.append((min(edge, edge + side * width), begin, max(edge, edge + side * width), bed.size.z - end))
    return FurnitureGroup(members, access)


def desk_group(rng: np.random.Generator) -> FurnitureGroup:
    """Return a desk against the wall with a chair in front of it."""
    desk, chair = draw_model("Desk", rng), draw_model("Chair", rng)
    z = desk.size.z + SEAT_GAP_M + chair.size.z / 2
    back = desk.size.z + SEAT_GAP_M + chair.size.z
    half = desk.size.x / 2
    access: list[Rect] = [(-chair.size.x / 2, back, chair.size.x / 2, back + SEAT_ROOM_M)]
    offset = 0.0
    if desk.asset.can_open:
        joints = {joint.name for joint in desk.asset.joints}
        xs = [x for solid in desk.asset.solids if solid.joint in joints for x, _ in solid.polygon]
        is_right = not xs or float(np.mean(xs)) >= 0
        offset = (-1 if is_right else 1) * max(0.0, half - chair.size.x / 2 - DRAWER_EDGE_M)
        zone = (KNEE_HALF_M, half) if is_right else (-half, -KNEE_HALF_M)
        access = [(zone[0], desk.size.z, zone[1], desk.size.z + front_access(desk))]
    return FurnitureGroup([GroupMember(desk, 0.0, desk.size.z / 2), GroupMember(chair, offset, z, 180.0)], access)


def sofa_group(rng: np.random.Generator, with_table: bool, with_chair: bool, with_rug: bool) -> FurnitureGroup:
    """Return a sofa with its back to the wall and, if asked for, a coffee table, an armchair at its side, and a rug."""
    sofa = draw_model("Sofa", rng)
    members = [GroupMember(sofa, 0.0, sofa.size.z / 2)]
    half = sofa.size.x / 2
    access: list[Rect] = [(-half, sofa.size.z, half, sofa.size.z + SOFA_FRONT_M)]
    ahead = sofa.size.z + COFFEE_TABLE_GAP_M
    if with_table:
        table = draw_model("CoffeeTable", rng)
        members.append(GroupMember(table, 0.0, ahead + table.size.z / 2))
        ahead += table.size.z
    if with_chair:
        chair = draw_model("ArmChair", rng)
        side = pick(rng, (-1, 1))
        gap, before = ARMCHAIR_GAP_M
        x = side * (half + gap + chair.size.z / 2)
        members.append(GroupMember(chair, x, sofa.size.z + before + chair.size.x / 2, -90.0 * side))
    if with_rug:
        rug = draw_model("Rug", rng)
        members.append(GroupMember(rug, 0.0, sofa.size.z + RUG_BEFORE_SOFA_M + rug.size.z / 2))
    return FurnitureGroup(members, access)


def media_group(rng: np.random.Generator) -> FurnitureGroup:
    """Return a TV stand against the wall with the television on it."""
    stand = draw_model("TVStand", rng)
    wide = [asset_model(f"vigil_Television_{number}", "Television") for number in range(24)]
    widest, deepest = stand.size.x + SCREEN_OVERHANG_M, stand.size.z
    fitting = [screen for screen in wide if screen.size.x <= widest and screen.size.z <= deepest]
    screen = pick(rng, fitting or wide)
    half = stand.size.x / 2
    access: list[Rect] = [(-half, stand.size.z, half, stand.size.z + front_access(stand))]
    middle = stand.size.z / 2
    return FurnitureGroup(
        [GroupMember(stand, 0.0, middle), GroupMember(screen, 0.0, middle - SCREEN_BACK_M, on=0)], access
    )


def dining_group(rng: np.random.Generator, chairs: int, at_wall: bool) -> FurnitureGroup:
    """Return a table with equal chairs around it; if it stands at a wall, there are no chairs at that side."""
    table, chair = draw_model("DiningTable", rng), draw_model("Chair", rng)
    half_x, half_z = table.size.x / 2, table.size.z / 2
    out = SEAT_GAP_M + chair.size.z / 2
    along = half_x / 2 if half_x * 2 > TWO_SEATS_M else 0.0
    front = [(-along, half_z + out, 180.0), (along, half_z + out, 180.0)] if along else [(0.0, half_z + out, 180.0)]
    back = [] if at_wall else [(x, -z, 0.0) for x, z, _ in front]
    ends = [(half_x + out, 0.0, 270.0), (-half_x - out, 0.0, 90.0)]
    seats = [*front, *back, *ends] if at_wall or chance(rng, LONG_SIDES_FIRST) else [*ends, *front, *back]
    rise = half_z
    members = [GroupMember(table, 0.0, rise)]
    members.extend(GroupMember(chair, x, z + rise, yaw) for x, z, yaw in seats[:chairs])
    half = chair.size.x / 2
    behind = (-half, -chair.size.z / 2 - CHAIR_PULL_M, half, -chair.size.z / 2)
    return FurnitureGroup(members, open=[turned_rect(behind, x, z + rise, yaw) for x, z, yaw in seats[:chairs]])


def kitchen_run(rng: np.random.Generator, with_fridge: bool, feet: tuple[int, ...]) -> FurnitureGroup:
    """Return a group of matching counters along a wall, with the stove between them and perhaps the fridge at one end.

    `feet` are the widths (ft) of the counters.
    """
    stove, look = draw_model("Stove", rng), int(rng.integers(COUNTER_VARIANTS))
    counters = [asset_model(f"Countertop_{look}_I_{width}x2", "CounterTop") for width in feet]
    row: list[AssetModel] = [counters[0], stove, *counters[1:]]
    if chance(rng, 0.5):
        row.reverse()
    if with_fridge:
        fridge = draw_model("Fridge", rng)
        row = [fridge, *row] if chance(rng, 0.5) else [*row, fridge]
    return _run(rng, row)


def corner_run(rng: np.random.Generator, with_fridge: bool, feet: int) -> FurnitureGroup:
    """Return a group: an L-shaped counter with its short part at +x, a stove next to it, and perhaps a fridge next to
    the stove.

    `feet` is the width (ft) of the counter.
    """
    counter = asset_model(f"Countertop_{int(rng.integers(COUNTER_VARIANTS))}_L_{feet}x{feet}", "CounterTop")
    row = [draw_model("Stove", rng), counter]
    return _run(rng, [draw_model("Fridge", rng), *row] if with_fridge else row)


def _run(rng: np.random.Generator, row: list[AssetModel]) -> FurnitureGroup:
    """Return a group of models that stand side by side along a wall, with a sink in the first counter."""
    left = -(sum(model.size.x for model in row) + RUN_GAP_M * (len(row) - 1)) / 2
    members: list[GroupMember] = []
    access: list[Rect] = []
    basins: list[GroupMember] = []
    for index, model in enumerate(row):
        middle, right = left + model.size.x / 2, left + model.size.x
        members.append(GroupMember(model, middle, model.size.z / 2))
        depth = min(model.size.z, COUNTER_DEPTH_M) if model.category == "CounterTop" else model.size.z
        if model.category == "CounterTop":
            if not basins:
                basins = _basin(rng, (index, len(row)), middle, depth)
            right = min(right, right + depth - model.size.z)
        access.append((left, depth, right, depth + max(COUNTER_FRONT_M, front_access(model))))
        left += model.size.x + RUN_GAP_M
    return FurnitureGroup([*members, *basins], access)


def bathtub_group(rng: np.random.Generator) -> FurnitureGroup:
    """Return a bathtub whose long side is at the wall."""
    tub = draw_model("Bathtub", rng)
    half = tub.size.x / 2
    members = [GroupMember(tub, 0.0, tub.size.z / 2)]
    curtain = draw_model("ShowerCurtain", rng)
    if chance(rng, CURTAIN_SHARE) and curtain.size.x <= tub.size.x:
        members.append(GroupMember(curtain, 0.0, tub.size.z + CURTAIN_GAP_M + curtain.size.z / 2))
    from_end, depth = TUB_ACCESS_M
    return FurnitureGroup(members, [(-half + from_end, tub.size.z, half - from_end, tub.size.z + depth)])


def island_group(rng: np.random.Generator, stools: int, similar_to: AssetModel) -> FurnitureGroup:
    """Return a counter away from walls with stools on one side; it looks like the counter `similar_to`."""
    size = f"{pick(rng, (4, 5, 6))}x{pick(rng, (2, 3))}"
    looks = [asset_model(f"Countertop_{look}_Island_{size}", "CounterTop") for look in range(COUNTER_VARIANTS)]
    counter = most_similar(similar_to, looks)
    stool = draw_model("Stool", rng)
    half_x, half_z = counter.size.x / 2, counter.size.z / 2
    members = [GroupMember(counter, 0.0, half_z, 180.0)]
    for index in range(stools):
        x = (index - (stools - 1) / 2) * max(stool.size.x + STOOL_SPACING_M, half_x * 2 * STOOL_SHARE / max(1, stools))
        members.append(GroupMember(stool, x, counter.size.z + STOOL_GAP_M + stool.size.z / 2, 180.0))
    return FurnitureGroup(members, [(-half_x, -STAND_M - ISLAND_FRONT_M, half_x, 0.0)])


def vanity_group(rng: np.random.Generator) -> FurnitureGroup:
    """Return a small counter with a basin on it."""
    counter = asset_model(f"Countertop_{int(rng.integers(COUNTER_VARIANTS))}_I_{pick(rng, (3, 3, 4))}x2", "CounterTop")
    return FurnitureGroup(
        [GroupMember(counter, 0.0, counter.size.z / 2), *_basin(rng, (0, 1), 0.0, counter.size.z)],
        [(-counter.size.x / 2, counter.size.z, counter.size.x / 2, counter.size.z + VANITY_FRONT_M)],
    )


def _basin(rng: np.random.Generator, numbers: tuple[int, int], x: float, depth: float) -> list[GroupMember]:
    """Return a sink with a faucet at its back, for a counter whose middle is at `x` and whose depth (m) is `depth`.

    `numbers` are the indices of the counter and of the sink among the group's members.
    """
    counter, basin = numbers
    sink, faucet = draw_model("Sink", rng), draw_model("Faucet", rng)
    middle = depth - BASIN_EDGE_M - min(sink.size.z, depth - BASIN_MARGIN_M) / 2
    return [
        GroupMember(sink, x, middle, on=counter),
        GroupMember(faucet, x, middle - sink.size.z / 2 + faucet.size.z / 2, on=basin),
    ]
