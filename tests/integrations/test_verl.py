"""verl: rows of its data set, and the agent loop, whose outputs are compared with what was played.

The agent loop is tested where verl and TRL are installed, with the tiny processor of the example.
"""

import asyncio
import importlib.util
import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.errors import PackMismatch, SettingError
from vigil.integrations.doctor import REPLIES, decode_patches
from vigil.integrations.verl import VerlOptions, write_rows
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.sim import make_simulator

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_tiny_vlm.py"
RESPONSE_LENGTH = 400


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("verl") / "pack", 4)


def rows_of(folder: Path, **options: Any) -> list[dict[str, Any]]:
    write_rows(folder / "rows.parquet", **options)
    return pq.read_table(folder / "rows.parquet").to_pylist()


def test_a_row_names_the_episode_and_nothing_hidden(pack: Pack, tmp_path: Path) -> None:
    rows = rows_of(tmp_path, pack=str(pack.folder), family="SV,DA")
    for index, row in enumerate(rows):
        episode = pack.episode(row["extra_info"]["episode_id"])
        assert episode.family in ("SV", "DA")
        assert row == {
            "data_source": "vigil",
            "agent_name": "vigil",
            "prompt": [{"role": "user", "content": episode.instruction}],
            "extra_info": {
                "index": index,
                "episode_id": episode.id,
                "house": None,
                "source": f"tiny@{pack.sha256}",
            },
        }
    assert len(rows) == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [({"pack": "stream:7"}, "endless"), ({"pak": "starter"}, "no option 'pak'"), ({"workers": 0}, "workers")],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=message):
        write_rows(tmp_path / "rows.parquet", **options)
    assert not (tmp_path / "rows.parquet").exists()


@pytest.fixture(scope="module")
def processor() -> Any:
    pytest.importorskip("verl", reason="verl is not installed: docs/verl.md says how")
    pytest.importorskip("trl", reason="trl is not installed: docs/trl.md says how")
    spec = importlib.util.spec_from_file_location("train_tiny_vlm", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    text = {"type": "text", "text": "\n".join(REPLIES)}
    return example.processor_of([[{"role": "assistant", "content": [text]}]])


class Server:
    """A model server of verl that gives fixed replies."""

    def __init__(self, processor: Any) -> None:
        self._processor = processor
        self.asked: list[dict[str, Any]] = []

    async def generate(self, **request: Any) -> Any:
        """Return the tokens of the next reply."""
        tokens = self._processor.tokenizer.encode(REPLIES[len(self.asked)] + "<|im_end|>")
        self.asked.append(request)
        return import_module("verl.workers.rollout.replica").TokenOutput(
            token_ids=tokens, log_probs=[-0.5] * len(tokens)
        )


@pytest.fixture(scope="module")
def played(pack: Pack, processor: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A function that plays a row of the pack through the agent loop, and returns the outputs and the server."""
    create = import_module("omegaconf").OmegaConf.create
    wrap = import_module("verl.experimental.agent_loop.agent_loop").DictConfigWrap
    dataset = import_module("verl.utils.dataset.rl_dataset").RLHFDataset
    agent_loop = import_module("vigil.integrations.verl.agent_loop").VigilAgentLoop
    folder = tmp_path_factory.mktemp("rows")
    lengths = {"prompt_length": 20_000, "response_length": RESPONSE_LENGTH}
    config = create({"actor_rollout_ref": {"rollout": lengths}, "data": {}})
    options = create({"pack": str(pack.folder), "backend": "fake", "family": ["DA"], "world_reward": 0.25})

    def play(**change: Any) -> tuple[list[Any], Server]:
        server = Server(processor)
        (row,) = rows_of(folder, pack=str(pack.folder), family="DA")
        row["extra_info"] |= change

        async def run() -> list[Any]:
            loop = agent_loop(
                trainer_config=wrap(config), server_manager=server, tokenizer=processor.tokenizer,
                processor=processor, dataset_cls=dataset, data_config=wrap(config.data),
                hf_model_type="qwen2_5_vl", options=options,
            )  # fmt: skip
            return await loop.run({"temperature": 1.0}, raw_prompt=row["prompt"], extra_info=row["extra_info"])

        return asyncio.run(run()), server

    return play


@pytest.mark.filterwarnings("ignore")
def test_each_turn_is_an_output_with_what_was_played(pack: Pack, processor: Any, played: Any) -> None:
    outputs, server = played()
    assert len(outputs) == len(server.asked) == len(REPLIES)
    (episode,) = [each for each in pack.episodes if each.family == "DA"]
    simulator = make_simulator("fake", assets=AssetDatabase.default())
    with Env(simulator, lambda _: pack.house_of(episode), VerlOptions.of({"backend": "fake"}).condition) as env:
        observation = env.reset(episode)
        for output, reply, asked in zip(outputs, REPLIES, server.asked, strict=True):
            assert observation is not None
            (image,) = output.multi_modal_data["images"]
            assert np.array_equal(np.asarray(image), observation.rgb)
            assert output.prompt_ids == asked["prompt_ids"]
            prompt = processor.tokenizer.decode(output.prompt_ids)
            assert episode.instruction in prompt
            assert prompt.count('"role": "past"') == len(env.steps)
            assert processor.tokenizer.decode(output.response_ids, skip_special_tokens=True).strip() == reply
            assert output.response_mask == [1] * len(output.response_ids)
            assert output.response_logprobs == [-0.5] * len(output.response_ids)
            observation = env.step(Reply(text=reply))
    assert env.end == "report"
    assert {output.reward_score for output in outputs} == {0.0}
    assert outputs[-1].extra_fields["reward_extra_info"]["B"] == 0.0


@pytest.mark.filterwarnings("ignore")
def test_the_trainer_computes_the_pictures_that_were_played(processor: Any, played: Any) -> None:
    outputs, _ = played()
    worker = object.__new__(import_module("verl.experimental.agent_loop.agent_loop").AgentLoopWorker)
    worker.processor, worker.tokenizer, worker.mm_processor_kwargs = processor, processor.tokenizer, {}
    for output in outputs:
        ids = import_module("torch").tensor(output.prompt_ids + output.response_ids)
        inputs = worker._compute_multi_modal_inputs(output, ids)
        patches, grids = inputs["pixel_values"].numpy(), inputs["image_grid_thw"].numpy()
        (picture,) = decode_patches(processor.image_processor, patches, grids)
        (frame,) = output.multi_modal_data["images"]
        small = np.asarray(frame.resize((picture.shape[1], picture.shape[0]), 3), float) / 255
        assert np.abs(picture - small).mean() < 0.04
        merged = processor.image_processor.merge_size**2
        image_pad = processor.tokenizer.convert_tokens_to_ids("<|image_pad|>")
        assert int((ids == image_pad).sum()) == int(grids.prod()) // merged


@pytest.mark.filterwarnings("ignore")
def test_a_row_of_another_pack_is_refused(played: Any) -> None:
    with pytest.raises(PackMismatch, match="this agent loop plays"):
        played(source="other@0")


def test_the_page_shows_the_configuration_that_is_tested() -> None:
    """The options of the page's configuration are options of the agent loop."""
    page = (Path(__file__).parents[2] / "docs" / "verl.md").read_text(encoding="utf-8")
    assert "_target_: vigil.integrations.verl.agent_loop.VigilAgentLoop" in page
    options = json.loads(page.split("  options: ")[1].splitlines()[0])
    assert VerlOptions.of(options).family == ["PG"]
