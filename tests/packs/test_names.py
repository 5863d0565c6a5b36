"""Names of packaged packs: without a version they mean the newest."""

import pytest

from vigil.errors import PackMismatch
from vigil.packs.names import newer_version, newest_version, stem_of, version_of
from vigil.packs.pack import find_pack

KNOWN = ["mini_v1_1", "mini_v1", "mini_v1_10", "mini_v1_9", "big_mini_v2", "starter"]


def test_a_name_without_a_version_means_the_newest() -> None:
    assert newest_version("mini", KNOWN) == "mini_v1_10"
    assert newest_version("big_mini", KNOWN) == "big_mini_v2"
    assert newest_version("starter", KNOWN) is None
    assert newest_version("", KNOWN) is None


def test_a_version_that_is_gone_has_a_successor() -> None:
    assert newer_version("mini_v0_3", KNOWN) == "mini_v1_10"
    assert newer_version("mini", KNOWN) is None
    assert newer_version("other_v1", KNOWN) is None


def test_versions_are_numbers() -> None:
    assert (stem_of("a_v1_v2_3"), version_of("a_v1_v2_3")) == ("a_v1", (2, 3))
    assert (stem_of("a_very"), version_of("a_very")) == (None, ())


@pytest.mark.parametrize("name", ["vigil_mini", "vigil_smoke", "vigil_balanced_1000", "vigil_1000"])
def test_packaged_packs_are_found_without_a_version(name: str) -> None:
    assert stem_of(find_pack(name).name) in (name, "vigil_balanced_1000")


def test_a_pack_that_left_the_package_is_told_of_its_successor() -> None:
    with pytest.raises(PackMismatch, match=r"'vigil_mini_v0' does not come with this package; 'vigil_mini_v6"):
        find_pack("vigil_mini_v0")
