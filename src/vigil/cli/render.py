"""`vigil render`: pictures of a house, of the start of an episode, of one object, or of all categories of objects."""

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from PIL import Image

from vigil.authoring.drafting.procthor import DATASET
from vigil.base.settings import Setting
from vigil.cli.text import print_note
from vigil.errors import SettingError, did_you_mean
from vigil.runner.shared_settings import AssetFile, PackName, RenderQuality

if TYPE_CHECKING:
    from vigil.assets.database import AssetDatabase
    from vigil.base.geometry import Pose
    from vigil.protocol.house import House
    from vigil.protocol.observation import Quality
    from vigil.protocol.world import Setup
    from vigil.sim.pictures.staged_scenes import State


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """What `vigil render` draws, and where to."""

    out: Annotated[Path, Setting("PNG file to write; with --catalog, a folder.")]
    house: Annotated[
        str | None,
        Setting(
            f"House to draw: a file, or {DATASET}:SPLIT:INDEX for a house of ProcTHOR-10K; --pose sets the "
            "position of the camera."
        ),
    ] = None
    pose: Annotated[
        str | None,
        Setting(
            "Pose of the agent in --house, as x,z,yaw[,horizon]: position in metres, direction in "
            "degrees, and camera tilt in degrees (down is positive)."
        ),
    ] = None
    episode: Annotated[
        str | None, Setting("Id of an episode of --pack; draws the first frame that the agent gets.")
    ] = None
    asset: Annotated[str | None, Setting("Category of the object to draw, e.g. Fridge.")] = None
    variant: Annotated[int, Setting("Which variant of the category's shape and look to draw, for --asset.")] = 0
    state: Annotated[
        Literal["open", "closed", "on", "off"] | None, Setting("State in which the object is drawn, for --asset.")
    ] = None
    catalog: Annotated[bool, Setting("Draw contact sheets that show objects of every category with their names.")] = (
        False
    )
    variants: Annotated[int, Setting("Number of variants of each category to show, for --catalog.", minimum=1)] = 3
    distance: Annotated[
        float | None,
        Setting(
            "Distance from the camera to each object in metres, for --catalog. If unset, each object is "
            "placed so that it spans about 120 pixels.",
            minimum=0.2,
            maximum=5.0,
        ),
    ] = None
    seed: Annotated[int, Setting("Random seed of the rooms in which --catalog shows the objects.", minimum=0)] = 0
    pack: PackName = "starter"
    assets: AssetFile = None
    render_quality: RenderQuality = "default"


def render(options: RenderOptions) -> None:
    """Examples:
    vigil render --house house.json --pose 0.75,4.0,90,30 --out view.png
    vigil render --catalog --variants 3 --out catalogue
    """
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.drafting.sources import house_at
    from vigil.protocol.world import Setup
    from vigil.sim.pictures.object_renders import write_catalog

    house, asset = options.house, options.asset
    if [house, options.episode, asset, options.catalog or None].count(None) != 3:
        raise SettingError("Say what to draw: exactly one of --house (with --pose), --episode, --asset and --catalog.")
    _check_place(options.out, is_folder=options.catalog)
    if options.catalog:
        print(*write_catalog(options.out, options.variants, options.seed, options.distance), sep="\n")
        return
    database = AssetDatabase.from_file(options.assets)
    if asset is not None:
        frame = _asset(asset, options.variant, options.state)
    elif house is not None:
        loaded = house_at(house, print_note)
        frame = _view(loaded, _pose(options.pose, loaded), Setup(), database, options.render_quality)
    else:
        frame = _first_frame(str(options.pack), options.episode or "", database, options.render_quality)
    Image.fromarray(frame).save(options.out, format="PNG")
    print(options.out)


def _check_place(out: Path, *, is_folder: bool) -> None:
    if not out.parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    if is_folder and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise SettingError(f"--out {str(out)!r} exists and is not an empty folder. Give a new one.")


def _first_frame(pack: str, episode_id: str, assets: "AssetDatabase", quality: "Quality") -> np.ndarray:
    from vigil.packs.pack import Pack

    frozen = Pack.load(pack)
    frozen.check_assets(assets)
    episode = frozen.episode(episode_id)
    return _view(frozen.house_of(episode), episode.start, episode.setup, assets, quality)


def _view(house: "House", start: "Pose", setup: "Setup", assets: "AssetDatabase", quality: "Quality") -> np.ndarray:
    from vigil.sim import make_simulator

    with closing(make_simulator("mujoco", assets=assets, quality=quality)) as simulator:
        simulator.load(house)
        simulator.reset(start, setup)
        return simulator.frame()


def _asset(category: str, variant: int, state: "State | None") -> np.ndarray:
    from vigil.assets.catalog import CATALOG
    from vigil.assets.making import make
    from vigil.sim.pictures.renders import render_asset

    if category not in CATALOG:
        raise SettingError(f"Asset category {category!r} does not exist.{did_you_mean(category, CATALOG)}")
    thing = make(category, CATALOG[category].typical_size, variant)
    return render_asset(thing, openness=float(state == "open"), is_toggled=state == "on")


def _pose(text: str | None, house: "House") -> "Pose":
    from vigil.base.geometry import Pose, Vec3

    if text is None:
        if house.start is None:
            raise SettingError(f"House {house.name!r} does not have a start pose: give --pose x,z,yaw[,horizon].")
        return house.start
    try:
        x, z, yaw, *rest = (float(part) for part in text.split(","))
        (horizon,) = rest or [0.0]
    except ValueError:
        raise SettingError(f"--pose {text!r} is not x,z,yaw[,horizon], e.g. 0.75,4.0,90,30.") from None
    return Pose(position=Vec3(x, 0.0, z), rotation=yaw, horizon=horizon)
