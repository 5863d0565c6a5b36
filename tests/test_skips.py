"""What becomes of a skipped test."""

import pytest

pytest_plugins = ["pytester"]


@pytest.mark.parametrize(("reason", "is_accepted"), [("no house at /there", False), ("no Chromium is installed", True)])
@pytest.mark.parametrize("where", ["    pytest.skip(REASON)", "    pass"], ids=["inside", "by a mark"])
def test_a_skip_fails_unless_its_reason_is_accepted(
    pytester: pytest.Pytester, reason: str, is_accepted: bool, where: str
) -> None:
    mark = "" if "skip" in where else "@pytest.mark.skipif(True, reason=REASON)\n"
    pytester.makepyfile(f"import pytest\n\nREASON = {reason!r}\n\n{mark}def test_it():\n{where}\n")
    assert (pytester.runpytest("-p", "tests.support.skips").ret == pytest.ExitCode.OK) is is_accepted
