"""A tiny vision-language model takes supervised steps on demonstrations, then GRPO steps on B with TRL.

    pip install vigil-bench trl 'transformers>=5.13' torchvision
    pip install torch --index-url https://download.pytorch.org/whl/cpu      # for processors only; 200 MB, not 3 GB
    python examples/train_tiny_vlm.py --out runs/tiny

It shows that the whole chain works, on a processor and without a download; a model of this size learns to answer in
form, not to point. The model is of the architecture of Qwen2.5-VL, begins with random weights, and has a tokenizer that
is trained on the demonstrations. Demonstrations and GRPO use the pointing episodes of one small room of a stream.

To train a real model, replace `processor_of` and `model_of` by `AutoProcessor.from_pretrained` and
`AutoModelForImageTextToText.from_pretrained`, and read more houses (docs/trl.md).
"""

import argparse
import csv
import io
import json
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
from PIL import Image

from vigil.integrations.trl import Episodes, protocol_processor, valid_replies


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for results; demonstrations in it are reused")
    parser.add_argument("--supervised", type=int, default=60, help="number of supervised steps (60)")
    parser.add_argument("--grpo", type=int, default=80, help="number of GRPO steps (80)")
    parser.add_argument("--every", type=int, default=20, help="supervised steps between tests (20)")
    parser.add_argument("--group", type=int, default=8, help="number of rollouts of each episode (8)")
    parser.add_argument("--seed", type=int, default=0, help="random seed of the model and its samples (0)")
    return parser.parse_args()


# Before the learning libraries are imported, so that --help works without them.
GIVEN = read_options() if __name__ == "__main__" else None

try:
    # The development environment has none of these.
    import torch  # pyright: ignore[reportMissingImports]
    import transformers as hf  # pyright: ignore[reportMissingImports]
    from datasets import Dataset  # pyright: ignore[reportMissingImports]
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers  # pyright: ignore[reportMissingImports]
    from trl import GRPOConfig, GRPOTrainer  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise SystemExit(f"{error.name} is not installed. The docstring of this file says how to install it.") from None

ROOM = {"pack": "stream:7", "family": "PG", "houses": (15, 16), "quality": "fast"}
"""The pointing episodes of one bathroom."""
EPISODES = 3
LONGEST = 4096
"""Greatest number of tokens of a conversation."""
SPECIAL = (
    "<|endoftext|>",
    "<|im_start|>",
    "<|im_end|>",
    "<|vision_start|>",
    "<|vision_end|>",
    "<|image_pad|>",
    "<|video_pad|>",
)
TEMPLATE = """\
{%- for message in messages -%}
<|im_start|>{{ message.role }}
{% if message.content is string %}{{ message.content }}{% else %}
{%- for part in message.content -%}
{% if part.type == 'image' %}<|vision_start|><|image_pad|><|vision_end|>{% else %}{{ part.text }}{% endif %}
{%- endfor -%}
{% endif %}<|im_end|>
{% endfor -%}
{% if add_generation_prompt %}<|im_start|>assistant
{% endif %}"""


def main(given: argparse.Namespace) -> None:
    torch.set_num_threads(1)
    hf.set_seed(given.seed)
    given.out.mkdir(parents=True, exist_ok=True)
    chats = read_demos(write_demos(given.out / "demos"))
    processor = protocol_processor(processor_of(chats))
    model = model_of(processor)
    episodes = Episodes(**ROOM)
    curve = Curve(given.out)
    trainer = trainer_of(model, processor, episodes, given)
    curve.test(trainer, "random weights", 0)
    for step in supervise(model, processor, chats, given.supervised):
        if step % given.every == 0 or step == given.supervised:
            curve.test(trainer, "supervised", step)
    trainer.train()
    curve.add_training(trainer)
    curve.test(trainer, "GRPO", given.grpo)
    episodes.close()


