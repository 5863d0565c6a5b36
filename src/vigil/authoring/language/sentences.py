"""The sentence forms of the families with one object, in two halves: a public one and a held-out one.

Packaged packs, recipes and streams use only the public half, so that private packs can use forms that are not
published. Both halves vary in the same ways: questions, requests, statements of a need, two sentences, purposes, the
passive. The forms of sequences and constraints are in `sequence_sentences`, `chain_sentences` and
`constraint_sentences`.

Slots: `target`, the phrase for the thing; `it` and `it_is`, its pronoun; `order`, an act in full; `order_it`, the act
after the thing has been named; `acted` and `done`, the act in the passive. A slot with a capital starts a sentence.
"""

from dataclasses import dataclass
from typing import Literal, get_args

Forms = Literal["public", "held_out", "all"]
"""Half of the sentence forms, or all of them."""
FORMS: tuple[Forms, ...] = get_args(Forms)


@dataclass(frozen=True, slots=True)
class Sentences:
    """Sentence forms with one meaning, in two halves."""

    public: tuple[str, ...]
    held_out: tuple[str, ...]

    def of(self, forms: Forms) -> tuple[str, ...]:
        """Return the forms of a half, or all of them."""
        halves = {"public": self.public, "held_out": self.held_out, "all": (*self.public, *self.held_out)}
        return halves[forms]


POINT = Sentences(
    public=(
        "Point at {target}.",
        "Where is {target}? Point at {it}.",
        "Show me {target} by pointing at {it} in the picture.",
        "I am looking for {target}. Point {it} out to me.",
        "Please point to {target}.",
        "Which of the things that you see is {target}? Point at {it}.",
        "In the picture, mark {target}.",
        "I need to know where {target} is: point at {it}.",
        "Put your pointer on {target}, so that I can see what you take for {it}.",
        "Your task is to point at {target}.",
        "{Target} is in the picture. Point at {it}.",
        "Someone has asked for {target}. Point at {it}, please.",
        "Could you point at {target}?",
        "Show where {target} is by pointing at {it}.",
        "{Target} should be marked in the picture. Please do that.",
    ),
    held_out=(
        "Put your pointer on {target}.",
        "Can you see {target}? Point at {it}.",
        "Indicate where {target} is.",
        "Would you point {target} out to me?",
        "Look at the picture and point at {target}.",
        "I want you to point at {target}.",
        "In the picture, find {target} and put your pointer on {it}.",
        "{Target} is to be pointed at, and nothing else.",
        "So that I know where {target} is, point at {it}.",
        "There is something I need you to point at: {target}.",
        "Select {target} by pointing at {it}.",
        "If I asked you for {target}, where would you point? Show me.",
        "{Target} is what I am after. Please point at {it}.",
        "Single out {target} by pointing at {it}.",
        "Help me to find {target}: point at {it} in the picture.",
    ),
)

APPROACH = Sentences(
    public=(
        "Walk up to {target}: come to within about one and a half metres of {it}, near enough to touch {it}, and stop "
        "there.",
        "Go and stand within about one and a half metres of {target}, so that you could reach out and touch {it}.",
        "Approach {target} until you are within about one and a half metres of {it}, so near that you could touch "
        "{it}.",
        "Move to within about one and a half metres of {target}, which is near enough to touch {it}.",
        "Get closer to {target}. Stop once you are within about one and a half metres of {it} and could touch {it}.",
        "Please go over to {target} and halt where you could touch {it}, within about one and a half metres of {it}.",
        "I want you to be within about one and a half metres of {target}, close enough to touch {it}.",
        "Go to {target}. You are there when you are within about one and a half metres of {it} and could touch {it}.",
        "{Target} should be within your reach: walk to within about one and a half metres of {it}.",
        "Your task is to stand within about one and a half metres of {target}, where you could touch {it}.",
        "Could you walk over to {target}? Stop within about one and a half metres of {it}, where your hand could reach "
        "{it}.",
        "I need you to be within reach of {target}: anywhere within about one and a half metres of {it} will do.",
        "Go to {target}, but leave {it} alone: just stand within about one and a half metres of {it}, within reach.",
        "Leave your place and come within about one and a half metres of {target}, so near that you could touch {it}.",
        "From where you stand {target} is out of reach. Go nearer, to within about one and a half metres of {it}.",
    ),
    held_out=(
        "Come to within about one and a half metres of {target}, near enough to touch {it}, then stop.",
        "Stand so near {target} that you could touch {it}, no farther than about one and a half metres from {it}.",
        "Walk until you are no farther than about one and a half metres from {target} and could touch {it}.",
        "Bring yourself within reach of {target}, no farther than about one and a half metres from {it}.",
        "I would like you to go as near to {target} as it takes to touch {it}, within about one and a half metres of "
        "{it}.",
        "Please get within reach of {target}: no farther than about one and a half metres from {it}.",
        "Go up to {target} so that you could touch {it} if you wanted to; within about one and a half metres of {it} "
        "is near enough.",
        "Head for {target} and stop within about one and a half metres of {it}, where you could touch {it}.",
        "{Target} is where I want you to go. Stop no farther than about one and a half metres from {it}, within reach.",
        "Someone is waiting at {target}. Go there, to within about one and a half metres of {it}, so that you could "
        "touch {it}.",
        "Keep going until you are within about one and a half metres of {target}, near enough to touch {it}.",
        "Would you go to {target} and stay there, no farther than about one and a half metres from {it}, within reach?",
        "You are too far from {target} to touch {it}. Change that: come within about one and a half metres of {it}.",
        "Reduce the distance to {target} until you could touch {it}, to within about one and a half metres of {it}.",
        "A place within about one and a half metres of {target}, from which you could touch {it}, is where I want you.",
    ),
)

