"""Furniture groups: a bed with side tables, a desk with its chair, a sofa with its table, a kitchen run, ..."""

import numpy as np

from vigil.housegen.base.models import AssetModel, Rect, draw_model, model_of, most_alike, turned_rect
from vigil.housegen.base.randomness import chance, pick
from vigil.housegen.furnishing.clusters import STAND_M, Cluster, Member, front_access

COUNTER_LOOKS = 12
"""Looks of counters that the generator draws from."""
COUNTER_DEPTH = 0.61
RUN_GAP = 0.01
SEAT_GAP = 0.06
"""Distance between a chair and the table it stands at."""
PULL_M = 0.2
"""Floor behind a dining chair to pull it back."""
RUG_SHARE = 0.5
"""Share of beds with a rug at their foot, where it fits."""
SEAT_ROOM = 0.3
"""Floor behind a chair to sit down."""


def bed_group(rng: np.random.Generator, tables: int) -> Cluster:
    """Returns a bed with its head to the wall and up to two side tables of one kind."""
    bed, table = draw_model("Bed", rng), draw_model("SideTable", rng)
    members = [Member(bed, 0.0, bed.size.z / 2)]
    side = pick(rng, (-1, 1))
    access: list[Rect] = []
    for index in range(tables):
        sign = side if index == 0 else -side
        x = sign * (bed.size.x / 2 + 0.06 + table.size.x / 2)
        members.append(Member(table, x, table.size.z / 2))
        depth = front_access(table)
        access.append((x - table.size.x / 2, table.size.z, x + table.size.x / 2, table.size.z + depth))
    half = bed.size.x / 2
    rug = draw_model("Rug", rng)
    if chance(rng, RUG_SHARE) and rug.size.x / 2 <= half + (table.size.x if tables == 2 else 0.0):
        members.append(Member(rug, 0.0, bed.size.z - 0.25))
    edge = side * half if tables else half
    access.append((min(edge, edge + side * 0.5), 0.9, max(edge, edge + side * 0.5), bed.size.z - 0.2))
    return Cluster(members, access)


def desk_group(rng: np.random.Generator) -> Cluster:
    """Returns a desk against the wall with a chair before it."""
    desk, chair = draw_model("Desk", rng), draw_model("Chair", rng)
    z = desk.size.z + SEAT_GAP + chair.size.z / 2
    back = desk.size.z + SEAT_GAP + chair.size.z
    half = desk.size.x / 2
    access: list[Rect] = [(-chair.size.x / 2, back, chair.size.x / 2, back + SEAT_ROOM)]
    offset = 0.0
    if desk.asset.can_open:
        side = _drawer_side(desk)
        offset = -side * max(0.0, half - chair.size.x / 2 - 0.05)
        zone = (0.1, half) if side > 0 else (-half, -0.1)
        access = [(zone[0], desk.size.z, zone[1], desk.size.z + front_access(desk))]
    return Cluster([Member(desk, 0.0, desk.size.z / 2), Member(chair, offset, z, 180.0)], access)


def _drawer_side(desk: AssetModel) -> int:
    """Returns on which side (+1: +x) the desk's drawers are."""
    joints = {joint.name for joint in desk.asset.joints}
    xs = [x for solid in desk.asset.solids if solid.joint in joints for x, _ in solid.polygon]
    return 1 if not xs or float(np.mean(xs)) >= 0 else -1


def sofa_group(rng: np.random.Generator, with_table: bool, with_chair: bool, with_rug: bool) -> Cluster:
    """Returns a sofa with its back to the wall, maybe a coffee table before it, an armchair at its side and a rug."""
    sofa = draw_model("Sofa", rng)
    members = [Member(sofa, 0.0, sofa.size.z / 2)]
    half = sofa.size.x / 2
    access: list[Rect] = [(-half, sofa.size.z, half, sofa.size.z + 0.4)]
    ahead = sofa.size.z + 0.42
    if with_table:
        table = draw_model("CoffeeTable", rng)
        members.append(Member(table, 0.0, ahead + table.size.z / 2))
        ahead += table.size.z
    if with_chair:
        chair = draw_model("ArmChair", rng)
        side = pick(rng, (-1, 1))
        x = side * (half + 0.25 + chair.size.z / 2)
        members.append(Member(chair, x, sofa.size.z + 0.3 + chair.size.x / 2, -90.0 * side))
    if with_rug:
        rug = draw_model("Rug", rng)
        members.append(Member(rug, 0.0, sofa.size.z + 0.05 + rug.size.z / 2))
    return Cluster(members, access)


def media_group(rng: np.random.Generator) -> Cluster:
    """Returns a TV stand against the wall with the television on it."""
    stand = draw_model("TVStand", rng)
    wide = [model_of(f"vigil_Television_{number}", "Television") for number in range(24)]
    fitting = [screen for screen in wide if screen.size.x <= stand.size.x + 0.1 and screen.size.z <= stand.size.z]
    screen = pick(rng, fitting or wide)
    half = stand.size.x / 2
    access: list[Rect] = [(-half, stand.size.z, half, stand.size.z + front_access(stand))]
    return Cluster([Member(stand, 0.0, stand.size.z / 2), Member(screen, 0.0, stand.size.z / 2 - 0.02, on=0)], access)


