"""Feeds hostile packs, houses and recipes to their readers: each must work, or be refused with its name and fault.

    python -m sweeps.hostile                         400 pieces: 25 packs, houses or recipes each
    python -m sweeps.hostile --piece 3 --case 7      one of them again
    python -m sweeps.hostile --piece 3 --case 7 --keep DIR   the same, its files left in DIR

Each case runs in a process of its own with bounded memory and time. It is loaded, verified and played for a few steps,
drawn, and given to the commands `vigil pack info`, `pack verify`, `houses check`, `render` and `run`. It fails when
anything but a VigilError comes out, when that does not say where the fault is, when it hangs, dies or takes more than
3 GiB.
"""

import contextlib
import json
import random
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from sweeps.support import pieces
from sweeps.support.confined import CallOutcome, run_confined
from sweeps.support.hostile_cases import base_pack, hostile_house, hostile_pack, house_file
from sweeps.support.json_mutations import mutated
from sweeps.support.pieces import Failure, PieceResult, Sweep
from vigil.assets.database import AssetDatabase
from vigil.authoring.packing.recipes import PACKAGED, Recipe, check_assets, check_drafts, sources_of
from vigil.base.geometry import Pose, Vec3
from vigil.base.json_lines import dump_line
from vigil.cli import main as vigil_main
from vigil.env import Env
from vigil.errors import VigilError
from vigil.housegen.checking.check import check_house
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.protocol.profile import Profile
from vigil.protocol.world import Setup
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim import make_simulator

PER_PIECE = 25
PLAYED_STEPS = 6
PLAYED_EPISODES = 3
DRAWN = 0.1
BY_COMMAND = 0.15
MAX_MESSAGE_CHARS = 2000
ALLOWED_EXITS = (0, 1, 2)
REPLIES = (
    '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 2}}',
    '{"skill_name": "interact_pixel", "arguments": {"intent": "open_access", "x": 320, "y": 300}}',
    '{"skill_name": "interact_pixel", "arguments": {"intent": "pick", "x": 320, "y": 350}}',
    '{"skill_name": "interact_pixel", "arguments": {"intent": "drop"}}',
    '{"skill_name": "look", "arguments": {"direction": "down", "magnitude": 20}}',
    '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}',
)


def main() -> int:
    """Run the sweep."""
    parser = pieces.parser(__doc__ or "", 400)
    parser.add_argument("--keep", type=Path, help="with --piece and --case: leave the case's files in this folder")
    options = parser.parse_args()
    work = partial(fuzz, options.seed, options.case, options.keep, PER_PIECE)
    return pieces.run(Sweep("hostile", {"seed": options.seed}, work), options)


def fuzz(seed: int, case: int | None, keep: Path | None, count: int, piece: int) -> PieceResult:
    """Return the results of a piece's cases, or of one of them."""
    result = PieceResult()
    base_pack(0)
    for number in range(count) if case is None else (case,):
        rng = random.Random(f"{seed}/{piece}/{number}")
        with _folder(keep) as folder:
            (make,) = rng.choices((_pack_case, _house_case, _recipe_case), (5, 4, 1))
            what, call, places = make(rng, folder)
            outcome = run_confined(call)
        result.counts["cases"] += 1
        ending = outcome.text if outcome.text.startswith("exit ") else outcome.kind
        result.counts[f"{what.partition(':')[0]}: {ending}"] += 1
        fault = _fault(outcome, places)
        if fault is not None:
            detail = f"{what}: {outcome.text}"
            result.failures.append(Failure(fault, detail, f"--piece {piece} --case {number}"))
    return result


@contextlib.contextmanager
def _folder(keep: Path | None) -> Iterator[Path]:
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        yield keep
        return
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        yield Path(folder)


def _fault(outcome: CallOutcome, places: list[str]) -> str | None:
    if outcome.kind == "done":
        return None
    if outcome.kind != "refused":
        last = outcome.text.strip().splitlines()[-1][:60] if outcome.text.strip() else ""
        return f"{outcome.kind} {last}".strip()
    if not any(place in outcome.text for place in places):
        return "a refusal that does not say where"
    return "a refusal of too many words" if len(outcome.text) > MAX_MESSAGE_CHARS else None


Case = tuple[str, partial[str], list[str]]


