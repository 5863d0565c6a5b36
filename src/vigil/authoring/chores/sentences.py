"""The sentence forms of lists of chores (see `vigil.authoring.language.sentences`).

Each sentence stands on a line of its own. It asks for how things are at the end, not for an order of acts.
"""

from vigil.authoring.closure.kinds.already.tasks import MAKE_SURE as SURE
from vigil.authoring.closure.kinds.if_so.tasks import IF_SO as CONDITIONS
from vigil.authoring.closure.kinds.out_of_sight.tasks import PUT_AWAY as AWAY
from vigil.authoring.language.sentences import Sentences

OPENINGS = Sentences(
    public=(
        "Here is what needs to be done in this home. Choose the order yourself; what counts is how things are in the "
        "end.",
        "Please see to the following. The order is up to you, but all of it should be so when you are done.",
        "This is my list for today. It is in no particular order; everything on it should hold once you have finished.",
        "There are a few things to see to. They are not in order. At the end, all of them should be as I ask.",
    ),
    held_out=(
        "These are the chores. Do them in whatever order works; only the result matters.",
        "I have written down what I want done. The order on the list means nothing; the state at the end does.",
        "Work through this list in an order that suits you, so that all of it is true when you stop.",
    ),
)
PUT_ON_ORDERS = Sentences(
    public=(
        "Put {target} on {receptacle}.",
        "Take {target} and put {it} on {receptacle}.",
        "{Target} belongs on {receptacle}.",
        "{Target} should end up on {receptacle}.",
        "Please fetch {target} and put {it} on {receptacle}.",
    ),
    held_out=(
        "Pick up {target} and put {it} on {receptacle}.",
        "I want {target} on {receptacle}.",
        "Find {target} and set {it} down on {receptacle}.",
    ),
)
PUT_INTO_ORDERS = Sentences(
    public=(
        "Put {target} into {receptacle}.",
        "Take {target} and put {it} into {receptacle}.",
        "{Target} belongs inside {receptacle}.",
        "{Target} should end up inside {receptacle}.",
        "Please fetch {target} and put {it} into {receptacle}.",
    ),
    held_out=(
        "Pick up {target} and put {it} into {receptacle}.",
        "I want {target} inside {receptacle}.",
        "Find {target} and put {it} into {receptacle}.",
    ),
)
ACT_ORDERS = Sentences(
    public=("{Order}.", "Please {order}.", "{Acted} has to be {done}.", "{Acted} should be {done}."),
    held_out=("I would like you to {order}.", "{Acted} is to be {done}.", "You also have to {order}."),
)
MAKE_SURE = Sentences(
    public=SURE,
    held_out=("{Whole} should be {label}.", "I want {whole} to be {label}.", "At the end, {whole} has to be {label}."),
)
EVERY_DRAWER = "every drawer of"
"""Words in a sentence that mean all drawers of the furniture that is named next."""
CLOSE_EVERY_DRAWER = Sentences(
    public=(
        "Close every drawer of {whole}.",
        "Please shut every drawer of {whole}.",
        "Make sure that every drawer of {whole} is fully closed.",
        "Every drawer of {whole} has to be closed.",
    ),
    held_out=("I want every drawer of {whole} to be closed.", "At the end, every drawer of {whole} should be closed."),
)
QUESTIONS = Sentences(
    public=(
        "Find out whether {whole} is {one} or {other}.",
        "I would like to know whether {whole} is {one} or {other}.",
        "Without touching {it}, check whether {whole} is {one} or {other}.",
        "Is {whole} {one} or {other}? Leave {it} as it is.",
    ),
    held_out=(
        "Have a look at {whole}: is it {one} or {other}? Do not change that.",
        "Tell me whether {whole} is {one} or {other}; do not touch {it}.",
    ),
)
IF_SO = Sentences(
    public=CONDITIONS,
    held_out=("If {whole} is {label}, {order_it}; if it is not, {other}.",),
)
IF_AT_FIRST = Sentences(
    public=(
        "If {whole} was {label} when you began, {order}; otherwise {other}.",
        "Check how {whole} is before anything changes it: if it is {label}, {order}; if not, {other}.",
        "Was {whole} {label} at the very beginning? If so, {order}. If not, {other}.",
    ),
    held_out=("Should {whole} have been {label} at the start, {order}. Otherwise, {other}.",),
)
PUT_AWAY = Sentences(
    public=AWAY,
    held_out=("{Target} should be inside {receptacle}, and {whole} should be closed.",),
)
