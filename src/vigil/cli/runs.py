"""`vigil run` and `vigil verify`."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import typer

from vigil.agents.agent import REPLY_SECONDS
from vigil.agents.choose import is_exec
from vigil.agents.scripted import SCRIPTS
from vigil.authoring.solve import PRIVILEGED, privileged_agent
from vigil.cli.options import API_KEY_ENV, Assets, PackName
from vigil.cli.scores import label_of, print_families
from vigil.cli.text import Live, counting, say
from vigil.episode import FAMILIES, Family
from vigil.errors import SettingError, did_you_mean
from vigil.pack import manifest_of
from vigil.profile import (
    ACTION_FEEDBACK,
    BASELINE,
    PROFILE_NAMES,
    Coordinates,
    ImageFormat,
    PromptVariant,
    ReplyPolicy,
)
from vigil.runner.dry_run import estimate
from vigil.runner.redaction import without_options
from vigil.runner.run import RunResult, run_pack
from vigil.runner.run_folder import LOGS_FOLDER
from vigil.runner.settings import RunSettings, profile_of, public_name
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.sim import Quality
from vigil.strict_json import read_json
from vigil.summary import settle_run

_SHORT_PROFILES = {"baseline": BASELINE, "action_feedback": ACTION_FEEDBACK}
Reasoning = Literal["none", "minimal", "low", "medium", "high", "xhigh", "max"]
EFFORTS = f"{', '.join(get_args(Reasoning))}. Not sent unless given."


def run(
    pack: PackName = "starter",
    agent: Annotated[list[str] | None, typer.Option(help="solver, random, noop ... or exec:COMMAND.")] = None,
    model: Annotated[list[str] | None, typer.Option(help="provider/model, as Inspect names it.")] = None,
    base_url: Annotated[str | None, typer.Option(help="Address of an OpenAI-style server.")] = None,
    api_key_env: Annotated[str | None, typer.Option(metavar="VAR", help=API_KEY_ENV)] = None,
    log_dir: Annotated[Path | None, typer.Option(help="The run's folder; the same command continues it.")] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first N episodes, by id.")] = None,
    family: Annotated[list[str] | None, typer.Option(help="Only this family; may be repeated.")] = None,
    episode: Annotated[list[str] | None, typer.Option(help="Only this episode; may be repeated.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Simulator processes.", show_default="one a CPU")] = None,
    max_connections: Annotated[int, typer.Option(min=1, help="Episodes and requests at once.")] = 16,
    profile: Annotated[str, typer.Option(help="baseline or action_feedback, or a profile's full name.")] = "baseline",
    prompt_variant: Annotated[PromptVariant, typer.Option(help="System prompt.")] = "default",
    coordinates: Annotated[Coordinates | None, typer.Option(help="How it points.", show_default="by model")] = None,
    reply_policy: Annotated[ReplyPolicy, typer.Option(help="lenient strips a fence or prose.")] = "strict",
    epochs: Annotated[int, typer.Option(min=1, help="Play each episode so often.")] = 1,
    temperature: Annotated[float | None, typer.Option(help="Not sent unless given.")] = None,
    top_p: Annotated[float | None, typer.Option(help="Not sent unless given.")] = None,
    max_tokens: Annotated[int | None, typer.Option(min=1, help="Not sent unless given.")] = None,
    reasoning_effort: Annotated[Reasoning | None, typer.Option(metavar="LEVEL", help=EFFORTS)] = None,
    model_arg: Annotated[list[str] | None, typer.Option(help="K=V for the provider; may be repeated.")] = None,
    extra_body: Annotated[str | None, typer.Option(help="JSON object added to every request.")] = None,
    image_format: Annotated[ImageFormat, typer.Option(help="How frames are sent.")] = "png",
    render_quality: Annotated[Quality, typer.Option(help="fast draws twice as many frames a second.")] = "default",
    save_frames: Annotated[bool, typer.Option("--save-frames", help="Keep every frame, by content hash.")] = False,
    backend: Annotated[str, typer.Option(help="Simulator: mujoco, or fake (no engine).")] = "mujoco",
    assets: Assets = None,
    reply_seconds: Annotated[int, typer.Option(min=1, help="How long one reply may take.")] = REPLY_SECONDS,
    seed: Annotated[int, typer.Option(help="For scheduling and scripted agents.")] = 0,
    no_preflight: Annotated[bool, typer.Option("--no-preflight", help="Do not first prove that it sees.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say calls and tokens, play nothing.")] = False,
    prices: Annotated[str | None, typer.Option(help="IN,OUT per million tokens: a dry run says costs too.")] = None,
) -> None:  # fmt: skip
    """Plays a pack with a model or an agent, and prints the table.

    Examples:
    vigil run --pack starter --agent solver --log-dir runs/solver
    vigil run --pack starter --model openai/gpt-4o --log-dir runs/gpt-4o
    """
    player = _known_agent(_only("--agent", agent))
    settings = RunSettings(
        pack=pack, families=_families(family or []), episode_ids=tuple(episode or []), limit=limit, epochs=epochs,
        agent=player, agent_factory=privileged_agent if player in PRIVILEGED else None, seed=seed,
        model=_only("--model", model), base_url=base_url, api_key_env=api_key_env,
        model_args=_model_args(model_arg or []), extra_body=_extra_body(extra_body),
        temperature=temperature, top_p=top_p, max_tokens=max_tokens, reasoning_effort=reasoning_effort,
        profile=_profile(profile), prompt_variant=prompt_variant, coordinates=coordinates, reply_policy=reply_policy,
        image_format=image_format, render_quality=render_quality, save_frames=save_frames, log_dir=log_dir,
        backend=backend, asset_database=assets,
        workers=workers, max_connections=max_connections, reply_seconds=reply_seconds, preflight=not no_preflight,
    )  # fmt: skip
    say(manifest_of(pack).version_notes)
    if dry_run:
        _print_estimate(settings, _prices(prices))
    elif prices is not None:
        raise SettingError("--prices is for an estimate: add --dry-run, or leave it out.")
    else:
        _play(settings)


def verify(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    frames: Annotated[bool, typer.Option("--frames", help="Compare kept frames too (same renderer).")] = False,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first N records.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Simulator processes.", show_default="one a CPU")] = None,
    pack: Annotated[str | None, typer.Option(help="Where the pack is now.", show_default="as recorded")] = None,
    assets: Assets = None,
) -> None:
    """Plays the recorded actions again and compares every hidden state; exits with 1 when one differs.

    Example: vigil verify runs/solver
    """
    settings = VerifySettings(pack=pack, asset_database=assets, workers=workers, limit=limit, frames=frames)
    with counting("verify") as show:
        found = verify_run(run, settings, on_progress=show)
    say((*found.header.version_notes, *found.notes))
    for difference in found.differences:
        print(difference)
    kind = "exactly" if found.is_exact else "within 1 mm and 0.01 degrees"
    pictures = f" and {found.frames} frames" if frames else ""
    print(f"{found.checked} episodes played again{pictures}, compared {kind}: {len(found.differences)} differences")
    if not found.checked:
        print("Nothing was verified: the run has no episode that ended without error.")
    elif frames and not found.frames:
        print("No frame was compared: nobody looked at any in this run.")
    if found.errors:
        print(f"{found.errors} rows ended as errors: nothing to verify in them.")
    if found.left_out:
        print(f"{found.left_out} rows of the file are not verified: they are not scored either (see above).")
    if not found.is_verified:
        raise typer.Exit(1)


def _play(settings: RunSettings) -> None:
    if settings.model is not None and settings.coordinates is None:
        print(f"Coordinates: {profile_of(settings).coordinates} (published table; --coordinates overrides).")
    with Live(settings.model or public_name(settings.agent or "")) as live:
        result = run_pack(settings, on_progress=live.show)
    _print_result(result)
    if not result.is_complete:
        raise typer.Exit(1)


def _profile(name: str) -> str:
    full = _SHORT_PROFILES.get(name, name)
    if full not in PROFILE_NAMES:
        known = (*_SHORT_PROFILES, *PROFILE_NAMES)
        raise SettingError(f"Profile {name!r} does not exist.{did_you_mean(name, known)} Choose {' or '.join(known)}.")
    return full


def _prices(text: str | None) -> tuple[float, float] | None:
    """Returns what a million input and output tokens cost."""
    if text is None:
        return None
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = -1.0
    if not (math.isfinite(low + high) and min(low, high) >= 0):
        raise SettingError(f"--prices {text!r} is not IN,OUT in money per million tokens, e.g. --prices 2.5,10.")
    return low, high


def _only(option: str, values: list[str] | None) -> str | None:
    if values is None or len(values) < 2:
        return values[0] if values else None
    given = ", ".join(map(public_name, values))
    raise SettingError(
        f"{option} is given {len(values)} times ({given}); a run has one. Run each into a --log-dir of its own, then "
        "put them side by side: vigil score RUN RUN."
    )


def _known_agent(name: str | None) -> str | None:
    known = (*PRIVILEGED, *SCRIPTS)
    if name is not None and name not in known and not is_exec(name):
        hint = did_you_mean(name, known)
        raise SettingError(f"Agent {name!r} does not exist.{hint} Choose one of {', '.join(known)}, or exec:COMMAND.")
    return name


def _families(names: list[str]) -> tuple[Family, ...]:
    wanted = {name.strip().upper() for names_ in names for name in names_.split(",")}
    for name in sorted(wanted - FAMILIES.keys()):
        raise SettingError(f"Family {name!r} does not exist. The families: {', '.join(FAMILIES)}.")
    return tuple(family for family in FAMILIES if family in wanted)


def _model_args(pairs: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for pair in pairs:
        name, sign, value = pair.partition("=")
        if not sign or not name:
            shown = without_options(pair)
            raise SettingError(f"--model-arg {shown!r} is not K=V, e.g. --model-arg api_version=2024-10-21.")
        try:
            found[name] = read_json(value)
        except ValueError:
            found[name] = value
    return found


def _extra_body(text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    try:
        found = read_json(text)
    except ValueError as error:
        raise SettingError(f"--extra-body is not JSON: {error}.") from None
    if not isinstance(found, dict):
        raise SettingError("--extra-body must be a JSON object, e.g. '{\"top_k\": 20}'.")
    return found


def _print_estimate(settings: RunSettings, prices: tuple[float, float] | None) -> None:
    expected = estimate(settings)
    if settings.model is None:
        print(f"{expected.episodes} episodes; {public_name(settings.agent or '')} calls no model.")
        return
    print(f"{expected.episodes} episodes; nothing was sent. Bounds, from a report at once to every step used:")
    for name in ("calls", "input_tokens", "output_tokens"):
        low, high = getattr(expected, name)
        print(f"{name.replace('_', ' '):14} {low:>14,} .. {high:>14,}")
    if prices is not None:
        low, high = expected.cost(*prices)
        print(f"{'cost':14} {low:>14,.2f} .. {high:>14,.2f}")


def _print_result(result: RunResult) -> None:
    say(result.notes)
    settlement = settle_run(result.episodes, result.records, result.header.spec.epochs)
    print_families(label_of(result.header), settlement)
    if result.torn is not None:
        print(f"The last run was cut off while it wrote a row; what there was of it is in {result.torn}.")
    if result.resumed:
        print(f"Played before, and not again: {result.resumed} of {len(result.records)} episodes.")
    print(f"Records: {result.folder}")
    if not result.is_complete:
        print(f"{result.errors} episodes ended as errors and are not scored; the same command plays them again.")
        print(f"What agents and simulators wrote to standard error: {result.folder / LOGS_FOLDER}")
