from typing import Any

import pytest

from vigil.errors import ModelAPIError
from vigil.runner.models.redaction import (
    REDACTED,
    Secrets,
    environment_secrets,
    is_secret_name,
    redacted_errors,
    without_option_secrets,
    without_secrets,
)


@pytest.mark.parametrize(
    "name",
    ["api_key", "API-KEY", "apiKey", "x-api-key", "Authorization", "accessToken", "hf_token", "client_secret",
     "PASSWORD", "aws_access_key_id", "api_keys", "Cookie", "proxy-auth", "secret_value", "passwd"],
)  # fmt: skip
def test_names_of_secrets_are_known(name: str) -> None:
    assert is_secret_name(name)


@pytest.mark.parametrize(
    "name",
    ["top_k", "max_tokens", "token_budget", "keyboard", "stop_token", "token_file", "api_key_env", "monkey", "author",
     "max_token", "sort_key", "", "temperature"],
)  # fmt: skip
def test_other_names_are_left_alone(name: str) -> None:
    assert not is_secret_name(name)


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({"api_key": "k", "top_k": 5, "max_tokens": 10}, {"api_key": REDACTED, "max_tokens": 10, "top_k": 5}),
        ({"a": {"headers": {"Authorization": "Bearer x", "A": "b", "User-Agent": "u"}}},
         {"a": {"headers": {"Authorization": REDACTED, "A": REDACTED, "User-Agent": "u"}}}),
        ({"a": [{"b": [{"token": "t"}]}, 3]}, {"a": [{"b": [{"token": REDACTED}]}, 3]}),
        ({"api_keys": ["a", {"b": "c", "n": 3}]}, {"api_keys": [REDACTED, {"b": REDACTED, "n": 3}]}),
        ({"h": [["X-Api-Key", "v"], ["Accept", "json"]]}, {"h": [["X-Api-Key", REDACTED], ["Accept", "json"]]}),
        ({"h": [{"name": "X-Api-Key", "value": "v"}]}, {"h": [{"name": "X-Api-Key", "value": REDACTED}]}),
        ({"password": 123456, "api_key": None}, {"password": REDACTED, "api_key": None}),
        ({"proxy": "http://me:word@host/v1"}, {"proxy": f"http://{REDACTED}@host/v1"}),
        ({"h": ["X-Api-Key: v"]}, {"h": [f"X-Api-Key: {REDACTED}"]}),
        ({"stop": ["</s>"], "stop_token_ids": [1, 2]}, {"stop": ["</s>"], "stop_token_ids": [1, 2]}),
    ],
)  # fmt: skip
def test_secrets_in_settings_are_blanked_however_deep(given: dict[str, Any], kept: dict[str, Any]) -> None:
    assert without_secrets(given) == kept


@pytest.mark.parametrize(
    ("command", "kept"),
    [
        ("python a.py --api-key one --x 3", "python a.py --api-key @@ --x 3"),
        ("python a.py --api-key='a b' z", "python a.py --api-key=@@ z"),
        ('"python" "--apiKey" "a b" z', '"python" "--apiKey" @@ z'),
        ("env API_KEY=one;two python a.py", "env API_KEY=@@ python a.py"),
        ("bash -c 'API_KEY=one python a.py'", "bash -c 'API_KEY=@@ python a.py'"),
        ("curl -H 'Authorization: Bearer one' -u me:word x", "curl -H 'Authorization: Bearer @@' -u @@ x"),
        ("python a.py --url http://me:word@host/v1", "python a.py --url http://@@@host/v1"),
        ("python a.py --url http://host/v1?api_key=one", "python a.py --url http://host/v1?api_key=@@"),
        ("python a.py sk-0123456789abcdefgh", "python a.py @@"),
        ("python a.py --agent --token one", "python a.py --agent --token @@"),
        ("python -m token a.py --max-tokens 30", "python -m token a.py --max-tokens 30"),
        ("python a.py --token-file f", "python a.py --token-file f"),
    ],
)  # fmt: skip
def test_secrets_in_a_command_are_blanked_whatever_they_are(command: str, kept: str) -> None:
    assert without_option_secrets(f"exec:{command}") == f"exec:{kept}".replace("@@", REDACTED)
    assert without_option_secrets(without_option_secrets(command)) == without_option_secrets(command)


def test_what_is_known_is_taken_out_of_any_text_in_any_form() -> None:
    secrets = Secrets.of(
        command="exec:python a.py --api-key 'com mand'",
        url="http://userword:pass%40word@host/v1?k=queryword",
        settings=[{"a": [{"api_key": 'set"ting'}, ["Authorization", "Bearer bearerword"]]}],
        key="thekey",
    )
    said = 'com mand; com%20mand; userword; pass@word; pass%40word; queryword; set\\"ting; thekey; bearerword; http://a:b@c'
    assert secrets.redact(said) == "; ".join([REDACTED] * 9) + f"; http://{REDACTED}@c"
    with pytest.raises(ModelAPIError, match=r"^no \(not recorded\)$"), redacted_errors(secrets):
        raise ModelAPIError("no thekey")


def test_the_environment_is_searched_for_secrets() -> None:
    found = environment_secrets(
        {
            "MY_TOKEN": "0123456789",
            "SHORT_KEY": "0",
            "HOME": "/root",
            "KEY": "/a/long/path",
            "PROXY": "http://u:proxyword@h",
        }
    )
    assert {"0123456789", "proxyword"} <= set(found.values())
    assert not {"0", "/root", "/a/long/path"} & set(found.values())
