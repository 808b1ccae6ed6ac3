"""Answers under seal: a hash that commits to them, and a box that no other process can open.

The box is encrypted, then authenticated: the stream is SHAKE-256 of key and nonce (FIPS 202), the tag
HMAC-SHA-256 (RFC 2104) of nonce and cipher under a second key. Both keys are of the operating system's random
numbers, live in the memory of the process that seals, and are written nowhere. After a kill nothing need be
opened: a campaign is a function of seed and number, and is drawn and sealed again.
"""

from __future__ import annotations

import hashlib
import hmac
import io
import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.base.errors import ForkliftError

NONCE = TAG = 32
Truth = Mapping[str, Mapping[str, NDArray[np.float64]]]


@dataclass(frozen=True)
class Sealed:
    """A box, and the hash by which its content was committed to."""

    box: bytes
    commitment: str
    """SHA-256 of the salted content, in hexadecimal."""


class Seal:
    """Seals and opens; whoever has not this object opens nothing."""

    def __init__(self) -> None:
        self._cipher, self._tag = secrets.token_bytes(32), secrets.token_bytes(32)

    def __reduce__(self) -> Any:
        raise TypeError("a seal does not leave its process")

    def close(self, answer: Mapping[str, Any], truth: Truth) -> Sealed:
        """Answer and truth under seal."""
        content = secrets.token_bytes(NONCE) + packed(answer, truth)
        nonce = secrets.token_bytes(NONCE)
        hidden = nonce + self._stream(nonce, content)
        tag = hmac.new(self._tag, hidden, hashlib.sha256).digest()
        return Sealed(tag + hidden, hashlib.sha256(content).hexdigest())

    def open(self, sealed: Sealed) -> tuple[dict[str, Any], dict[str, dict[str, NDArray[np.float64]]]]:
        """What is in the box.

        Raises
        ------
        ForkliftError
            ``"seal-broken"`` if the box or its commitment is not as it was sealed.
        """
        tag, hidden = sealed.box[:TAG], sealed.box[TAG:]
        good = hmac.compare_digest(tag, hmac.new(self._tag, hidden, hashlib.sha256).digest())
        content = self._stream(hidden[:NONCE], hidden[NONCE:]) if good else b""
        if not hmac.compare_digest(hashlib.sha256(content).hexdigest(), sealed.commitment):
            raise ForkliftError(
                "seal-broken",
                "the sealed answer is not the one that was committed to before the diagnosis; "
                "delete its campaign's result, and prove it again",
            )
        return unpacked(content[NONCE:])

    def _stream(self, nonce: bytes, content: bytes) -> bytes:
        """The content, or back: exclusive or with a stream that only the key gives."""
        stream = hashlib.shake_256(self._cipher + nonce).digest(len(content))
        both = np.frombuffer(content, np.uint8) ^ np.frombuffer(stream, np.uint8)
        return both.tobytes()


def packed(answer: Mapping[str, Any], truth: Truth) -> bytes:
    """Answer and truth as bytes."""
    text = json.dumps(answer, ensure_ascii=False, sort_keys=True).encode()
    arrays = io.BytesIO()
    flat: dict[str, Any] = {
        f"{file}\t{name}": values for file, each in truth.items() for name, values in each.items()
    }
    np.savez_compressed(arrays, **{key: values for key, values in flat.items()})
    return len(text).to_bytes(8, "big") + text + arrays.getvalue()


def unpacked(content: bytes) -> tuple[dict[str, Any], dict[str, dict[str, NDArray[np.float64]]]]:
    """Of `packed`."""
    length = int.from_bytes(content[:8], "big")
    answer = json.loads(content[8 : 8 + length])
    truth: dict[str, dict[str, NDArray[np.float64]]] = {}
    with np.load(io.BytesIO(content[8 + length :])) as arrays:
        for key in arrays.files:
            file, _, name = key.partition("\t")
            truth.setdefault(file, {})[name] = arrays[key]
    return answer, truth
