"""`vigil demos`: writes training data, which is what the solver saw and answered in episodes of a stream."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from vigil.base.settings import Setting
from vigil.cli.progress import progress
from vigil.cli.training.streams import Difficulties, Houses
from vigil.runner.shared_settings import (
    CoordinatesOption,
    Families,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    RenderQuality,
    Workers,
)


@dataclass(frozen=True, kw_only=True)
class DemosOptions:
    """From what `vigil demos` makes demonstrations, how it writes them, and where to."""

    pack: Annotated[
        str,
        Setting(
            "Stream from which the demonstrations are made, e.g. stream:7, where 7 is the stream's seed. "
            "Packs are not accepted.",
            metavar="stream:SEED",
        ),
    ]
    out: Annotated[Path, Setting("Folder for the demonstrations: new or empty.")]
    count: Annotated[int, Setting("Number of episodes from which demonstrations are made.", minimum=1)] = 100
    form: Annotated[
        Literal["sft", "parquet", "lerobot"],
        Setting(
            "Format of the demonstrations: sft (chats as JSON lines), parquet (the same chats as Parquet), "
            "or lerobot (actions as a LeRobot dataset).",
            name="format",
        ),
    ] = "sft"
    families: Families = ()
    difficulties: Difficulties = ()
    houses: Houses = "0:"
    profile: ProfileOption = "baseline"
    prompt_variant: PromptVariantOption = "default"
    prompt_template: PromptFileOption = None
    coordinates: CoordinatesOption = None
    model: Annotated[
        str | None, Setting("Model whose coordinate system the demonstrations use for clicks, as provider/model.")
    ] = None
    quality: RenderQuality = "default"
    workers: Workers = None


def demos(options: DemosOptions) -> None:
    """Example: vigil demos --pack stream:7 --count 100 --out demos

    Each row is a request to a model with the right answer. Some rows are corrections: they also hold a false report
    that an agent could have given. In a LeRobot dataset, each row is a frame with the action that follows; there are
    no corrections.
    """
    from vigil.authoring.demonstrations.write import check_source, write_demonstrations
    from vigil.authoring.streaming.address import seed_in
    from vigil.authoring.streaming.stream import Stream
    from vigil.cli.training.streams import house_range
    from vigil.runner.plan import profile_of
    from vigil.runner.settings import RunSettings
    from vigil.runner.workers.pool import worker_count

    check_source(options.pack)
    asked = RunSettings(
        profile=options.profile,
        prompt_variant=options.prompt_variant,
        prompt_template=options.prompt_template,
        coordinates=options.coordinates,
        model=options.model or "",  # a demonstration is for a model, even if it is not named
    )
    first, last = house_range(options.houses)
    stream = Stream(
        seed_in(options.pack), families=options.families, difficulties=options.difficulties, first=first, last=last,
        workers=worker_count(options.workers),
    )  # fmt: skip
    with stream, progress("episodes") as show:
        facts = write_demonstrations(
            options.out, stream, options.count, profile_of(asked), form=options.form, quality=options.quality,
            on_episode=lambda episodes: show(episodes, options.count),
        )  # fmt: skip
    print(f"{options.out}: {facts['stream']}, episodes {facts['episodes']}, rows {facts['rows']}")
