"""Sentences of the longer sequences: two things to one place, putting back to rights, swapping, several acts.

What is put on something goes "onto" it: "the cup on the desk" would be a cup that lies there already.
"""

CHAINS: dict[str, tuple[str, ...]] = {
    "two_to_one": (
        "Put {target} and {second} {into} {receptacle}.",
        "Please put both {target} and {second} {into} {receptacle}.",
        "Take {target} and then {second}, and put the two of them {into} {receptacle}.",
        "First put {target} {into} {receptacle}, then {second} as well.",
        "Could you put {target} {into} {receptacle}, and {second} too?",
        "I need {target} and {second} together: put both {into} {receptacle}.",
        "Gather {target} and {second}. Both go {into} {receptacle}.",
        "One after the other, move {target} and {second} {into} {receptacle}.",
        "{Target} and {second} are in the wrong place. Put both {into} {receptacle}.",
    ),
    "put_and_close": (
        "Open {whole}, put {target} inside and close {it} again.",
        "Put {target} into {receptacle}. Open {whole} for that, and close {it} afterwards.",
        "Please open {whole}, put {target} inside, and then shut {it}.",
        "I want {target} to end up inside {receptacle}. Close {whole} once it is in.",
        "Put {target} away: it goes into {receptacle}. Leave {whole} closed when you are done.",
        "Could you put {target} into {receptacle} and close {whole} after that?",
        "{Target} belongs inside {receptacle}. Open {whole}, put it in and close {whole} again.",
        "First open {whole}, then put {target} inside. When that is done, close {whole}.",
    ),
    "take_and_close": (
        "Open {whole}, take out {target}, put it {into} {receptacle} and close {whole} again.",
        "Take {target} out of {container} and put it {into} {receptacle}. Close {whole} afterwards.",
        "Please get {target} out of {container}, put it {into} {receptacle}, and leave {whole} closed.",
        "{Target} is in {container}. Put it {into} {receptacle}, and close {whole} again.",
        "Could you take {target} out of {container}, close {whole} and put {target} {into} {receptacle}?",
        "I need {target}, which is in {container}. Put it {into} {receptacle}, and do not leave {whole} open.",
        "First open {whole} and take {target} out. Then put it {into} {receptacle}, and close {whole} again.",
        "Move {target} from {container} {into} {receptacle}; {whole} should be closed again at the end.",
    ),
    "swap": (
        "{Target} is on {source} and {second} is on {receptacle}. Swap the two.",
        "Swap {target} and {second}, so that {target} is on {receptacle} and {second} is on {source}.",
        "Exchange the places of {target} and {second}: {target} goes onto {receptacle}, {second} onto {source}.",
        "Please move {target} from {source} onto {receptacle}, and {second} from {receptacle} onto {source}.",
        "{Target} belongs onto {receptacle} and {second} onto {source}. At the moment it is the other way round.",
        "Could you swap {target} and {second}? {Target} should go onto {receptacle}, {second} onto {source}.",
        "I would like {target} where {second} is, and the other way round: {target} goes onto {receptacle}, {second} "
        "onto {source}.",
        "Put {target} onto {receptacle} and {second} onto {source}; they are the wrong way round.",
    ),
    "out_of_into": (
        "Take {target} out of {container} and put it into {receptacle}. Both are closed.",
        "Open {whole} and {other}, and move {target} from {container} into {receptacle}.",
        "{Target} is in {container}, but it should be inside {receptacle}. Open both and put it there.",
        "Please get {target} out of {container}, which is closed, and put it inside {receptacle}, which is closed as "
        "well.",
        "Could you take {target} from {container} and put it into {receptacle}? You have to open {whole} and {other}.",
        "First open {other}, then open {whole}, take {target} out and put it into {receptacle}.",
        "I need {target} to be inside {receptacle}. It is in {container} now, and you have to open both.",
        "Move {target} from {container} into {receptacle}. Neither of the two is open.",
    ),
    "three_acts": (
        "{Order_a}, {order_b}, and put {target} {into} {receptacle}.",
        "Three things: {order_a}, {order_b}, and put {target} {into} {receptacle}.",
        "Please {order_a} and {order_b}. Then put {target} {into} {receptacle}.",
        "{Order_a}. Then {order_b}, and at last put {target} {into} {receptacle}.",
        "Could you {order_a}, {order_b} and put {target} {into} {receptacle}?",
        "Before you finish, {order_a}, {order_b} and put {target} {into} {receptacle}.",
        "Put {target} {into} {receptacle}. Before that, {order_a} and {order_b}.",
        "I would like you to {order_a}, to {order_b} and to put {target} {into} {receptacle}.",
    ),
}
"""Template -> its sentences."""