def dining_group(rng: np.random.Generator, chairs: int, at_wall: bool) -> Cluster:
    """Returns a table with chairs of one kind around it; at a wall its back side stays empty."""
    table, chair = draw_model("DiningTable", rng), draw_model("Chair", rng)
    half_x, half_z = table.size.x / 2, table.size.z / 2
    out = SEAT_GAP + chair.size.z / 2
    along = half_x / 2 if half_x * 2 > 1.25 else 0.0
    front = [(-along, half_z + out, 180.0), (along, half_z + out, 180.0)] if along else [(0.0, half_z + out, 180.0)]
    back = [] if at_wall else [(x, -z, 0.0) for x, z, _ in front]
    ends = [(half_x + out, 0.0, 270.0), (-half_x - out, 0.0, 90.0)]
    seats = [*front, *back, *ends] if at_wall or chance(rng, 0.7) else [*ends, *front, *back]
    rise = half_z
    members = [Member(table, 0.0, rise)]
    members.extend(Member(chair, x, z + rise, yaw) for x, z, yaw in seats[:chairs])
    half = chair.size.x / 2
    behind = (-half, -chair.size.z / 2 - PULL_M, half, -chair.size.z / 2)
    return Cluster(members, open=[turned_rect(behind, x, z + rise, yaw) for x, z, yaw in seats[:chairs]])


def kitchen_run(rng: np.random.Generator, with_fridge: bool, feet: tuple[int, ...]) -> Cluster:
    """Returns a run along a wall: alike counters of a width (ft) with the stove between, maybe the fridge at an end."""
    stove, look = draw_model("Stove", rng), int(rng.integers(COUNTER_LOOKS))
    counters = [model_of(f"Countertop_{look}_I_{width}x2", "CounterTop") for width in feet]
    row: list[AssetModel] = [counters[0], stove, *counters[1:]]
    if chance(rng, 0.5):
        row.reverse()
    if with_fridge:
        fridge = draw_model("Fridge", rng)
        row = [fridge, *row] if chance(rng, 0.5) else [*row, fridge]
    return _run(rng, row)


def corner_run(rng: np.random.Generator, with_fridge: bool, feet: int) -> Cluster:
    """Returns an L-shaped counter (leg on the +x side) with the stove beside it, maybe the fridge beside that."""
    counter = model_of(f"Countertop_{int(rng.integers(COUNTER_LOOKS))}_L_{feet}x{feet}", "CounterTop")
    row = [draw_model("Stove", rng), counter]
    return _run(rng, [draw_model("Fridge", rng), *row] if with_fridge else row)


def _run(rng: np.random.Generator, row: list[AssetModel]) -> Cluster:
    """Returns things side by side along a wall, a sink in the first counter."""
    left = -(sum(model.size.x for model in row) + RUN_GAP * (len(row) - 1)) / 2
    members: list[Member] = []
    access: list[Rect] = []
    basins: list[Member] = []
    for index, model in enumerate(row):
        middle, right = left + model.size.x / 2, left + model.size.x
        members.append(Member(model, middle, model.size.z / 2))
        depth = min(model.size.z, COUNTER_DEPTH) if model.category == "CounterTop" else model.size.z
        if model.category == "CounterTop":
            if not basins:
                basins = _basin(rng, index, middle, depth)
            right = min(right, right + depth - model.size.z)
        access.append((left, depth, right, depth + max(0.8, front_access(model))))
        left += model.size.x + RUN_GAP
    return Cluster([*members, *basins], access)


def bathtub_group(rng: np.random.Generator) -> Cluster:
    """Returns a bathtub lengthwise along the wall."""
    tub = draw_model("Bathtub", rng)
    half = tub.size.x / 2
    members = [Member(tub, 0.0, tub.size.z / 2)]
    curtain = draw_model("ShowerCurtain", rng)
    if chance(rng, 0.35) and curtain.size.x <= tub.size.x:
        members.append(Member(curtain, 0.0, tub.size.z + 0.01 + curtain.size.z / 2))
    return Cluster(members, [(-half + 0.3, tub.size.z, half - 0.3, tub.size.z + 0.6)])


def island_group(rng: np.random.Generator, stools: int, like: AssetModel) -> Cluster:
    """Returns a free-standing counter much like another one, with stools on one side."""
    size = f"{pick(rng, (4, 5, 6))}x{pick(rng, (2, 3))}"
    looks = [model_of(f"Countertop_{look}_Island_{size}", "CounterTop") for look in range(COUNTER_LOOKS)]
    counter = most_alike(like, looks)
    stool = draw_model("Stool", rng)
    half_x, half_z = counter.size.x / 2, counter.size.z / 2
    members = [Member(counter, 0.0, half_z, 180.0)]
    for index in range(stools):
        x = (index - (stools - 1) / 2) * max(stool.size.x + 0.2, half_x * 1.2 / max(1, stools))
        members.append(Member(stool, x, counter.size.z + 0.05 + stool.size.z / 2, 180.0))
    return Cluster(members, [(-half_x, -STAND_M - 0.4, half_x, 0.0)])


def vanity_group(rng: np.random.Generator) -> Cluster:
    """Returns a small counter with a basin on it and a faucet behind the basin."""
    counter = model_of(f"Countertop_{int(rng.integers(COUNTER_LOOKS))}_I_{pick(rng, (3, 3, 4))}x2", "CounterTop")
    return Cluster(
        [Member(counter, 0.0, counter.size.z / 2), *_basin(rng, 0, 0.0, counter.size.z)],
        [(-counter.size.x / 2, counter.size.z, counter.size.x / 2, counter.size.z + 0.7)],
    )


def _basin(rng: np.random.Generator, index: int, x: float, depth: float) -> list[Member]:
    """Returns a sink with its faucet for the counter that is member `index`: its middle, and its depth."""
    sink, faucet = draw_model("Sink", rng), draw_model("Faucet", rng)
    return [
        Member(sink, x, depth - 0.02 - min(sink.size.z, depth - 0.06) / 2, on=index),
        Member(faucet, x, 0.02 + faucet.size.z / 2, on=index),
    ]