SEARCH = Sentences(
    public=(
        "Find {target}. You are done once {it_is} in the picture.",
        "Look around for {target} until you can see {it} in the picture.",
        "Search for {target} and bring {it} into the picture.",
        "Where is {target}? Look for {it} until {it_is} in view.",
        "I cannot find {target}. Have a look around until you see {it}.",
        "Please locate {target}; you are done when {it_is} in the picture.",
        "Turn and walk until {target} is in the picture.",
        "{Target} is out of sight from here. Look for {it} until you see {it}.",
        "Your task is to get {target} into view.",
        "I would like to see {target}: keep looking until {it_is} in the picture.",
        "Could you look for {target}? Stop as soon as {it_is} in view.",
        "Explore until you come upon {target} and have {it} in the picture.",
        "I need to see {target}. Find {it}.",
        "Look for {target}, so that {it_is} in your view at the end.",
        "Go wherever you must, and stop when you see {target}.",
    ),
    held_out=(
        "Go looking for {target}; stop when you see {it}.",
        "Search the home until {target} is in the picture.",
        "Let me see {target}: find {it} and get {it} into the picture.",
        "Have you seen {target}? Look for {it}, and stop once you have {it} in view.",
        "{Target} has to be found. That is done when {it_is} in the picture.",
        "Somebody has lost sight of {target}. Find {it}, so that {it_is} in the picture again.",
        "Look around, in other places if need be, until you see {target}.",
        "Bring {target} into view; nothing needs to be touched.",
        "I wonder where {target} is. Walk about until {it_is} in your picture.",
        "Would you find {target} for me? To see {it} is enough.",
        "Make your way around until {target} comes into view.",
        "All that you have to do is find {target} and have {it} in the picture.",
        "What I want to see in the picture is {target}. Look for {it}.",
        "Go wherever you have to for a look at {target}; stop once {it_is} in the picture.",
        "Check where {target} is: look around until you see {it}.",
    ),
)

ON_OR_OFF = Sentences(
    public=(
        "Is {whole} on or off? Report its state.",
        "Check whether {whole} is switched on or off, and report which.",
        "Tell me whether {whole} is on or off.",
        "Without touching it, find out whether {whole} is on or off.",
        "I would like to know whether {whole} is on or off.",
        "{Whole} may be on or off. Report which.",
        "Please report the state of {whole}, on or off.",
        "Before I leave I must know: is {whole} on or off?",
        "Say whether {whole} is off or on.",
    ),
    held_out=(
        "Look at {whole}. Is it on or off?",
        "Report the state of {whole}: is it on or off?",
        "Can you see whether {whole} is off or on? Report what you see.",
        "Somebody asks whether {whole} is on or off. What is the answer?",
        "Your task is to tell whether {whole} is on or off.",
        "Which is {whole}, on or off?",
        "Take a look at {whole}, so that you can report whether it is on or off.",
        "Has {whole} been left on, or is it off? Report which.",
        "Judge from what you see whether {whole} is off or on.",
    ),
)
"""Questions whether a thing is on or off."""

