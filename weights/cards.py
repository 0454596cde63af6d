"""cards.py FOLDER: the cards of the models in a folder, as Markdown, from their files alone. make-cards runs it."""
import hashlib
import json
import math
import os
import re
import struct
import sys

NETWORK = ("trunk", "head", "features", "width", "channels", "neurons", "layers", "quadrature", "head_width", "outputs", "node_width",
           "frame_width")
SOLVE = ("shells", "ridge")
PATCHES = ("k", "buffer", "height_scale", "delta0_ratio", "delta0")
INTRODUCTION = """# The models

Written by `weights/make-cards` from the files' own metadata and the judge's table; the keys are explained in [README.md](README.md).
`estimator=gnp` takes one of them by `weights=NAME`; `weights=auto` is that of the regime `any`, with the head `weighted`.

| model | regime | head | k | parameters | bytes | trained |
| --- | --- | --- | ---: | ---: | ---: | ---: |"""


def header_of(data):
    size = struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:8 + size])
    return header.pop("__metadata__"), header


def load(folder, file):
    with open(os.path.join(folder, file), "rb") as f:
        data = f.read()
    keys, tensors = header_of(data)
    return {"name": file[:-len(".safetensors")], "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest(), "keys": keys,
            "parameters": sum(math.prod(t["shape"]) for t in tensors.values())}


def duration(keys):
    seconds = float(keys.get("training_seconds", "nan"))
    return "" if math.isnan(seconds) else "%.1f min" % (seconds / 60)


def named(keys, names):
    return ", ".join("`%s` %s" % (key, keys[key]) for key in names if key in keys)


def training_rows(keys):
    others = [key for key in sorted(keys) if key.startswith(("training_", "validation_", "note"))]
    yield from ((key, keys[key].replace("|", "\\|")) for key in others)


def validation(folder):
    """The judge's table, VALIDATION.md: its lines, and which model each (method, regime) was judged with."""
    try:
        with open(os.path.join(folder, "VALIDATION.md")) as file:
            lines = file.read().splitlines()
    except FileNotFoundError:
        return [], {}
    judged = {}
    for line in lines:
        found = re.match(r"- (\S+), (\S+): (\S+), .*sha256 ([0-9a-f]{64})$", line)
        if found:
            judged.setdefault((found.group(3), found.group(4)), []).append(found.group(1, 2))
    return lines, judged


def judged_rows(model, table):
    """The model's rows, by family, with the paper's above them; none when the judge saw another file of this name."""
    lines, judged = table
    rows_of = judged.get((model["name"], model["sha256"]), [])
    regimes, method = [regime for _, regime in rows_of], rows_of[0][0] if rows_of else None
    title, rows = None, []
    for line in lines + ["## "] if method else []:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("## "):
            if any("| %s, mean" % method in row for row in rows):
                yield from ["", title + ":", ""] + header + rows
            title, rows = line[3:], []
        elif cells[0] == "regime" and len(cells) > 6:
            header = [line]
        elif line.startswith("| ---") and len(cells) > 6:
            header.append(line)
        elif cells[0] in regimes and (cells[1].endswith(", paper") or cells[1].startswith(method + ",")):
            rows.append(line)


def card(model, folder, table):
    keys, name = model["keys"], model["name"]
    yield ""
    yield "## %s" % name
    yield ""
    patches = named(keys, PATCHES)
    yield "For the regime `%s`%s. %d parameters; sha256 `%s`." % (keys["regime"], ", patches of " + patches if patches else "",
                                                                 model["parameters"], model["sha256"])
    yield ""
    yield "Network: %s." % named(keys, NETWORK)
    if any(key in keys for key in SOLVE):
        yield "Solved for: %s." % named(keys, SOLVE)
    yield ""
    yield "| training | |"
    yield "| --- | --- |"
    for key, value in training_rows(keys):
        yield "| %s | %s |" % (key, value)
    if os.path.exists(os.path.join(folder, "curves", name + ".png")):
        yield ""
        yield "![the loss of %s over its training](curves/%s.png)" % (name, name)
    yield ""
    lines = list(judged_rows(model, table))
    yield "Judged by the paper's Table 1 (`make validate`):" if lines else "Not among the rows of the judge's table."
    yield from lines


def main(folder):
    models = [load(folder, file) for file in sorted(os.listdir(folder)) if file.endswith(".safetensors")]
    table = validation(folder)
    print(INTRODUCTION)
    for m in models:
        keys = m["keys"]
        print("| [%s](#%s) | %s | %s | %s | %d | %d | %s |" % (m["name"], m["name"], keys["regime"], keys["head"], keys.get("k", ""),
                                                            m["parameters"], m["bytes"], duration(keys)))
    for m in models:
        print("\n".join(card(m, folder, table)))


main(sys.argv[1])