def write_demos(out: Path) -> Path:
    """Write demonstrations of the room, unless they are there; return the file."""
    if not (out / "train.parquet").exists():
        words = ["demos", "--pack", ROOM["pack"], "--family", ROOM["family"], "--houses", "15:16"]
        words += ["--count", EPISODES, "--format", "parquet", "--profile", "image_history_all"]
        words += ["--render-quality", ROOM["quality"], "--out", out]
        started = [sys.executable, "-c", "from vigil.cli import main; main()", *map(str, words)]
        subprocess.run(started, check=True)
    return out / "train.parquet"


def read_demos(file: Path) -> list[list[dict]]:
    """Return a conversation for each episode: its last row has all turns, because past turns never change."""
    last = {row["episode_id"]: row for row in pq.read_table(file).to_pylist() if row["kind"] == "demonstration"}
    return [chat_of(row) for row in last.values()]


def chat_of(row: dict) -> list[dict]:
    pictures = iter([Image.open(io.BytesIO(image["bytes"])) for image in row["images"]])

    def part_of(part: dict) -> dict:
        return {"type": "image", "image": next(pictures)} if part["type"] == "image" else part

    return [{"role": m["role"], "content": [part_of(part) for part in m["content"]]} for m in row["messages"]]


def processor_of(chats: list[list[dict]]) -> hf.ProcessorMixin:
    """Return a processor whose tokenizer is trained on the texts of conversations; it shrinks frames to 112 x 84.

    A token may be a whole line, so that conversations are short. Digits are tokens of their own.
    """
    bpe = Tokenizer(models.BPE())
    bpe.pre_tokenizer = pre_tokenizers.Sequence([
        pre_tokenizers.Digits(individual_digits=True), pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False)
    ])  # fmt: skip
    bpe.decoder = decoders.ByteLevel()
    texts = [part["text"] for chat in chats for message in chat for part in message["content"] if part.get("text")]
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    bpe.train_from_iterator(
        texts, trainers.BpeTrainer(vocab_size=3000, special_tokens=list(SPECIAL), initial_alphabet=alphabet)
    )
    tokenizer = hf.PreTrainedTokenizerFast(
        tokenizer_object=bpe, eos_token="<|im_end|>", pad_token="<|endoftext|>", padding_side="left",
        extra_special_tokens=list(SPECIAL),
    )  # fmt: skip
    pixels = 112 * 84
    return hf.Qwen2_5_VLProcessor(
        hf.Qwen2VLImageProcessor(min_pixels=pixels, max_pixels=pixels),
        tokenizer,
        hf.Qwen2VLVideoProcessor(),
        chat_template=TEMPLATE,
    )


def model_of(processor: hf.ProcessorMixin) -> hf.PreTrainedModel:
    """Return a model of Qwen2.5-VL's architecture with random weights, for the tokens of a processor."""
    tokenizer = processor.tokenizer
    number = dict(zip(SPECIAL, tokenizer.convert_tokens_to_ids(list(SPECIAL)), strict=True))
    text = {
        "vocab_size": len(tokenizer), "hidden_size": 96, "intermediate_size": 256, "num_hidden_layers": 3,
        "num_attention_heads": 4, "num_key_value_heads": 2, "max_position_embeddings": LONGEST,
        "rope_parameters": {"rope_type": "default", "rope_theta": 10000.0, "mrope_section": [4, 4, 4]},
        "bos_token_id": number["<|endoftext|>"], "eos_token_id": number["<|im_end|>"],
        "pad_token_id": number["<|endoftext|>"],
    }  # fmt: skip
    vision = {
        "depth": 2, "hidden_size": 64, "intermediate_size": 128, "num_heads": 4, "out_hidden_size": 96,
        "fullatt_block_indexes": [1],
    }  # fmt: skip
    config = hf.Qwen2_5_VLConfig(
        text_config=text,
        vision_config=vision,
        image_token_id=number["<|image_pad|>"],
        video_token_id=number["<|video_pad|>"],
        vision_start_token_id=number["<|vision_start|>"],
        vision_end_token_id=number["<|vision_end|>"],
        tie_word_embeddings=True,
    )
    model = hf.Qwen2_5_VLForConditionalGeneration(config)
    model.generation_config.eos_token_id = number["<|im_end|>"]
    model.generation_config.pad_token_id = number["<|endoftext|>"]
    return model


