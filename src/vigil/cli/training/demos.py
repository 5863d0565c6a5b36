"""`vigil demos`: writes training data, which is what the solver saw and answered in episodes of a stream."""

from pathlib import Path
from typing import Annotated, Literal

import typer

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


def demos(
    pack: Annotated[
        str,
        typer.Option(
            metavar="stream:SEED",
            help=(
                "Stream from which the demonstrations are made, e.g. stream:7, where 7 is the stream's seed. "
                "Packs are not accepted."
            ),
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the demonstrations: new or empty.")],
    count: Annotated[int, typer.Option(min=1, help="Number of episodes from which demonstrations are made.")] = 100,
    form: Annotated[
        Literal["sft", "parquet", "lerobot"],
        typer.Option(
            "--format",
            help="Format of the demonstrations: sft (chats as JSON lines), parquet (the same chats as Parquet), "
            "or lerobot (actions as a LeRobot dataset).",
        ),
    ] = "sft",
    families: Families = (),
    difficulties: Difficulties = (),
    houses: Houses = "0:",
    profile: ProfileOption = "baseline",
    prompt_variant: PromptVariantOption = "default",
    prompt_template: PromptFileOption = None,
    coordinates: CoordinatesOption = None,
    model: Annotated[
        str | None,
        typer.Option(help="Model whose coordinate system the demonstrations use for clicks, as provider/model."),
    ] = None,
    quality: RenderQuality = "default",
    workers: Workers = None,
) -> None:
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

    check_source(pack)
    asked = RunSettings(
        profile=profile,
        prompt_variant=prompt_variant,
        prompt_template=prompt_template,
        coordinates=coordinates,
        model=model or "",  # a demonstration is for a model, even if it is not named
    )
    first, last = house_range(houses)
    stream = Stream(
        seed_in(pack), families=families, difficulties=difficulties, first=first, last=last,
        workers=worker_count(workers),
    )  # fmt: skip
    with stream, progress("episodes") as show:
        facts = write_demonstrations(
            out, stream, count, profile_of(asked), form=form, quality=quality,
            on_episode=lambda episodes: show(episodes, count),
        )  # fmt: skip
    print(f"{out}: {facts['stream']}, episodes {facts['episodes']}, rows {facts['rows']}")
