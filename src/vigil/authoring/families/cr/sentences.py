"""Sentence forms of CR instructions that state the constraint, by kind, each in two halves (see `sentences`).

The forms ask to move an obstacle aside, not only to pick it up, because a hand that holds it cannot take anything else.
Slots: `order` and `order_it`, the order; `target`, `obstacle` and `blocker`, phrases for the things; `target_it` and
`obstacle_it`, their pronouns; `obstacle_blocks` and `obstacle_stands`, verbs that agree with the obstacle in number;
`whole`, the thing or part that is opened; `it`, the pronoun for `blocker`, or for `whole` in forms without `blocker`.
"""

from vigil.authoring.language.sentences import Sentences

CONSTRAINTS = {
    "obstacle": Sentences(
        public=(
            "{Obstacle} is in the way: pick {obstacle_it} up and put {obstacle_it} aside. Then {order}.",
            "To get through, first move aside {obstacle}, which {obstacle_blocks} the way. Then {order}.",
            "You cannot get past {obstacle}. Move {obstacle_it} out of the way, then {order}.",
            "Clear the way by moving {obstacle} aside, and then {order}.",
            "I would like you to {order}. To get there you have to move {obstacle} out of the way.",
        ),
        held_out=(
            "Please {order}. {Obstacle} is in your way, so move {obstacle_it} aside first.",
            "Your way is blocked by {obstacle}. Pick {obstacle_it} up, put {obstacle_it} somewhere else and {order}.",
            "First move aside {obstacle}, which {obstacle_stands} in your way; then {order}.",
            "So that you can get past, move {obstacle} out of the way. Then {order}.",
            "{Obstacle} has to be moved out of the way before you can {order}. Do both.",
        ),
    ),
    "leaf": Sentences(
        public=(
            "{Blocker} stands open in your way: close {it} first. Then {order}.",
            "First close {blocker}, which stands open and blocks the way. Then {order}.",
            "You cannot get past {blocker} while it stands open. Close {it}, then {order}.",
            "Make way by closing {blocker}, and then {order}.",
            "I would like you to {order}. Close {blocker} first, because it stands in your way.",
        ),
        held_out=(
            "Please {order}. You have to close {blocker} first, since it blocks the way.",
            "{Blocker} has been left open, so that nobody can get past. Close {it} and then {order}.",
            "So that you can get past, shut {blocker}. Then {order}.",
            "Your way is blocked by {blocker}, which stands open. Close {it}; then {order}.",
            "{Blocker} has to be closed before you can get through. After that, {order}.",
        ),
    ),
    "swing": Sentences(
        public=(
            "{Obstacle} keeps {whole} from opening. Move {obstacle_it} out of the way first, then {order}.",
            "First pick up {obstacle}, which {obstacle_stands} right in front of {target}. Then {order}.",
            "{Whole} cannot open because {obstacle} is in the way. Take {obstacle_it} away, then {order}.",
            "Please {order}, but first take away {obstacle}, which {obstacle_stands} in the way.",
            "Take {obstacle} away from {target} and then {order_it}.",
        ),
        held_out=(
            "{Obstacle} stands where {whole} would open. Pick {obstacle_it} up, and then {order}.",
            "There is no room to {order} while {obstacle} is there. Take {obstacle_it} away first, then go ahead.",
            "{Whole} is blocked by {obstacle}. Move {obstacle_it} aside, then {order}.",
            "Before you can {order}, {obstacle} has to be taken away. Do both.",
            "To make room in front of {target}, pick up {obstacle}. Then {order}.",
        ),
    ),
    "close_first": Sentences(
        public=(
            "{Target} does not start while it is open. Close it first, then {order_it}.",
            "Close {target}, which does not run while open, and then {order_it}.",
            "{Target} has been left open. Shut it, and then {order_it}.",
            "Get {target} running: close it first, because it does not start while open.",
            "Please {order}. It runs only when it is closed, so close it first.",
        ),
        held_out=(
            "I would like {target} to run. Shut it, because it does not start while open, and then {order_it}.",
            "First close {target}, then {order_it}: while open it does not start.",
            "{Target} stands open and cannot be started like that. Close it and {order_it}.",
            "So that {target} can start, close it. Then {order_it}.",
            "Could you {order}? You have to close it before that.",
        ),
    ),
    "stop_first": Sentences(
        public=(
            "{Target} does not open while it is running. Turn it off first, then {order_it}.",
            "Switch off {target}, which stays locked while it runs, and then {order_it}.",
            "{Target} is still running. Stop it, and then {order_it}.",
            "I need {target} open, but it is locked while it runs: switch it off, then {order_it}.",
            "Please {order}. It stays locked while it runs, so turn it off first.",
        ),
        held_out=(
            "I would like {target} to be open. Turn it off, because it stays locked while it runs, and then "
            "{order_it}.",
            "First switch off {target}, then {order_it}: while it runs it stays locked.",
            "{Target} is running and cannot be opened like that. Switch it off and {order_it}.",
            "So that {target} can be opened, stop it. Then {order_it}.",
            "Could you {order}? You have to turn it off before that.",
        ),
    ),
    "hand": Sentences(
        public=(
            "Your hand is full: put {obstacle} down first. Then {order}.",
            "Put down {obstacle}, which you are holding. Then {order}.",
            "You are holding {obstacle}. Put {obstacle_it} down and {order} instead.",
            "Free your hand by putting down {obstacle}, and then {order}.",
            "I would like you to {order}. Put down {obstacle} first, so that your hand is free.",
        ),
        held_out=(
            "Please {order}. Your hand still holds {obstacle}, so put {obstacle_it} down before that.",
            "First put {obstacle} down somewhere; then {order}.",
            "With {obstacle} in your hand you can pick up nothing else. Put {obstacle_it} down and {order}.",
            "Let go of {obstacle}, and {order} instead.",
            "{Obstacle} has to be put down before you can {order}. Do both.",
        ),
    ),
}
"""Kind of constraint -> forms of instructions that state the constraint."""
