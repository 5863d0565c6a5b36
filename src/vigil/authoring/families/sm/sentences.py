"""The sentence forms of Sequential Manipulation (SM), by template (see `vigil.authoring.language.sentences`).

Slots: `target`, `second`, `container`, `source` and `receptacle`, phrases for the things; `target_it`, the pronoun for
the target; `whole`, the thing or part that is opened, `piece`, the same after the thing has been named, and `it`, its
pronoun; `other`, the second thing that is opened; `order_a` and `order_b`, two orders in full; `into` and `in_`, the
words for placing in or on the receptacle. In `CHAINS`, the word for placing on is "onto", because "the cup on the desk"
would be a cup that lies there already.
"""

from vigil.authoring.language.sentences import Sentences

SEQUENCES = {
    "reveal_pick": Sentences(
        public=(
            "Open {whole} and take out {target}.",
            "First open {whole}, then pick up {target}.",
            "Please open {whole} and pick up {target}, which is inside.",
            "{Target} is in {container}. Open {piece} and take {target} out.",
            "I need {target}, so open {whole} and take {target} out.",
        ),
        held_out=(
            "Get {target} from inside {container}: open {piece}, then pick up {target}.",
            "Could you open {whole} and pick up {target}?",
            "To get {target} you have to open {whole}. Do so and take {target} out.",
            "What I want is inside {container}: open {piece} and pick up {target}.",
            "{Target} has to come out of {container}. Open {piece}, then pick up {target}.",
        ),
    ),
    "put_into": Sentences(
        public=(
            "Pick up {target} and put {target_it} {into} {receptacle}.",
            "Take {target}, then put {target_it} {into} {receptacle}.",
            "Please put {target} {into} {receptacle}.",
            "{Target} has to go {into} {receptacle}. Pick {target_it} up and put {target_it} there.",
            "I want {target} to be put {into} {receptacle}.",
        ),
        held_out=(
            "Bring {target} to {receptacle} and put {target_it} in.",
            "Could you fetch {target} and put {target_it} {into} {receptacle}?",
            "Carry {target} over to {receptacle} and put {target_it} in.",
            "First pick up {target}; then put {target_it} {into} {receptacle}.",
            "Get {target} first, then put {target_it} {into} {receptacle}.",
        ),
    ),
    "put_into_closed": Sentences(
        public=(
            "Open {whole}, then pick up {target} and put {target_it} inside.",
            "First open {whole}; then fetch {target} and put {target_it} in there.",
            "Put {target} into {receptacle}. You have to open {piece} first.",
            "Please open {whole}, pick up {target} and put {target_it} inside.",
        ),
        held_out=(
            "I would like {target} to be inside {receptacle}. Open {piece}, then put {target_it} in.",
            "Open {whole} and put {target} inside.",
            "{Target} is to be put into {receptacle}; open {piece} before you do so.",
            "Could you open {whole} and then put {target} in?",
            "Once you have opened {whole}, pick up {target} and put {target_it} inside.",
        ),
    ),
    "rearrange": Sentences(
        public=(
            "Take {target} from {source} and put {target_it} {into} {receptacle}.",
            "Pick up {target} from {source}, then place {target_it} {in_} {receptacle}.",
            "{Target} is on {source}. Put {target_it} {into} {receptacle} instead.",
            "Move {target} from {source} to {receptacle}.",
            "I would like {target}, which is on {source}, to be put {into} {receptacle}.",
        ),
        held_out=(
            "Fetch {target} from {source} and put {target_it} {into} {receptacle}, please.",
            "{Target} should not stay on {source}: put {target_it} {into} {receptacle}.",
            "Go to {source}, pick up {target} and put {target_it} {into} {receptacle}.",
            "Could you bring {target} from {source} to {receptacle}?",
            "{Target} has to be taken from {source} and put {into} {receptacle}.",
        ),
    ),
    "open_pick_place": Sentences(
        public=(
            "Open {whole}, take out {target} and put {target_it} {into} {receptacle}.",
            "First open {whole}, then pick up {target} and place {target_it} {in_} {receptacle}.",
            "{Target} is in {container}. Open {piece}, take {target} out and put {target_it} {into} {receptacle}.",
            "Please get {target} out of {container}, which you have to open, and put {target_it} {into} {receptacle}.",
            "Get {target} from {container}: open {piece}, take {target} out and put {target_it} {into} {receptacle}.",
        ),
        held_out=(
            "Could you open {whole}, pick up {target} and put {target_it} {into} {receptacle}?",
            "Move {target} from {container} to {receptacle}. You have to open {whole} first.",
            "Open {whole}, so that you can take out {target}; then put {target_it} {into} {receptacle}.",
            "I want you to put {target}, which is in {container}, {into} {receptacle}. Open {whole} first.",
            "Take {target} out of {container} once you have opened {piece}, and put {target_it} {into} {receptacle}.",
        ),
    ),
}
"""Template -> its sentence forms. `put_into_closed` is for `put_into` if the receptacle is closed at the start."""

