#!/usr/bin/python3
"""Files of weights by another hand, in numpy. `write FILE` made tests/oracles/data/numpy.safetensors (its header ends at an odd byte and
its tensors are named out of order); `check FILE` reads what tests/unit/core/model/test_safetensors.c wrote, and fails unless it holds the same."""
import json
import sys

import numpy as np

METADATA = {"trunk": "edge", "note": "quotes \" and \\, caf\u00e9", "empty": ""}


def tensors():
    yield "scalar", np.float32(-2.5)
    yield "lift.weight", (np.arange(12, dtype=np.float32).reshape(4, 3) - 5) / 8
    yield "b", np.array([np.float32(2) ** -149, np.finfo(np.float32).max, -0.0], dtype=np.float32)


def write(path):
    header, blob = {}, b""
    for name, value in tensors():
        data = np.asarray(value, dtype="<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(np.shape(value)), "data_offsets": [len(blob), len(blob) + len(data)]}
        blob += data
    header = {"b": header.pop("b"), "__metadata__": METADATA, **header}
    text = json.dumps(header, ensure_ascii=True).encode()
    text += b" " * (1 - len(text) % 2)
    with open(path, "wb") as file:
        file.write(len(text).to_bytes(8, "little") + text + blob)


def check(path):
    content = open(path, "rb").read()
    length = int.from_bytes(content[:8], "little")
    assert length % 8 == 0, length
    header = json.loads(content[8:8 + length].decode("utf-8"))
    assert list(header)[0] == "__metadata__" and list(header["__metadata__"]) == sorted(METADATA), header
    assert header.pop("__metadata__") == METADATA
    end = 0
    for (name, value), found in zip(tensors(), header, strict=True):
        entry = header[found]
        begin, next_end = entry["data_offsets"]
        assert (name, begin, entry["dtype"]) == (found, end, "F32"), entry
        data = np.frombuffer(content[8 + length + begin:8 + length + next_end], dtype="<f4").reshape(entry["shape"])
        assert data.tobytes() == np.asarray(value, dtype="<f4").tobytes() and data.shape == np.shape(value), name
        end = next_end
    assert end == len(content) - 8 - length


{"write": write, "check": check}[sys.argv[1]](sys.argv[2])
