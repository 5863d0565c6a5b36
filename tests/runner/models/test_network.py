"""Proxies and certificates of the environment, against a real server on loopback."""

import os
from pathlib import Path

import pytest

from tests.support.chat_server import REPORT, ChatAnswer, serving
from tests.support.inspect_marks import INSPECT
from vigil.errors import ModelAPIError, SettingError
from vigil.runner.models.access import Endpoint, model_access
from vigil.runner.models.completion import open_completion
from vigil.runner.models.network import check_network, is_loopback, proxy_note, without_proxies
from vigil.runner.retries import RetryPolicy

pytestmark = INSPECT
NAMES = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY", "SSL_CERT_FILE", "SSL_CERT_DIR", "SSLKEYLOGFILE")


@pytest.fixture(autouse=True)
def _no_network_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)


def endpoint(url: str) -> Endpoint:
    return Endpoint(model_access("vllm/m", url, {}), retry_policy=RetryPolicy(retries=0))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ALL_PROXY", "socks://127.0.0.1:7891"),
        ("ALL_PROXY", "socks5://127.0.0.1:1"),
        ("HTTP_PROXY", "http://127.0.0.1:9"),
        ("http_proxy", "http://127.0.0.1:9"),
    ],
)
def test_a_server_on_this_machine_is_asked_past_any_proxy(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    with serving(lambda asked: ChatAnswer(REPORT)) as server, open_completion(endpoint(server.url)) as complete:
        assert complete("hello") == REPORT
    assert os.environ[name] == value


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("ALL_PROXY", "socks://me:secret@127.0.0.1:7891", r"^ALL_PROXY is 'socks://127.0.0.1:7891', .*socks5://"),
        ("https_proxy", "ftp://127.0.0.1:1", r"^https_proxy is 'ftp://127.0.0.1:1', .*Unset it"),
    ],
)
def test_a_proxy_that_cannot_be_used_is_named_without_its_login(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, said: str
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(SettingError, match=said):
        check_network("https://api.example.org/v1")
    check_network("http://localhost:8000/v1")


def test_a_proxy_whose_package_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTPS_PROXY", "socks5://127.0.0.1:1")
    monkeypatch.setattr("vigil.runner.models.network.find_spec", lambda name: None)
    with pytest.raises(SettingError, match=r"^HTTPS_PROXY is 'socks5://127.0.0.1:1', .*pip install socksio"):
        check_network("https://api.example.org/v1")


def test_certificates_that_are_not_there_are_named_before_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", "/none")
    with (
        pytest.raises(SettingError, match=r"^SSL_CERT_FILE is '/none', which does not exist\. Unset it"),
        open_completion(endpoint("http://127.0.0.1:9/v1")),
    ):
        pass
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "empty.pem"))
    (tmp_path / "empty.pem").write_text("no certificate")
    with pytest.raises(SettingError, match="does not have certificates"):
        check_network("http://localhost:8000/v1")
    monkeypatch.delenv("SSL_CERT_FILE")
    monkeypatch.setenv("SSLKEYLOGFILE", str(tmp_path / "none" / "keys"))
    with pytest.raises(SettingError, match=r"^SSLKEYLOGFILE is .*cannot be written"):
        check_network("")


def test_a_connection_that_fails_says_through_which_proxy_it_went(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTP_PROXY", "http://me:secret@127.0.0.1:9")
    said = r"through the proxy of HTTP_PROXY \(http://127\.0\.0\.1:9\)"
    with (
        open_completion(endpoint("http://server.example.org/v1")) as complete,
        pytest.raises(ModelAPIError, match=said) as raised,
    ):
        complete("hello")
    assert "refused" in str(raised.value) or "failed" in str(raised.value)
    monkeypatch.setenv("NO_PROXY", "example.org")
    assert proxy_note("http://server.example.org/v1") == ""


@pytest.mark.parametrize(
    ("address", "expected"),
    [
        ("http://localhost:1/v1", True),
        ("http://127.3.2.1:1", True),
        ("http://[::1]:1", True),
        ("http://a.localhost", True),
        ("http://10.0.0.1", False),
        ("http://localhost.example.org", False),
        ("", False),
    ],
)
def test_what_loopback_is(address: str, expected: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ALL_PROXY", "http://p:1")
    assert is_loopback(address) is expected
    with without_proxies(address):
        assert ("ALL_PROXY" in os.environ) is not expected
    assert os.environ["ALL_PROXY"] == "http://p:1"