OPEN_OR_CLOSED = Sentences(
    public=(
        "Is {whole} open or closed? Report its state.",
        "Check whether {whole} is open or closed, and report which.",
        "Tell me whether {whole} is open or closed.",
        "Without touching {it}, find out whether {whole} is open or closed.",
        "I would like to know whether {whole} is open or closed.",
        "{Whole} may be open or closed. Report which.",
        "Please report the state of {whole}, open or closed.",
        "Before I leave I must know: is {whole} open or closed?",
        "Say whether {whole} is closed or open.",
    ),
    held_out=(
        "Look at {whole}. Is it open or closed?",
        "Report the state of {whole}: is it open or closed?",
        "Can you see whether {whole} is closed or open? Report what you see.",
        "Somebody asks whether {whole} is open or closed. What is the answer?",
        "Your task is to tell whether {whole} is open or closed.",
        "Which is {whole}, open or closed?",
        "Take a look at {whole}, so that you can report whether it is open or closed.",
        "Has {whole} been left open, or is it closed? Report which.",
        "Judge from what you see whether {whole} is closed or open.",
    ),
)
"""Questions whether a thing is open or closed."""

BURNING_OR_NOT = Sentences(
    public=(
        "Is the flame of {target} on or off? Report its state.",
        "Check whether {target} is burning, and report on or off.",
        "Tell me whether {target} is lit: on or off?",
        "Please report whether the flame of {target} is off or on.",
        "I would like to know whether {target} is lit. Report on or off.",
    ),
    held_out=(
        "Look at {target}: is its flame on or off?",
        "Is {target} burning? Report on if it is, and off if it is not.",
        "Find out, without touching it, whether the flame of {target} is on or off.",
        "Somebody may have lit {target}. Report whether its flame is on or off.",
        "Can you see a flame on {target}? Report on or off.",
    ),
)
"""Questions whether a candle burns."""

ORDERS = Sentences(
    public=(
        "{Order}.",
        "Please {order}.",
        "Go to {target} and {order_it}.",
        "Could you {order}?",
        "Your task is to {order}.",
        "I would like you to {order}.",
        "Go to {target} and {order_it}, so that I do not have to.",
        "What I need you to do is {order}.",
        "{Target} is over there. Go and {order_it}.",
        "There is one thing to do: {order}.",
        "I cannot get up right now. Please {order} for me.",
        "Make your way to {target}, then {order_it}.",
        "{Acted} has to be {done}.",
        "Do me a favour and {order}.",
        "You can see {target} from here. Go there and {order_it}.",
    ),
    held_out=(
        "Walk over to {target} and {order_it}.",
        "Would you {order}, please?",
        "I want you to {order}.",
        "It is time to {order}.",
        "Head for {target} and {order_it} once you are there.",
        "Can you get to {target} and {order_it}?",
        "All I ask is that you {order}.",
        "Be so kind as to {order}.",
        "First go to {target}; then {order_it}.",
        "You see {target}: {order_it}, please.",
        "Would you mind going over to {target}? I need you to {order_it}.",
        "Step up to {target} and {order_it}.",
        "{Acted} should be {done}. Please see to that.",
        "I want {acted} to be {done}: go there and do it.",
        "The next thing to do is to {order}.",
    ),
)

SEARCH_ORDERS = Sentences(
    public=(
        "Find {target} and {order_it}.",
        "Look for {target}, then {order_it}.",
        "Search the home for {target}. When you have found {it}, {order_it}.",
        "I need you to find {target} and {order_it}.",
        "Go looking for {target}. Once you see {it}, {order_it}.",
        "Please find {target} and {order_it}, so that I do not have to.",
        "Could you look for {target} and {order_it}?",
        "I do not know where {target} is. Find {it} and {order_it}.",
        "{Acted} has to be {done}. Have a look around first.",
        "Your task is to find {target} and to {order_it}.",
        "Explore until you come upon {target}, and then {order_it}.",
        "{Target} is not in sight from here. Look for {it} and {order_it}.",
        "Where is {target}? Find {it} and {order_it}.",
        "I would like you to {order}. You will have to search first.",
        "Have a look around for {target}; when you get there, {order_it}.",
    ),
    held_out=(
        "Locate {target} and {order_it}, please.",
        "Go and find {target}. Then {order_it}.",
        "Look everywhere for {target}, and {order_it} when you have found {it}.",
        "Would you find {target} for me and {order_it}?",
        "Make your way to {target}, wherever that may take you, and {order_it}.",
        "You cannot see {target} yet. Find {it} and {order_it}.",
        "I want you to {order}. Search until you get there.",
        "First find {target}; then {order_it}.",
        "Track down {target} and {order_it}.",
        "{Target} cannot be seen from where you stand. Go and find {it}, then {order_it}.",
        "Please {order}. Finding your way there is part of the task.",
        "Once you have found {target}, {order_it}.",
        "You will have to search for {target}. When you see {it}, {order_it}.",
        "{Acted} has to be {done}, wherever you have to go for that.",
        "Help me with {target}: find {it} and {order_it}.",
    ),
)
