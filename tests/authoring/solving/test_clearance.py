"""Room on the floor, and ways that keep some of it."""

import math

import numpy as np
import pytest
import shapely

from vigil.authoring.solving.clearance import CELL_M, MIN_CLEARANCE_M, ClearanceGrid, RoutesTo
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.packs.pack import Pack
from vigil.scene.outlines import thing_shapes
from vigil.scene.things import Thing
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture
def view(starter: Pack, simulator: PrivilegedSimulator) -> PrivilegedView:
    episode = next(episode for episode in starter.episodes if episode.family == "AI")
    simulator.load(starter.house_of(episode))
    simulator.reset(episode.start, episode.setup)
    return PrivilegedView(simulator)


@pytest.fixture
def grid(view: PrivilegedView) -> ClearanceGrid:
    return ClearanceGrid(view.scene)


def things_of(view: PrivilegedView) -> dict[str, Thing]:
    things = view.scene.things
    return {name: thing for name, thing in things.items() if thing.is_present and thing_shapes(thing)}


def test_room_is_what_the_exact_plan_says(view: PrivilegedView, grid: ClearanceGrid) -> None:
    clearances = grid.clearances(things_of(view))
    free = view.plan().roomy
    cells = view.plan().cells[::11]
    assert len(cells) > 50
    at = grid.cells(cells)
    assert (clearances[at[:, 0], at[:, 1]] >= 0.2 + 0.03 - CELL_M).all()
    tight = np.argwhere((clearances > 0.0) & (clearances < 0.15))[::5]
    assert len(tight)
    assert not any(free.contains(point) for point in _points(grid, tight))


def _points(grid: ClearanceGrid, cells: np.ndarray) -> list[shapely.Point]:
    return [shapely.Point(grid.place(cell)) for cell in cells]


def test_what_is_not_known_takes_no_room(view: PrivilegedView, grid: ClearanceGrid) -> None:
    known, bare = grid.clearances(things_of(view)), grid.clearances({})
    assert (known <= bare).all()
    assert (known < bare).any()


def test_a_way_leads_corner_by_corner_to_its_place(view: PrivilegedView, grid: ClearanceGrid) -> None:
    clearances = grid.clearances(things_of(view))
    walks = view.walks()
    far = int(np.argmax(np.where(np.isfinite(walks.lengths), walks.lengths, -1.0)))
    goal = float(walks.plan.cells[far, 0]), float(walks.plan.cells[far, 1])
    routes = RoutesTo(grid, clearances, goal)
    at = view.agent.position.x, view.agent.position.z
    for _ in range(40):
        if math.dist(at, goal) <= CELL_M:
            break
        corner = routes.waypoint(at, clearances)
        assert corner is not None
        cell = grid.cells(np.array([corner]))[0]
        assert clearances[tuple(cell)] >= MIN_CLEARANCE_M or math.dist(corner, goal) <= CELL_M
        at = corner
    assert math.dist(at, goal) <= CELL_M


def test_where_walls_part_two_places_there_is_no_way(view: PrivilegedView, grid: ClearanceGrid) -> None:
    place = view.agent.position.x, view.agent.position.z
    clearances = np.zeros(grid.shape)
    routes = RoutesTo(grid, clearances, (place[0] + 2.0, place[1]))
    assert routes.waypoint(place, clearances) is None
    assert routes.cost_of(place, place, clearances) == math.inf


def test_what_seems_to_stand_elsewhere_takes_room_there(view: PrivilegedView, grid: ClearanceGrid) -> None:
    name, thing = max(things_of(view).items(), key=lambda item: item[1].asset.size.x)
    bare, here = grid.clearances({}), grid.clearances({name: thing})
    near_edge = grid.shape[0] - int(np.argwhere(here < bare)[:, 0].min()) + 3
    for across, up in ((4, 0), (0, -6), (near_edge, 0), (-500, 0), (500, 500)):
        shifted = grid.clearances({name: thing}, {name: (across * CELL_M, up * CELL_M)})
        wanted = bare.copy()
        for x, z in np.argwhere(here < bare):
            if 0 <= x + across < grid.shape[0] and 0 <= z + up < grid.shape[1]:
                wanted[x + across, z + up] = min(wanted[x + across, z + up], here[x, z])
        assert (shifted <= wanted + 1e-9).all()
        assert (shifted < bare).any() == (abs(across) < near_edge)
