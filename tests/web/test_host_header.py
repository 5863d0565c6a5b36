"""Which `Host` headers a site without a token answers to."""

import pytest
from fastapi.testclient import TestClient

from vigil.web.site import Address, make_site

STYLE = "/static/vigil.css"
OWN = ["localhost", "LOCALHOST", "localhost:8377", "127.0.0.1", "127.0.0.1:8377", "[::1]", "[::1]:8377"]
FOREIGN = [
    *("", "::1", "localhost.", "127.1", " localhost", "evil.example", "127.0.0.1.evil.example", "localhost.evil"),
    *("localhost:", "localhost:evil", "localhost:80:80", "localhost:80@evil.example", "evil@localhost"),
    *("[::1", "[::1]x", "[::1].evil", "[::1]:x", "[::ffff:127.0.0.1]", "localhost/evil"),
]


@pytest.mark.parametrize("name", OWN)
def test_the_own_names_are_answered_to(name: str) -> None:
    assert TestClient(make_site(Address())).get(STYLE, headers={"Host": name}).status_code == 200


@pytest.mark.parametrize("name", FOREIGN)
def test_any_other_name_is_refused_with_those_that_work(name: str) -> None:
    refused = TestClient(make_site(Address())).get(STYLE, headers={"Host": name})
    assert (refused.status_code, refused.text) == (421, "This server answers only to 127.0.0.1 and localhost.")


def test_with_a_token_the_token_decides() -> None:
    site = TestClient(make_site(Address("0.0.0.0", token="long enough")))
    bearer = {"Authorization": "Bearer long enough"}
    assert site.get(STYLE, headers={"Host": "evil.example", **bearer}).status_code == 200
    assert site.get(STYLE, headers={"Host": "localhost"}).status_code == 401
