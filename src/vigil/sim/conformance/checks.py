"""The list of checks that every simulator backend must pass, in the reference house.

Each check takes a `Harness` (`vigil.sim.conformance.harness`). It raises AssertionError, which says what was expected
and what was found. Checks use a backend only through `vigil.sim.protocol` and `vigil.sim.privileged`. A check's
docstring says what it requires.
"""

from collections.abc import Callable

from vigil.sim.conformance import handling, moving, privileged, seeing, single_drawers
from vigil.sim.conformance.harness import Harness

ConformanceCheck = Callable[[Harness], None]

CHECKS: tuple[ConformanceCheck, ...] = (
    moving.walks_whole_steps_then_the_fraction,
    moving.stops_at_a_wall,
    moving.caps_long_actions,
    moving.turns_by_any_angle,
    moving.clamps_the_pitch,
    moving.doors_stop_and_let_through,
    moving.open_leaves_are_obstacles,
    moving.things_block_by_their_parts,
    moving.knows_where_the_body_fits,
    moving.touching_is_no_trap,
    handling.reaches_a_metre_and_a_half,
    handling.picks_and_places_where_clicked,
    handling.refuses_with_the_reason,
    handling.places_beside_what_is_in_the_way,
    handling.stacks_and_counts_supports,
    handling.drops_straight_down,
    handling.opens_and_closes,
    handling.leaves_stop_at_what_is_in_the_way,
    handling.doors_open_and_close,
    single_drawers.open_one_by_one,
    single_drawers.hold_their_own_things,
    single_drawers.stop_at_what_is_in_the_way,
    single_drawers.are_seen_as_part_of_their_furniture,
    single_drawers.move_with_their_furniture,
    handling.appliances_interlock,
    handling.contents_move_along,
    handling.switches_change_the_state,
    seeing.counts_visible_pixels,
    seeing.counts_what_hides_a_thing,
    seeing.counts_state_pixels,
    seeing.sees_through_glass_but_clicks_it,
    seeing.clicks_agree_with_pixels,
    seeing.says_where_things_are,
    seeing.draws_frames,
    seeing.resets_exactly,
    seeing.repeats_itself,
    seeing.applies_setups,
    seeing.refuses_impossible_setups,
    privileged.keeps_the_privileged_protocol,
    privileged.shows_the_scene_as_it_is,
    privileged.finds_the_room_of_a_place,
    privileged.lists_pixels_in_the_frame,
    privileged.sees_from_anywhere,
    privileged.may_show_what_it_shows,
    privileged.rolls_back,
    privileged.moves_the_agent_temporarily,
    privileged.refuses_unknown_ids,
    privileged.needs_a_house,
)
