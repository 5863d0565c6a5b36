"""The sentence forms of the longer sequences (SM), by template, each in two halves (see `sentences`).

The word for placing is "onto": "the cup on the desk" would be a cup that lies there already. Slots: those of
`sequence_sentences`; `second`, the second object that is moved; `other`, what is opened second; `it`, the pronoun for
`whole`; `order_a` and `order_b`, two orders in full.
"""

from vigil.authoring.language.sentences import Sentences

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
            "{Target} has to go {into} {receptacle}, but first {order_a} and {order_b}.",
        ),
    ),
}
"""Template -> its sentence forms."""