def _pack_case(rng: random.Random, folder: Path) -> Case:
    pack = folder / "the_pack"
    what = hostile_pack(rng, pack)
    if rng.random() < BY_COMMAND:
        arguments = rng.choice(
            (
                ["pack", "info", str(pack)],
                ["pack", "verify", str(pack)],
                ["run", "--pack", str(pack), "--agent", "random", "--log-dir", str(folder / "run"), "--limit", "2"],
            )
        )
        return f"pack, vigil {' '.join(arguments[:2])}: {what}", partial(_command, arguments), ["exit"]
    return f"pack: {what}", partial(_use_pack, pack, rng.random() < DRAWN), ["the_pack", "pisode", "ouse"]


def _house_case(rng: random.Random, folder: Path) -> Case:
    files = base_pack(rng.randrange(8))
    document, what = hostile_house(rng, json.loads(files[house_file(files)]))
    path = folder / "the_house.json"
    path.write_bytes(json.dumps(document).encode("utf-8", "surrogatepass"))
    if rng.random() < BY_COMMAND:
        check = ["houses", "check", str(path)]
        picture = ["render", "--house", str(path), "--pose", "2,2,0,20", "--out", str(folder / "picture.png")]
        arguments = rng.choice((check, picture))
        return f"house, vigil {arguments[0]}: {what}", partial(_command, arguments), ["exit"]
    return f"house: {what}", partial(_use_house, path, rng.random() < DRAWN), ["the_house"]


def _recipe_case(rng: random.Random, folder: Path) -> Case:
    document = json.loads(min(PACKAGED.glob("*.json")).read_bytes())
    document["houses"] = document["houses"][:3]
    path = folder / "the_recipe.json"
    path.write_bytes(json.dumps(mutated(rng, document)).encode("utf-8", "surrogatepass"))
    return "recipe", partial(_use_recipe, path), ["ecipe"]


def _use_recipe(path: Path) -> str:
    recipe = Recipe.load(str(path))
    check_drafts(recipe)
    check_assets(recipe, AssetDatabase.default())
    return f"{len(sources_of(recipe, [], print))} houses, {len(recipe.notes())} notes"


def _command(arguments: list[str]) -> str:
    """Run `vigil`. Return its exit code; raise when its output has a traceback."""
    sys.argv = ["vigil", *arguments]
    try:
        vigil_main()
    except SystemExit as end:
        if end.code not in (None, *ALLOWED_EXITS):
            raise
        return f"exit {end.code}"
    return "exit 0"


def _use_pack(folder: Path, is_drawn: bool) -> str:
    pack = Pack.load(folder)
    solutions = pack.solutions
    simulator = make_simulator("mujoco", assets=AssetDatabase.default())
    env = Env(simulator, pack.house_of, Profile())
    for episode in pack.episodes[:PLAYED_EPISODES]:
        record = _play(env, episode, is_drawn)
        line = dump_line(record)
        again = EpisodeRecord.model_validate_json(line)
        if dump_line(again) != line:
            raise AssertionError(f"the record of {episode.id} read again differs")
        if record.end != "error":
            score(episode, record)
    return f"{len(pack.episodes)} episodes, {len(solutions)} solutions"


def _play(env: Env, episode: Episode, is_drawn: bool) -> EpisodeRecord:
    observation = env.reset(episode)
    for text in REPLIES[:PLAYED_STEPS]:
        if observation is None:
            break
        if is_drawn:
            observation.rgb.mean()
        observation = env.step(Reply(text=text))
    env.fail("runner", "the fuzzer stops here")
    return env.record()


def _use_house(path: Path, is_drawn: bool) -> str:
    assets = AssetDatabase.default()
    house = House.load(path)
    house.save(path.with_name("saved.json"))
    if House.load(path.with_name("saved.json")).sha256 != house.sha256:
        raise AssertionError("the house saved and loaded again has another hash")
    faults = check_house(house, assets)
    simulator = make_simulator("mujoco", assets=assets)
    simulator.load(house)
    room = simulator.scene().rooms[0].polygon.mean(axis=0)
    start = house.start or Pose(position=Vec3(float(room[0]), 0.0, float(room[1])), rotation=0.0)
    with contextlib.suppress(VigilError):  # the start may be taken: the house is fine all the same
        simulator.reset(start, Setup())
    simulator.world(simulator.object_ids()[:50]).model_dump_json()
    if is_drawn:
        simulator.frame()
    return f"{len(faults)} faults"


if __name__ == "__main__":
    sys.exit(main())