def trainer_of(
    model: hf.PreTrainedModel, processor: hf.ProcessorMixin, episodes: Episodes, given: argparse.Namespace
) -> GRPOTrainer:
    rows = Dataset.from_list(episodes.rows())
    config = GRPOConfig(
        output_dir=str(given.out / "trainer"),
        max_steps=given.grpo,
        num_generations=given.group,
        num_generations_eval=given.group,
        per_device_train_batch_size=EPISODES * given.group,
        per_device_eval_batch_size=EPISODES * given.group,
        max_completion_length=160,
        generation_kwargs={"suppress_tokens": processor.tokenizer.convert_tokens_to_ids(list(SPECIAL[3:]))},
        max_tool_calling_iterations=4,
        learning_rate=3e-4,
        lr_scheduler_type="constant",
        reward_weights=[0.0],  # of `valid_replies`; that of the environment, B, is 1
        logging_steps=1,
        save_strategy="no",
        report_to="none",
        use_cpu=True,
        bf16=False,
        gradient_checkpointing=False,
        seed=given.seed,
    )
    return GRPOTrainer(
        model=model,
        args=config,
        processing_class=processor,
        train_dataset=rows,
        eval_dataset=rows,
        reward_funcs=[valid_replies],
        environment_factory=episodes.environment,
    )


def supervise(model: hf.PreTrainedModel, processor: hf.ProcessorMixin, chats: list[list[dict]], steps: int):
    """Train the model on all answers of the conversations; yield the number of each step, from 1."""
    optimiser = torch.optim.AdamW(model.parameters(), lr=3e-3)
    batch = batch_of(processor, chats)
    model.train()
    for step in range(1, steps + 1):
        loss = model(**batch).loss
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if step % 10 == 0:
            print(f"supervised step {step}: loss {loss.item():.3f}", flush=True)
        yield step


def batch_of(processor: hf.ProcessorMixin, chats: list[list[dict]]) -> dict:
    """Return conversations as tensors. Labels are the tokens of answers with their end, and -100 elsewhere."""
    batch = processor.apply_chat_template(
        chats, tokenize=True, return_dict=True, return_tensors="pt", processor_kwargs={"padding": True}
    )
    header = processor.tokenizer.encode("<|im_start|>assistant\n")
    labels = torch.full_like(batch["input_ids"], -100)
    for row, ids in enumerate(batch["input_ids"].tolist()):
        for start in range(len(ids) - len(header)):
            if ids[start : start + len(header)] == header:
                begin = start + len(header)
                end = ids.index(processor.tokenizer.eos_token_id, begin) + 1
                labels[row, begin:end] = batch["input_ids"][row, begin:end]
    return {**batch, "labels": labels}


class Curve:
    """Shares of valid replies and of B as training goes on, as a table that grows."""

    def __init__(self, out: Path) -> None:
        self._file, self._began = out / "curve.csv", time.monotonic()
        self._rows: list[dict] = []

    def test(self, trainer: GRPOTrainer, stage: str, step: int) -> None:
        """Play a group of each episode with the model as it is."""
        found = trainer.evaluate()
        self._add(stage, step, found, "eval_rewards")
        trainer.model.train()

    def add_training(self, trainer: GRPOTrainer) -> None:
        """Add the rollouts of each GRPO step."""
        for found in trainer.state.log_history:
            if "rewards/valid_replies/mean" in found:
                self._add("GRPO rollouts", found["step"], found, "rewards")

    def _add(self, stage: str, step: int, found: dict, prefix: str) -> None:
        valid, b = (found[f"{prefix}/{name}/mean"] for name in ("valid_replies", "VigilReplies"))
        minutes = round((time.monotonic() - self._began) / 60, 1)
        self._rows.append({"stage": stage, "step": step, "minutes": minutes, "valid": valid, "B": b})
        print(json.dumps(self._rows[-1]), flush=True)
        with self._file.open("w", newline="") as file:
            table = csv.DictWriter(file, list(self._rows[0]))
            table.writeheader()
            table.writerows(self._rows)


if GIVEN is not None:
    main(GIVEN)
