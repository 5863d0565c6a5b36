"""The catalogue: every category of thing, its usual size, what can be done with it and where it belongs.

Names and affordances follow AI2-THOR's object types; sizes are typical of real household things. An object in a scene
can be opened when its category says so *and* its asset has joints (`vigil.assets.kernel.asset.Asset.can_open`), so a
desk without drawers cannot. The looks of things are defined by their makers, not here.
"""

from dataclasses import dataclass

from vigil.base.geometry import Vec3

ROOM_TYPES = ("Kitchen", "LivingRoom", "Bedroom", "Bathroom")
FLOOR, WALL, CEILING = "Floor", "Wall", "Ceiling"

_ROOMS = {"K": "Kitchen", "L": "LivingRoom", "B": "Bedroom", "W": "Bathroom"}
_FLAGS = frozenset({"pick", "move", "open", "toggle", "hold", "interlock"})

_TABLES = ("DiningTable", "CoffeeTable", "SideTable", "Desk")
_COOKING = ("CounterTop", "DiningTable", "Cabinet")
_FOOD = ("CounterTop", "DiningTable", "Fridge", "Bowl", "Plate")
_CUTLERY = ("CounterTop", "DiningTable", "Drawer", "Plate")
_STORAGE = ("ShelvingUnit", "Shelf", "Dresser", "TVStand")
_BATH = ("CounterTop", "Sink", "Toilet", "SideTable", "Shelf")
_SEATS = ("Sofa", "ArmChair", "Bed")


@dataclass(frozen=True, slots=True)
class Category:
    """One kind of thing."""

    name: str
    display_name: str
    """Name that people use, e.g. "coffee machine"."""
    typical_size: Vec3
    """Width x, height y, depth z (m) of the bounding box, closed and off."""
    size_spread: float
    """Fraction by which sizes vary about the typical one."""
    rooms: tuple[str, ...]
    """Room types in which the thing is normally found."""
    rests_on: tuple[str, ...]
    """Categories on or in which the thing is normally found, or "Floor", "Wall", "Ceiling"; the likeliest first."""
    is_pickupable: bool = False
    is_moveable: bool = False
    """Whether the thing can be pushed but not carried."""
    is_openable: bool = False
    is_toggleable: bool = False
    is_receptacle: bool = False
    runs_only_when_closed: bool = False
    """Whether the thing starts only while closed and opens only while off."""
    accepts: tuple[str, ...] | None = None
    """Categories that may be put on or in the thing; None means any pickupable thing that fits."""

    def can_hold(self, other: "Category") -> bool:
        """Return whether `other` may be put on or in this category, whether or not there is room for it."""
        if not self.is_receptacle or not other.is_pickupable:
            return False
        return (
            other.name in self.accepts if self.accepts is not None else other.name != self.name or self.name == "Plate"
        )


def _row(  # one row of the table reads as one line
    name: str,
    display_name: str,
    size: tuple[float, float, float],
    spread: float,
    rooms: str,
    rests_on: tuple[str, ...],
    flags: str = "",
    accepts: tuple[str, ...] | None = None,
) -> Category:
    words = frozenset(flags.split())
    if words - _FLAGS:
        raise ValueError(f"Category {name}: unknown flags {sorted(words - _FLAGS)}; known are {sorted(_FLAGS)}.")
    return Category(
        name=name,
        display_name=display_name,
        typical_size=Vec3(*size),
        size_spread=spread,
        rooms=tuple(_ROOMS[letter] for letter in rooms),
        rests_on=rests_on,
        is_pickupable="pick" in words,
        is_moveable="move" in words,
        is_openable="open" in words,
        is_toggleable="toggle" in words,
        is_receptacle="hold" in words,
        runs_only_when_closed="interlock" in words,
        accepts=accepts,
    )


_SLIM = ("Pen", "Pencil", "Fork", "Spoon", "Knife", "ButterKnife", "Spatula", "Ladle")

