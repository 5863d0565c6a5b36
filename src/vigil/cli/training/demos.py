"""`vigil demos`: what the solver saw and answered in episodes of a stream, as training data."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.authoring.demonstrations.formats import Format
from vigil.authoring.demonstrations.write import check_source, write_demonstrations
from vigil.authoring.streaming.address import seed_in
from vigil.authoring.streaming.stream import Stream
from vigil.cli.progress import progress
from vigil.cli.training.streams import Difficulties, Houses, house_range
from vigil.runner.plan import profile_of
from vigil.runner.settings import RunSettings
from vigil.runner.shared_settings import (
    CoordinatesOption,
    Families,
    ProfileOption,
    PromptFileOption,
    PromptVariantOption,
    RenderQuality,
    Workers,
)
from vigil.runner.workers.pool import worker_count


def demos(
    pack: Annotated[str, typer.Option(metavar="stream:SEED", help="Stream of episodes; packs are not accepted.")],
    out: Annotated[Path, typer.Option(help="New or empty folder.")],
    count: Annotated[int, typer.Option(min=1, help="Number of episodes.")] = 100,
    form: Annotated[
        Format, typer.Option("--format", help="Chats as JSON lines or Parquet, or actions as a LeRobot dataset.")
    ] = "sft",
    families: Families = (),
    difficulties: Difficulties = (),
    houses: Houses = "0:",
    profile: ProfileOption = "baseline",
    prompt_variant: PromptVariantOption = "default",
    prompt_template: PromptFileOption = None,
    coordinates: CoordinatesOption = None,
    model: Annotated[str | None, typer.Option(help="Model whose coordinate system the demonstrations use.")] = None,
    quality: RenderQuality = "default",
    workers: Workers = None,
) -> None:  # fmt: skip
    """Example: vigil demos --pack stream:7 --count 100 --out demos

    Each row is a model's request with the right answer; a correction also holds a false report. In a LeRobot
    dataset each row is a frame with its action, without corrections.
    """
    check_source(pack)
    asked = RunSettings(
        profile=profile,
        prompt_variant=prompt_variant,
        prompt_template=prompt_template,
        coordinates=coordinates,
        model=model,
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
