"""Plays all episodes of a server (`vigil serve PACK --name me`) with a plain HTTP client: look around, then give up."""

import json
import sys
import urllib.request

LOOK = {"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 90}}
GIVE_UP = {"skill_name": "report", "arguments": {"status": "fail", "summary": "I did not look further."}}


def ask(path: str, body: dict, session: str = "") -> dict:
    headers = {"Content-Type": "application/json", "Vigil-Session": session}
    request = urllib.request.Request(sys.argv[1] + path, json.dumps(body).encode(), headers)
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


while not (state := ask("/reset", {}))["done"]:
    session, replies = state["observation"]["session"], [LOOK, LOOK, LOOK, GIVE_UP]
    print(state["observation"]["instruction"])
    while not state["done"]:
        # state["observation"]["frame"]["data"] is the picture, in base64
        state = ask("/step", {"action": replies.pop(0)}, session)