_ROWS = (
    # furniture
    _row("ArmChair", "armchair", (0.88, 0.86, 0.84), 0.1, "LB", (FLOOR,), "move hold"),
    _row("Bed", "bed", (1.5, 0.95, 2.08), 0.12, "B", (FLOOR,), "move hold"),
    _row("Cabinet", "cabinet", (0.8, 0.9, 0.42), 0.12, "KW", (FLOOR, WALL), "open hold"),
    _row("Cart", "cart", (0.7, 0.88, 0.45), 0.08, "KW", (FLOOR,), "move hold"),
    _row("Chair", "chair", (0.46, 0.9, 0.52), 0.08, "KLB", (FLOOR,), "move hold"),
    _row("CoffeeTable", "coffee table", (1.1, 0.43, 0.6), 0.12, "L", (FLOOR,), "move hold"),
    _row("CounterTop", "countertop", (1.8, 0.91, 0.64), 0.04, "KW", (FLOOR,), "hold"),
    _row("Desk", "desk", (1.3, 0.75, 0.65), 0.08, "LB", (FLOOR,), "move open hold"),
    _row("DiningTable", "dining table", (1.5, 0.75, 0.9), 0.1, "KL", (FLOOR,), "move hold"),
    _row("DogBed", "dog bed", (0.85, 0.2, 0.65), 0.12, "LB", (FLOOR,), "move hold"),
    _row("Drawer", "drawer", (0.5, 0.2, 0.45), 0.08, "KLBW", (FLOOR, "Cabinet"), "open hold"),
    _row("Dresser", "dresser", (1.0, 0.85, 0.48), 0.1, "B", (FLOOR,), "move open hold"),
    _row("Footstool", "footstool", (0.45, 0.3, 0.32), 0.1, "LB", (FLOOR,), "pick hold"),
    _row("Ottoman", "ottoman", (0.75, 0.42, 0.55), 0.1, "LB", (FLOOR,), "move hold"),
    _row("Shelf", "wall shelf", (0.8, 0.05, 0.24), 0.12, "KLBW", (WALL,), "hold"),
    _row("ShelvingUnit", "shelving unit", (0.8, 1.75, 0.32), 0.1, "LB", (FLOOR,), "move hold"),
    _row("SideTable", "side table", (0.48, 0.56, 0.42), 0.1, "LB", (FLOOR,), "move open hold"),
    _row("Sofa", "sofa", (2.0, 0.85, 0.92), 0.1, "L", (FLOOR,), "move hold"),
    _row("Stool", "stool", (0.38, 0.62, 0.38), 0.1, "KL", (FLOOR,), "move hold"),
    _row("TVStand", "TV stand", (1.4, 0.5, 0.42), 0.1, "LB", (FLOOR,), "move open hold"),
    # appliances
    _row("ClothesDryer", "clothes dryer", (0.6, 0.85, 0.62), 0.04, "W", (FLOOR,), "move open toggle hold interlock"),
    _row(
        "CoffeeMachine",
        "coffee machine",
        (0.26, 0.36, 0.33),
        0.1,
        "K",
        ("CounterTop", "DiningTable"),
        "move toggle hold",
        ("Mug", "Cup"),
    ),
    _row("Fridge", "fridge", (0.78, 1.78, 0.72), 0.06, "K", (FLOOR,), "open hold"),
    _row(
        "Microwave",
        "microwave",
        (0.5, 0.29, 0.38),
        0.08,
        "K",
        ("CounterTop", "DiningTable", "ShelvingUnit"),
        "move open toggle hold interlock",
    ),
    _row("Stove", "stove", (0.6, 0.9, 0.62), 0.04, "K", (FLOOR,), "open toggle hold"),
    _row(
        "StoveBurner",
        "stove burner",
        (0.2, 0.02, 0.2),
        0.1,
        "K",
        ("Stove", "CounterTop"),
        "toggle hold",
        ("Pot", "Pan", "Kettle"),
    ),
    _row("StoveKnob", "stove knob", (0.045, 0.045, 0.03), 0.1, "K", ("Stove",), "toggle"),
    _row(
        "Toaster", "toaster", (0.3, 0.2, 0.19), 0.08, "K", ("CounterTop", "DiningTable"), "move toggle hold", ("Bread",)
    ),
    _row("VacuumCleaner", "vacuum cleaner", (0.3, 1.08, 0.33), 0.06, "LB", (FLOOR,), "move"),
    _row("WashingMachine", "washing machine", (0.6, 0.85, 0.6), 0.04, "W", (FLOOR,), "move open toggle hold interlock"),
    # doors and windows
    _row("Blinds", "window blinds", (1.2, 1.2, 0.06), 0.1, "KLBW", (WALL,), "open"),
    _row("Curtains", "curtains", (1.6, 2.1, 0.12), 0.1, "LB", (WALL,), "open"),
    _row("Doorframe", "open doorway", (1.0, 2.1, 0.14), 0.0, "KLBW", (WALL,)),
    _row("Doorway", "door", (1.0, 2.1, 0.14), 0.0, "KLBW", (WALL,), "open"),
    _row("Window", "window", (1.2, 1.1, 0.14), 0.0, "KLBW", (WALL,)),
    # containers on the floor
    _row(
        "Box",
        "box",
        (0.42, 0.28, 0.32),
        0.15,
        "LB",
        (FLOOR, "Sofa", "DiningTable", "Dresser", "ShelvingUnit"),
        "pick open hold",
    ),
    _row("GarbageBag", "garbage bag", (0.48, 0.55, 0.48), 0.1, "K", (FLOOR,), "move"),
    _row("GarbageCan", "garbage can", (0.34, 0.5, 0.34), 0.12, "KLBW", (FLOOR,), "move hold"),
    _row("LaundryHamper", "laundry hamper", (0.45, 0.62, 0.35), 0.1, "BW", (FLOOR,), "move open hold"),
    _row("Safe", "safe", (0.42, 0.4, 0.4), 0.12, "LB", (FLOOR, "ShelvingUnit"), "move open hold"),
    # bathroom
    _row("Bathtub", "bathtub", (1.6, 0.55, 0.75), 0.05, "W", (FLOOR,), "hold"),
    _row("Faucet", "faucet", (0.18, 0.24, 0.22), 0.12, "KW", ("Sink", "CounterTop", "Bathtub"), "toggle"),
    _row("HandTowel", "hand towel", (0.26, 0.4, 0.03), 0.1, "W", ("HandTowelHolder", WALL), "pick"),
    _row("HandTowelHolder", "hand towel holder", (0.2, 0.2, 0.07), 0.1, "W", (WALL,)),
    _row("Mirror", "mirror", (0.6, 0.85, 0.03), 0.2, "WB", (WALL,)),
    _row("Plunger", "plunger", (0.15, 0.5, 0.15), 0.08, "W", (FLOOR,), "pick"),
    _row("ScrubBrush", "toilet brush", (0.12, 0.42, 0.12), 0.08, "W", (FLOOR,), "pick"),
    _row("ShowerCurtain", "shower curtain", (1.5, 1.85, 0.12), 0.06, "W", (FLOOR, WALL), "open"),
    _row("ShowerHead", "shower head", (0.26, 1.2, 0.32), 0.1, "W", (WALL,), "toggle"),
    _row("Sink", "sink", (0.6, 0.18, 0.48), 0.08, "KW", ("CounterTop", FLOOR), "hold"),
    _row("SoapBar", "bar of soap", (0.06, 0.028, 0.09), 0.1, "W", _BATH, "pick"),
    _row("Toilet", "toilet", (0.4, 0.78, 0.7), 0.05, "W", (FLOOR,), "open hold"),
    _row("ToiletPaper", "toilet paper roll", (0.11, 0.1, 0.11), 0.08, "W", ("Toilet", *_BATH), "pick"),
    _row("ToiletPaperHanger", "toilet paper holder", (0.17, 0.12, 0.11), 0.1, "W", (WALL,)),
    _row("Towel", "towel", (0.5, 0.6, 0.05), 0.1, "W", ("TowelHolder", WALL), "pick"),
    _row("TowelHolder", "towel rail", (0.6, 0.06, 0.09), 0.1, "W", (WALL,)),
    # lamps and switches
    _row("CeilingLamp", "ceiling lamp", (0.42, 0.36, 0.42), 0.15, "KLBW", (CEILING,), "toggle"),
    _row("DeskLamp", "desk lamp", (0.22, 0.44, 0.26), 0.12, "LB", ("Desk", "SideTable", "Dresser"), "move toggle"),
    _row("FloorLamp", "floor lamp", (0.42, 1.6, 0.42), 0.1, "LB", (FLOOR,), "move toggle"),
    _row("LightSwitch", "light switch", (0.085, 0.125, 0.022), 0.08, "KLBW", (WALL,), "toggle"),
    # electronics
    _row(
        "AlarmClock", "alarm clock", (0.16, 0.11, 0.08), 0.15, "BL", ("SideTable", "Dresser", "Desk", "Shelf"), "pick"
    ),
    _row("CD", "CD", (0.12, 0.003, 0.12), 0.0, "LB", ("Desk", "SideTable", *_STORAGE), "pick"),
    _row(
        "CellPhone",
        "cell phone",
        (0.075, 0.009, 0.155),
        0.08,
        "LBK",
        (*_TABLES, "Bed", "Sofa", "Dresser"),
        "pick toggle",
    ),
    _row("Desktop", "desktop computer", (0.62, 0.5, 0.24), 0.08, "BL", ("Desk",), "move toggle"),
    _row("Laptop", "laptop", (0.34, 0.024, 0.24), 0.08, "LB", (*_TABLES, *_SEATS), "pick open toggle"),
    _row(
        "RemoteControl",
        "remote control",
        (0.05, 0.022, 0.18),
        0.1,
        "LB",
        ("CoffeeTable", "TVStand", "Sofa", "SideTable", "ArmChair"),
        "pick",
    ),
    _row("Television", "television", (1.1, 0.7, 0.2), 0.15, "LB", ("TVStand", WALL, "Dresser"), "move toggle"),
    # kitchen things
    _row("AluminumFoil", "roll of aluminum foil", (0.31, 0.055, 0.055), 0.06, "K", (*_COOKING, "Drawer"), "pick"),
    _row("Bottle", "bottle", (0.08, 0.26, 0.08), 0.12, "KL", ("CounterTop", "DiningTable", "Fridge", "Shelf"), "pick"),
    _row("Bowl", "bowl", (0.17, 0.075, 0.17), 0.15, "KL", (*_COOKING, "CoffeeTable"), "pick hold"),
    _row("ButterKnife", "butter knife", (0.02, 0.012, 0.21), 0.06, "K", _CUTLERY, "pick"),
    _row("Cup", "cup", (0.085, 0.115, 0.085), 0.12, "KL", (*_COOKING, "CoffeeTable", "Sink"), "pick hold", _SLIM),
    _row("DishSponge", "sponge", (0.07, 0.03, 0.11), 0.08, "K", ("CounterTop", "Sink"), "pick"),
    _row("Fork", "fork", (0.026, 0.02, 0.2), 0.06, "K", _CUTLERY, "pick"),
    _row(
        "Kettle",
        "kettle",
        (0.22, 0.23, 0.18),
        0.08,
        "K",
        ("CounterTop", "StoveBurner", "Stove", "DiningTable"),
        "pick open",
    ),
    _row("Knife", "knife", (0.036, 0.016, 0.31), 0.08, "K", _CUTLERY, "pick"),
    _row("Ladle", "ladle", (0.09, 0.06, 0.3), 0.06, "K", ("CounterTop", "DiningTable", "Drawer"), "pick"),
    _row(
        "Mug",
        "mug",
        (0.125, 0.1, 0.088),
        0.1,
        "KL",
        (*_COOKING, "CoffeeTable", "Desk", "SideTable", "CoffeeMachine"),
        "pick hold",
        _SLIM,
    ),
    _row(
        "Pan",
        "frying pan",
        (0.27, 0.06, 0.46),
        0.1,
        "K",
        ("CounterTop", "StoveBurner", "Stove", "DiningTable"),
        "pick hold",
    ),
    _row("PaperTowelRoll", "paper towel roll", (0.13, 0.27, 0.13), 0.08, "K", ("CounterTop", "DiningTable"), "pick"),
    _row("PepperShaker", "pepper shaker", (0.05, 0.11, 0.05), 0.1, "K", ("DiningTable", "CounterTop"), "pick"),
    _row("Plate", "plate", (0.25, 0.022, 0.25), 0.12, "K", _COOKING, "pick hold"),
    _row(
        "Pot", "pot", (0.25, 0.15, 0.36), 0.1, "K", ("CounterTop", "StoveBurner", "Stove", "DiningTable"), "pick hold"
    ),
    _row("SaltShaker", "salt shaker", (0.05, 0.1, 0.05), 0.1, "K", ("DiningTable", "CounterTop"), "pick"),
    _row(
        "SoapBottle",
        "soap bottle",
        (0.075, 0.2, 0.075),
        0.12,
        "KW",
        ("CounterTop", "Sink", "SideTable", "Toilet"),
        "pick",
    ),
    _row("Spatula", "spatula", (0.08, 0.03, 0.32), 0.06, "K", ("CounterTop", "DiningTable", "Drawer"), "pick"),
    _row("Spoon", "spoon", (0.04, 0.025, 0.19), 0.06, "K", _CUTLERY, "pick"),
    _row("WineBottle", "wine bottle", (0.08, 0.31, 0.08), 0.05, "KL", ("CounterTop", "DiningTable", "Fridge"), "pick"),
    # food
    _row("Apple", "apple", (0.08, 0.078, 0.08), 0.1, "KL", (*_FOOD, "CoffeeTable"), "pick"),
    _row("Bread", "loaf of bread", (0.12, 0.11, 0.27), 0.1, "K", ("CounterTop", "DiningTable", "Plate"), "pick"),
    _row("Egg", "egg", (0.046, 0.058, 0.046), 0.06, "K", _FOOD, "pick"),
    _row("Lettuce", "lettuce", (0.16, 0.15, 0.17), 0.1, "K", ("CounterTop", "DiningTable", "Fridge"), "pick"),
    _row("Potato", "potato", (0.07, 0.06, 0.1), 0.12, "K", _FOOD, "pick"),
    _row("Tomato", "tomato", (0.08, 0.068, 0.08), 0.1, "K", _FOOD, "pick"),
    # paper, writing, small personal things
    _row(
        "Book",
        "book",
        (0.17, 0.03, 0.24),
        0.15,
        "LB",
        (*_TABLES, "Bed", "ShelvingUnit", "Shelf", "Dresser", "Sofa"),
        "pick open",
    ),
    _row("CreditCard", "credit card", (0.0856, 0.002, 0.054), 0.0, "LB", (*_TABLES, "Dresser"), "pick"),
    _row("KeyChain", "set of keys", (0.11, 0.012, 0.05), 0.08, "LB", (*_TABLES, "Dresser", "Shelf"), "pick"),
    _row("Newspaper", "newspaper", (0.3, 0.02, 0.21), 0.1, "LBK", (*_TABLES, "Sofa", "ArmChair"), "pick"),
    _row("Pen", "pen", (0.012, 0.012, 0.145), 0.06, "LB", ("Desk", "SideTable", "DiningTable", "Dresser"), "pick"),
    _row("Pencil", "pencil", (0.008, 0.008, 0.18), 0.1, "LB", ("Desk", "SideTable", "DiningTable", "Dresser"), "pick"),
    _row(
        "TissueBox",
        "tissue box",
        (0.23, 0.13, 0.12),
        0.08,
        "BLW",
        ("SideTable", "Dresser", "CoffeeTable", "Toilet"),
        "pick",
    ),
    _row("Watch", "watch", (0.08, 0.035, 0.062), 0.08, "BL", ("SideTable", "Dresser", "Desk"), "pick"),
    # cleaning
    _row("Cloth", "cloth", (0.24, 0.02, 0.22), 0.12, "WK", ("CounterTop", "SideTable", FLOOR, "Bathtub"), "pick"),
    _row(
        "SprayBottle",
        "spray bottle",
        (0.08, 0.26, 0.1),
        0.08,
        "WK",
        ("CounterTop", "SideTable", "Toilet", "Shelf"),
        "pick",
    ),
    # sport and floor things
    _row("BaseballBat", "baseball bat", (0.066, 0.84, 0.066), 0.05, "B", (FLOOR, "Bed"), "pick"),
    _row("BasketBall", "basketball", (0.24, 0.24, 0.24), 0.02, "BL", (FLOOR, "Bed", "ArmChair"), "pick"),
    _row("Boots", "pair of boots", (0.28, 0.36, 0.29), 0.08, "BL", (FLOOR,), "pick"),
    _row("Dumbbell", "dumbbell", (0.13, 0.13, 0.32), 0.1, "BL", (FLOOR,), "pick"),
    _row("TennisRacket", "tennis racket", (0.27, 0.032, 0.68), 0.03, "BL", ("Bed", FLOOR, "Desk", "Dresser"), "pick"),
    # decoration and soft things
    _row(
        "Candle",
        "candle",
        (0.07, 0.12, 0.07),
        0.2,
        "LBW",
        ("CoffeeTable", "SideTable", "DiningTable", "CounterTop"),
        "pick toggle",
    ),
    _row(
        "HousePlant",
        "house plant",
        (0.36, 0.6, 0.36),
        0.25,
        "LBK",
        (FLOOR, *_STORAGE, "SideTable", "DiningTable"),
        "move",
    ),
    _row("Painting", "painting", (0.75, 0.55, 0.03), 0.25, "LBKW", (WALL,)),
    _row("Pillow", "pillow", (0.5, 0.15, 0.36), 0.12, "BL", ("Bed", "Sofa", "ArmChair"), "pick"),
    _row("RoomDecor", "vase with branches", (0.36, 1.2, 0.36), 0.12, "LB", (FLOOR,), "move"),
    _row("Rug", "rug", (1.8, 0.012, 1.2), 0.2, "LB", (FLOOR,)),
    _row(
        "Statue",
        "statue",
        (0.18, 0.32, 0.16),
        0.2,
        "LB",
        (*_STORAGE, "CoffeeTable", "DiningTable", "SideTable"),
        "pick",
    ),
    _row(
        "TableTopDecor",
        "table ornament",
        (0.3, 0.2, 0.2),
        0.12,
        "LB",
        ("CoffeeTable", "DiningTable", *_STORAGE),
        "pick",
    ),
    _row("TeddyBear", "teddy bear", (0.32, 0.4, 0.28), 0.12, "B", ("Bed", "Sofa", FLOOR), "pick"),
    _row(
        "Vase", "vase", (0.17, 0.28, 0.17), 0.22, "LBK", (*_STORAGE, "CoffeeTable", "DiningTable", "SideTable"), "pick"
    ),
    _row("WateringCan", "watering can", (0.16, 0.25, 0.36), 0.08, "LK", (FLOOR, "Shelf", "CounterTop"), "pick"),
)

CATALOG: dict[str, Category] = {row.name: row for row in _ROWS}
"""Category name -> category."""