CHAINS = {
    "two_to_one": Sentences(
        public=(
            "Put {target} and {second} {into} {receptacle}.",
            "Please put both {target} and {second} {into} {receptacle}.",
            "First put {target} {into} {receptacle}, then {second} as well.",
            "I need {target} and {second} together: put both {into} {receptacle}.",
            "{Target} and {second} are in the wrong place. Put both {into} {receptacle}.",
        ),
        held_out=(
            "Take {target} and then {second}, and put the two of them {into} {receptacle}.",
            "Could you put {target} {into} {receptacle}, and {second} too?",
            "Gather {target} and {second}. Both go {into} {receptacle}.",
            "One after the other, move {target} and {second} {into} {receptacle}.",
            "{Target} has to go {into} {receptacle}, and so does {second}.",
        ),
    ),
    "put_and_close": Sentences(
        public=(
            "Open {whole}, put {target} inside and close {it} again.",
            "Please open {whole}, put {target} inside, and then shut {it}.",
            "Put {target} into {receptacle}. Open {piece} for that, and close {it} afterwards.",
            "I want {target} to end up inside {receptacle}, with {whole} closed.",
            "{Target} belongs inside {receptacle}. Open {whole}, put {target_it} in, and close {whole} again.",
        ),
        held_out=(
            "Could you put {target} into {receptacle} and close {whole} after that?",
            "Put {target} away into {receptacle}, and leave {whole} closed when you are done.",
            "First open {whole}, then put {target} inside. When that is done, close {whole}.",
            "{Target} should be inside {receptacle} at the end, and {whole} should be closed.",
            "Your task is to open {whole}, to put {target} inside and to close {whole} again.",
        ),
    ),
    "take_and_close": Sentences(
        public=(
            "Open {whole}, take out {target}, put {target_it} {into} {receptacle} and close {whole} again.",
            "Take {target} out of {container} and put {target_it} {into} {receptacle}. Close {whole} afterwards.",
            "{Target} is in {container}. Put {target_it} {into} {receptacle}, and close {whole} again.",
            "Please get {target} out of {container}, put {target_it} {into} {receptacle}, and leave {whole} closed.",
            "First open {whole} and take {target} out. Then put {target_it} {into} {receptacle}, and close {whole} "
            "again.",
        ),
        held_out=(
            "Could you take {target} out of {container}, close {whole} and put {target} {into} {receptacle}?",
            "I need {target}, which is in {container}. Put {target_it} {into} {receptacle}, and do not leave {whole} "
            "open.",
            "Move {target} out of {container} and {into} {receptacle}; {whole} should be closed again at the end.",
            "{Container} holds {target}. Put {target_it} {into} {receptacle}, and see that {whole} is closed again.",
            "Your task is to take {target} out of {container}, to put {target_it} {into} {receptacle} and to close "
            "{whole} again.",
        ),
    ),
    "swap": Sentences(
        public=(
            "{Target} is on {source} and {second} is on {receptacle}. Swap the two.",
            "Swap {target} and {second}, so that {target} is on {receptacle} and {second} is on {source}.",
            "Please move {target} from {source} over to {receptacle}, and {second} from there to {source}.",
            "Could you swap {target} and {second}? {Target} should go onto {receptacle}, {second} onto {source}.",
            "Put {target} onto {receptacle} and {second} onto {source}; they are the wrong way round.",
        ),
        held_out=(
            "Exchange the places of {target} and {second}: {target} goes onto {receptacle}, {second} onto {source}.",
            "{Target} belongs on {receptacle} and {second} belongs on {source}. At the moment it is the other way "
            "round.",
            "I would like {target} where {second} is, and the other way round: {target} goes onto {receptacle}, "
            "{second} onto {source}.",
            "{Target} and {second} have to change places: put {target} onto {receptacle}, and {second} onto {source}.",
            "Each of two things lies where the other belongs: {target} goes onto {receptacle}, and {second} onto "
            "{source}.",
        ),
    ),
    "out_of_into": Sentences(
        public=(
            "Take {target} out of {container} and put {target_it} into {receptacle}. Both are closed.",
            "Open {whole} and {other}, take {target} out of {container} and put {target_it} into {receptacle}.",
            "{Target} is in {container}, but should be inside {receptacle}. Open both and put {target_it} there.",
            "Please get {target} out of {container}, which is closed, and put {target_it} inside {receptacle}, which "
            "is closed as well.",
            "First open {other}, then open {whole}, take {target} out and put {target_it} into {receptacle}.",
        ),
        held_out=(
            "Could you take {target} from {container} and put {target_it} into {receptacle}? You have to open {whole} "
            "and {other}.",
            "I need {target} to be inside {receptacle}. You find {target_it} in {container}, and you have to open "
            "both.",
            "Move {target} out of {container} and into {receptacle}. Neither of the two is open.",
            "From {container}, which is closed, take {target}, and put {target_it} into {receptacle}, which has to be "
            "opened, too.",
            "Your task is to open {whole} and {other}, to take {target} out of {container} and to put {target_it} into "
            "{receptacle}.",
        ),
    ),
    "three_acts": Sentences(
        public=(
            "{Order_a}, {order_b}, and put {target} {into} {receptacle}.",
            "Please {order_a} and {order_b}. Then put {target} {into} {receptacle}.",
            "{Order_a}. Then {order_b}, and at last put {target} {into} {receptacle}.",
            "Could you {order_a}, {order_b} and put {target} {into} {receptacle}?",
            "Put {target} {into} {receptacle}. Before that, {order_a} and {order_b}.",
        ),
        held_out=(
            "Three things: {order_a}, {order_b}, and put {target} {into} {receptacle}.",
            "Before you finish, {order_a}, {order_b} and put {target} {into} {receptacle}.",
            "I would like you to {order_a}, to {order_b} and to put {target} {into} {receptacle}.",
            "First {order_a}, next {order_b}; after that, put {target} {into} {receptacle}.",
            "Put {target} {into} {receptacle}, but first {order_a} and {order_b}.",
        ),
    ),
}
"""Template of a longer sequence -> its sentence forms."""
