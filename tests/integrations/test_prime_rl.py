"""prime-rl: the configuration, and the samples that its trainer computes, compared with what was played.

Everything but the configuration is tested where prime-rl is installed (docs/prime_rl.md says how).
"""

import asyncio
import importlib.util
import json
import os
import socket
import subprocess
import sys
import threading
import tomllib
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vigil.env import Env
from vigil.integrations.doctor import REPLIES, decode_patches
from vigil.integrations.verl import VerlOptions
from vigil.integrations.verl.rows import source_of_options
from vigil.protocol.actions import Reply
from vigil.sim import make_simulator

FOLDER = Path(__file__).parents[2]
FILE = FOLDER / "examples" / "prime_rl.toml"
HOUSES = {"houses": [15, 16]}
"""The cheapest house of the stream."""
SPECIAL = (
    *("<|endoftext|>", "<|im_start|>", "<|im_end|>", "<think>", "</think>", "<tool_call>", "</tool_call>"),
    *("<tool_response>", "</tool_response>", "<|vision_start|>", "<|vision_end|>", "<|image_pad|>", "<|video_pad|>"),
)
ENCODERS = {
    "entrypoints/scale_out/token_in_token_out/mm_serde.py": "def encode_mm_kwargs_item(item):\n    return item\n",
    "model_executor/models/qwen2_vl.py": "def _create_qwen2vl_field_factory(size):\n    return lambda inputs: None\n",
    "multimodal/inputs.py": (
        "class MultiModalKwargsItems:\n"
        "    @staticmethod\n"
        "    def from_hf_inputs(inputs, config):\n"
        "        return {'image': [list(inputs['pixel_values'].shape)]}\n"
    ),
}
"""In place of vLLM, where it is not installed: what encodes pictures for a server, here as their shapes."""


def taskset_of(split: str) -> dict[str, Any]:
    (source,) = tomllib.loads(FILE.read_text(encoding="utf-8"))["orchestrator"][split]["source"]
    return source["env"]["taskset"]


def test_the_configuration_trains_on_a_stream_and_tests_in_other_houses() -> None:
    ranges = []
    for split in ("train", "eval"):
        given = taskset_of(split)
        assert given.pop("id") == "vigil-verifiers"
        options = VerlOptions.of(given)
        assert str(options.pack).startswith("stream:")
        assert options.profile == "baseline"
        assert options.houses is not None
        ranges.append(options.houses)
    (first, end), (held_out, _) = ranges
    assert first < end <= held_out


def test_the_page_has_the_configuration() -> None:
    page = (FOLDER / "docs" / "prime_rl.md").read_text(encoding="utf-8")
    assert f"```toml\n{FILE.read_text(encoding='utf-8')}```" in page


@pytest.fixture(scope="module")
def prime_rl() -> None:
    pytest.importorskip("prime_rl.configs.rl", reason="prime-rl is not installed: docs/prime_rl.md says how")


