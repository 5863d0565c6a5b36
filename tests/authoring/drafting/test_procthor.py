"""ProcTHOR-10K by name: split and index, one download that is announced, only the lines that are asked for."""

import sys
from pathlib import Path

import pytest

from tests.support.fake_prior import FakePrior, as_procthor_writes
from vigil.authoring.drafting.procthor import REVISION, NamedHouses, is_dataset, named, split_file
from vigil.authoring.drafting.sources import HouseInFile, house_at, houses_from, read_all
from vigil.errors import HouseError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House


@pytest.fixture(scope="module")
def bathroom() -> House:
    return generate(4, spec_for("bathroom"))


@pytest.fixture
def prior(bathroom: House, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakePrior:
    """The stand-in with three lines a split, of which the second alone is a house."""
    stand_in = FakePrior(tmp_path / "datasets", [b"no house", as_procthor_writes(bathroom.data), b"none either"])
    monkeypatch.setitem(sys.modules, "prior", stand_in)
    return stand_in


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("procthor-10k", NamedHouses("train", range(10_000))),
        ("procthor-10k:val", NamedHouses("val", range(1_000))),
        ("procthor-10k:test:7", NamedHouses("test", range(7, 8))),
        ("procthor-10k:train:9990-9999", NamedHouses("train", range(9990, 10_000))),
    ],
)
def test_houses_are_named_by_split_and_index(text: str, expected: NamedHouses) -> None:
    assert is_dataset(text)
    assert named(text) == expected


def test_files_are_no_dataset() -> None:
    assert not any(map(is_dataset, ("./procthor-10k", "procthor-10k.jsonl.gz", "houses/procthor-10k:val")))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("procthor-10k:trian", ["'trian'", "Did you mean 'procthor-10k:train'?", "train, val, test"]),
        ("procthor-10k:", ["no split ''"]),
        ("procthor-10k:val:1000", ["0 to 999"]),
        ("procthor-10k:val:5-1000", ["0 to 999"]),
        ("procthor-10k:val:9-5", ["must not be larger than the second"]),
        ("procthor-10k:val:", ["'' is not an index", "procthor-10k:val:0-99"]),
        ("procthor-10k:val:-1", ["'-1' is not an index"]),
        ("procthor-10k:val:1:2", ["'1:2' is not an index"]),
    ],
)
def test_what_names_no_house_is_refused(text: str, words: list[str]) -> None:
    with pytest.raises(SettingError) as caught:
        named(text)
    for word in words:
        assert word in str(caught.value)


def test_a_mistyped_dataset_is_recognised() -> None:
    with pytest.raises(SettingError, match="Did you mean 'procthor-10k'"):
        houses_from(["procthor-10K:val"])


def test_the_download_is_announced_before_it_happens_and_happens_once(
    prior: FakePrior, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[tuple[str, int]] = []
    for _ in range(2):
        split_file("val", lambda line: told.append((line, len(prior.calls))))
    ((line, calls_before),) = told
    assert calls_before == 0
    for word in ("procthor-10k", REVISION[:7], "63 MB", "github.com/allenai/procthor-10k", prior.DATASET_DIR):
        assert word in line
    assert prior.calls == [{"dataset": "procthor-10k", "revision": REVISION, "entity": "allenai"}]
    assert capsys.readouterr().out == "", "what the dataset's program prints is no result"


def test_only_the_lines_that_are_asked_for_are_decoded(prior: FakePrior, bathroom: House) -> None:
    (source,) = houses_from(["procthor-10k:val:1"])
    assert isinstance(source, HouseInFile)
    house = source.house()
    assert (house.name, len(house.objects())) == ("procthor-10k_val_1", len(bathroom.objects()))
    origin = source.origin(house)
    assert (origin.dataset, origin.split, origin.index, origin.revision) == ("procthor-10k", "val", 1, REVISION)
    assert origin.sha256 == house.sha256
    assert house_at("procthor-10k:val:1", lambda line: None).sha256 == house.sha256


def test_all_lines_are_read_in_one_pass_and_faults_are_named(prior: FakePrior) -> None:
    sources = [source for source in houses_from(["procthor-10k:val:0-3"]) if isinstance(source, HouseInFile)]
    found = {source.name[-1]: house for source, house in read_all(sources)}
    assert list(found) == list("0123")
    assert isinstance(found["1"], House)
    for index, word in (("0", "line 1 of"), ("2", "is not JSON"), ("3", "fewer lines")):
        assert isinstance(found[index], HouseError)
        assert word in str(found[index])


def test_one_house_is_one_house(prior: FakePrior) -> None:
    with pytest.raises(SettingError, match=r"names 1000 houses; name one, e\.g\. procthor-10k:val:0"):
        house_at("procthor-10k:val", lambda line: None)


def test_without_prior_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "prior", None)
    with pytest.raises(SettingError, match=r'pip install "vigil-bench\[procthor\]"'):
        houses_from(["procthor-10k:val:1"])


@pytest.mark.parametrize("fault", [ConnectionError("no route to api.github.com"), AssertionError()])
def test_a_download_that_fails_says_what_to_do(prior: FakePrior, fault: Exception) -> None:
    prior.fault = fault
    before = Path.cwd()
    with pytest.raises(SettingError) as caught:
        houses_from(["procthor-10k:val:1"])
    for word in (type(fault).__name__, "github.com", "git-lfs", "copy the folder"):
        assert word in str(caught.value)
    assert Path.cwd() == before
    prior.fault = None
    assert houses_from(["procthor-10k:val:1"])[0].house().name == "procthor-10k_val_1", (
        "a note of Git LFS is no dataset"
    )
