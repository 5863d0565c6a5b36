"""AI2-THOR's protocol over HTTP: the engine posts each answer as a form; the client's response is the next action."""

import json
from collections.abc import Mapping
from http.client import HTTPConnection, HTTPException

from vigil.thor.engine import EngineResponse, ThorEngine

BOUNDARY = "vigil-thor-engine-boundary"
PATH = "/train"
IMAGE_PARTS = {
    ("image", False): "image",
    ("depth", False): "image_depth",
    ("classes", False): "image_classes",
    ("ids", False): "image_ids",
    ("image", True): "image-thirdParty-camera",
    ("depth", True): "image_thirdParty_depth",
    ("ids", True): "image_thirdParty_image_ids",
    ("classes", True): "image_thirdParty_classes",
}
"""(kind of image, whether it is from a third-party camera) -> name of the form's part with the image."""


def serve(engine: ThorEngine, environment: Mapping[str, str]) -> None:
    """Answer actions until the client ends or sends an empty action."""
    connection = HTTPConnection(environment["AI2THOR_HOST"], int(environment["AI2THOR_PORT"]))
    token = environment.get("AI2THOR_CLIENT_TOKEN", "")
    response = engine.first_response()
    headers = {"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"}
    try:
        while True:
            connection.request("POST", PATH, body=form(response, token), headers=headers)
            response = connection.getresponse()
            body = response.read()
            action = json.loads(body) if response.status == 200 else {}
            if not action:
                return
            response = engine.respond(action)
    except (HTTPException, OSError):  # the client ended
        return
    finally:
        connection.close()


def form(response: EngineResponse, token: str) -> bytes:
    """Return an answer as a form. Header names have the case that the client's own parser requires."""
    texts = {"metadata": json.dumps(response.metadata), "actionReturns": "[]", "token": token}
    pieces: list[bytes] = []
    for name, text in texts.items():
        pieces += _part(f'name="{name}"', "text/plain; charset=utf-8", text.encode())
    for image in response.images:
        name = IMAGE_PARTS[image.kind, image.is_third_party]
        pieces += _part(f'name="{name}"; filename="{name}"', "image/raw", image.data)
    return b"".join([*pieces, f"--{BOUNDARY}--\r\n".encode()])


def _part(names: str, content_type: str, body: bytes) -> list[bytes]:
    head = f"--{BOUNDARY}\r\nContent-disposition: form-data; {names}\r\nContent-Type: {content_type}\r\n\r\n"
    return [head.encode(), body, b"\r\n"]