@pytest.fixture(scope="module")
def written(prime_rl: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the configurations that prime-rl's own command makes of the file."""
    folder = tmp_path_factory.mktemp("prime_rl")
    asked = ["--dry-run", "--output-dir", str(folder), "--run.name", "check"]
    command([sys.executable, "-m", "prime_rl.entrypoints.rl", "@", str(FILE), *asked], os.environ)
    return folder / "check" / "configs"


def command(words: list[str], environment: Any) -> None:
    ran = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr[-2000:]


def test_prime_rl_reads_the_configuration(written: Path) -> None:
    given = json.loads((written / "orchestrator.json").read_text(encoding="utf-8"))
    (source,) = given["train"]["source"]
    options = source["env"]["taskset"]
    assert (options["pack"], options["family"], options["houses"]) == ("stream:7", ["PG"], [0, 200])
    assert (source["group_size"], source["sampling"]["max_completion_tokens"]) == (8, 512)
    assert {file.stem for file in written.glob("envs/*/*.json")} == {"vigil", "vigil-held-out"}


@pytest.fixture(scope="module")
def model(prime_rl: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a processor of Qwen3.5's architecture whose tokens are bytes."""
    hf, tokenizers = import_module("transformers"), import_module("tokenizers")
    alphabet = sorted(tokenizers.pre_tokenizers.ByteLevel.alphabet())
    core = tokenizers.Tokenizer(tokenizers.models.BPE({each: i for i, each in enumerate(alphabet)}, []))
    core.pre_tokenizer = tokenizers.pre_tokenizers.ByteLevel(add_prefix_space=False)
    core.decoder = tokenizers.decoders.ByteLevel()
    tokenizer = hf.PreTrainedTokenizerFast(
        tokenizer_object=core, eos_token="<|im_end|>", pad_token="<|endoftext|>", extra_special_tokens=list(SPECIAL)
    )
    image_processor = hf.Qwen2VLImageProcessor(patch_size=16, merge_size=2)
    processor = hf.Qwen3VLProcessor(image_processor, tokenizer, hf.Qwen3VLVideoProcessor(), chat_template="{{ '' }}")
    folder = tmp_path_factory.mktemp("model")
    processor.save_pretrained(folder)
    return folder


class _Engine(BaseHTTPRequestHandler):
    """Answers each request of tokens with the tokens of its turn's reply."""

    asked: list[dict[str, Any]]
    tokenizer: Any

    def do_GET(self) -> None:
        self._send({"data": []})

    def do_POST(self) -> None:
        request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.asked.append(request)
        turn = self.tokenizer.decode(request["token_ids"]).count("<|im_start|>assistant") - 1
        tokens = self.tokenizer.encode(REPLIES[turn] + "<|im_end|>", add_special_tokens=False)
        told = [{"token": f"token_id:{token}", "logprob": -0.5} for token in tokens]
        choice = {"token_ids": tokens, "logprobs": {"content": told}, "finish_reason": "stop"}
        self._send({"request_id": "1", "choices": [choice]})

    def _send(self, answer: dict[str, Any]) -> None:
        body = json.dumps(answer).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def engine(model: Path) -> Iterator[tuple[str, Any]]:
    """A server in place of vLLM: its address, and the class that keeps what it was asked."""
    tokenizer = import_module("transformers").AutoTokenizer.from_pretrained(model)
    handler = type("Engine", (_Engine,), {"asked": [], "tokenizer": tokenizer})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/v1", handler
        server.shutdown()


@pytest.fixture(scope="module")
def played(written: Path, model: Path, engine: tuple[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Two rollouts of the first row, played by the server that prime-rl's own command starts, and their source."""
    source_of = import_module("prime_rl.configs.orchestrator").TrainSourceConfig
    given = json.loads((written / "envs" / "train" / "vigil.json").read_text(encoding="utf-8"))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        given["serve"]["address"] = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    given["env"]["taskset"] |= HOUSES
    folder = tmp_path_factory.mktemp("server")
    (folder / "vigil.json").write_text(json.dumps(given), encoding="utf-8")
    path = os.pathsep.join([str(encoders(folder)), os.environ.get("PYTHONPATH", "")])
    words = [sys.executable, "-m", "prime_rl.entrypoints.env_server", "@", str(folder / "vigil.json")]
    server = subprocess.Popen(words, env={**os.environ, "PYTHONPATH": path})
    try:
        source = source_of.model_validate({"env": given["env"], "name": "vigil"})
        yield asyncio.run(play(source, given["serve"]["address"], model, engine[0]))
    finally:
        server.terminate()
        server.wait()


def encoders(folder: Path) -> Path:
    """Write what stands in for vLLM, unless vLLM is installed; return the folder to import it from."""
    if importlib.util.find_spec("vllm") is None:
        for name, text in ENCODERS.items():
            (folder / "vllm" / name).parent.mkdir(parents=True)
            (folder / "vllm" / name).write_text(text, encoding="utf-8")
    return folder


async def play(source: Any, address: str, model: Path, url: str) -> tuple[Any, list[Any]]:
    """Return the row and the traces, asked for as prime-rl's orchestrator asks."""
    env = import_module("prime_rl.orchestrator.envs").Env(source, address)
    env.sampling_args = source.sampling.to_sampling_args()
    await env.start()
    client = import_module("prime_rl.utils.client").setup_client(
        import_module("prime_rl.configs.shared").ClientConfig(base_url=url),
        client_type="renderer",
        renderer_config=import_module("renderers.configs").Qwen35RendererConfig(enable_thinking=False),
        renderer_model_name=str(model),
    )
    row = next(iter(env.tasks))
    try:
        data = row.data.model_dump(mode="json")
        episodes = await asyncio.gather(*(env.run(client, str(model), None, data) for _ in range(2)))
    finally:
        await env.env_client.close()
    return row.data, [trace for episode in episodes for trace in episode.traces]


@pytest.mark.filterwarnings("ignore")
def test_the_trainer_gets_a_sample_a_turn_with_the_frame_that_was_played(model: Path, played: Any) -> None:
    row, traces = played
    assert len(traces) == 2
    processor = import_module("transformers").AutoProcessor.from_pretrained(model)
    image_pad = processor.tokenizer.convert_tokens_to_ids("<|image_pad|>")
    to_samples = import_module("prime_rl.orchestrator.trajectories").trace_to_samples
    frames, record = frames_of(row)
    for trace in traces:
        assert trace.ok, trace.errors
        samples = to_samples(trace, env_name="vigil", mm_token_type_ids_mapping={image_pad: 1})
        assert len(samples) == len(REPLIES)
        for number, (sample, frame, reply) in enumerate(zip(samples, frames, REPLIES, strict=True)):
            grid, patches = (array_of(sample.mm_kwargs[name]) for name in ("image_grid_thw", "pixel_values"))
            (picture,) = decode_patches(processor.image_processor, patches, grid)
            assert np.abs(picture * 255 - frame).max() < 0.5
            merged = processor.image_processor.merge_size**2
            assert sample.mm_token_type_ids.count(1) == sample.token_ids.count(image_pad) == int(grid.prod()) // merged
            text = processor.tokenizer.decode(sample.token_ids)
            assert row.prompt in text
            assert text.count('"role": "past"') == number
            trained = [token for token, is_trained in zip(sample.token_ids, sample.mask, strict=True) if is_trained]
            assert processor.tokenizer.decode(trained).removesuffix("<|im_end|>") == reply
            told = [each for each, is_trained in zip(sample.logprobs, sample.mask, strict=True) if is_trained]
            assert told == [-0.5] * len(trained)
    assert record.end == "report"
    assert [trace.reward for trace in traces] == [0.0, 0.0]


@pytest.mark.filterwarnings("ignore")
def test_packed_batches_keep_the_pictures(model: Path, played: Any) -> None:
    """What the orchestrator sends to the trainer's processes, and what these make of it."""
    batch = import_module("prime_rl.trainer.batch")
    to_samples = import_module("prime_rl.orchestrator.trajectories").trace_to_samples
    traced = [to_samples(trace, env_name="vigil", mm_token_type_ids_mapping={}) for trace in played[1]]
    samples = [sample for each in traced for sample in each]
    for sample in samples:
        sample.temperatures, sample.advantages = [1.0] * len(sample.token_ids), [0.5] * len(sample.token_ids)
    (packed,) = batch.prepare_batch(samples, 8192, 1, batch.build_bin_cost(None))
    loader = object.__new__(import_module("prime_rl.trainer.rl.data").DataLoader)
    pixels = [loader._micro_batch_to_tensor(each)["mm_kwargs"]["pixel_values"].numpy() for each in packed]
    wanted = [array_of(sample.mm_kwargs["pixel_values"]) for sample in samples]
    assert sorted(part.tobytes() for each in pixels for part in np.split(each, len(each) // len(wanted[0]))) == sorted(
        each.tobytes() for each in wanted
    )


def array_of(tensor: Any) -> np.ndarray:
    return np.frombuffer(tensor.data, tensor.dtype).reshape(tensor.shape)


def frames_of(row: Any) -> tuple[list[np.ndarray], Any]:
    """Return the frames and the record of the row's episode with the fixed replies, played without prime-rl."""
    options = VerlOptions.of({name: value for name, value in taskset_of("train").items() if name != "id"} | HOUSES)
    source = source_of_options(options)
    try:
        now = source.of_row(row.id, row.house)
    finally:
        source.close()
    simulator = make_simulator(options.backend, assets=options.assets, quality=options.quality)
    frames = []
    with Env(simulator, lambda _: now.house, options.condition) as env:
        observation = env.reset(now.episode)
        for reply in REPLIES:
            assert observation is not None
            frames.append(observation.rgb)
            observation = env.step(Reply(text=reply))
        return frames, env.record()
