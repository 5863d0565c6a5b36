"""The sentence forms of sequences (SM), by template, each in two halves (see `sentences`).

Slots: `target`, `container`, `source` and `receptacle`, phrases for the things; `target_it`, the pronoun for the
target; `whole`, what is opened, and `piece`, the same after the thing has been named; `into` and `in_`, the words for
placing in or on the receptacle.
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
            "{Target} is to be put {into} {receptacle}. Get {target_it} first.",
        ),
    ),
    "put_into_closed": Sentences(
        public=(
            "Open {whole}, then pick up {target} and put {target_it} inside.",
            "First open {whole}; then fetch {target} and put {target_it} in there.",
            "Put {target} into {receptacle}. You have to open {piece} first.",
            "Please open {whole}, pick up {target} and put {target_it} inside.",
            "{Target} has to go into {receptacle}, so open {piece} first.",
        ),
        held_out=(
            "I would like {target} to be inside {receptacle}. Open {piece}, then put {target_it} in.",
            "Open {whole} and put {target} inside.",
            "{Target} is to be put into {receptacle}; open {piece} before you fetch {target_it}.",
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
            "{Target} is to be moved from {container} to {receptacle}. Open {whole} first.",
            "Open {whole}, so that you can take out {target}; then put {target_it} {into} {receptacle}.",
            "I want {target}, which is in {container}, to be put {into} {receptacle}. Open {whole} first.",
            "Take {target} out of {container} once you have opened {piece}, and put {target_it} {into} {receptacle}.",
        ),
    ),
}
"""Template -> its sentence forms; `put_into_closed` is for `put_into` with a receptacle that is closed at the start."""
