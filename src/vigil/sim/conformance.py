"""The checks that every simulator backend must pass, in the trial house.

Each check takes a `Trial` (`vigil.sim.trial`) and raises AssertionError with what was expected and found. They speak
to a backend through `vigil.sim.protocol` alone.
"""

from collections.abc import Callable

from vigil.sim import checks_handling, checks_moving, checks_seeing
from vigil.sim.trial import Trial

Check = Callable[[Trial], None]

CHECKS: tuple[Check, ...] = (
    checks_moving.walks_whole_steps_then_the_fraction,
    checks_moving.stops_at_a_wall,
    checks_moving.caps_long_actions,
    checks_moving.turns_by_any_angle,
    checks_moving.clamps_the_pitch,
    checks_moving.doors_stop_and_let_through,
    checks_moving.open_leaves_are_obstacles,
    checks_moving.things_block_by_their_parts,
    checks_moving.knows_where_the_body_fits,
    checks_moving.touching_is_no_trap,
    checks_handling.reaches_a_metre_and_a_half,
    checks_handling.picks_and_places_where_clicked,
    checks_handling.refuses_with_the_reason,
    checks_handling.places_beside_what_is_in_the_way,
    checks_handling.stacks_and_counts_supports,
    checks_handling.drops_straight_down,
    checks_handling.opens_and_closes,
    checks_handling.inside_and_on_top_are_places_of_their_own,
    checks_handling.leaves_stop_at_what_is_in_the_way,
    checks_handling.doors_open_and_close,
    checks_handling.drawers_carry_their_contents,
    checks_handling.appliances_interlock,
    checks_handling.contents_move_along,
    checks_handling.switches_change_the_state,
    checks_seeing.counts_visible_pixels,
    checks_seeing.counts_what_hides_a_thing,
    checks_seeing.counts_state_pixels,
    checks_seeing.sees_through_glass_but_clicks_it,
    checks_seeing.clicks_agree_with_pixels,
    checks_seeing.says_where_things_are,
    checks_seeing.draws_frames,
    checks_seeing.resets_exactly,
    checks_seeing.repeats_itself,
    checks_seeing.applies_setups,
    checks_seeing.refuses_impossible_setups,
)
