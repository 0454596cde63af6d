"""cards.py FOLDER: the cards of the models in a folder, as Markdown, from their files alone. make-cards runs it."""
import hashlib
import json
import math
import os
import struct
import sys

COLUMNS = (("normal", "normal"), ("inverse_metric", "metric inverse"), ("second_fundamental_form", "shape"),
           ("gaussian_curvature", "gaussian"), ("mean_curvature", "mean"))
NETWORK = ("trunk", "head", "features", "width", "channels", "neurons", "layers", "quadrature", "head_width", "outputs")
SOLVE = ("shells", "ridge")
PATCHES = ("k", "buffer", "height_scale", "delta0_ratio", "delta0")
INTRODUCTION = """# The models

Written by `weights/make-cards` from the files' own metadata and the judge's table; the keys are explained in [README.md](README.md).
`estimator=gnp` takes one of them by `weights=NAME`, or chooses by the cloud (`weights=auto`): models with the head `projection`
before those with `pooled`.

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
    """Lines of Markdown by the name of a model: its rows of the judge's table."""
    try:
        with open(os.path.join(folder, "VALIDATION.json")) as file:
            return rows_of_json(json.load(file))
    except FileNotFoundError:
        pass
    try:
        with open(os.path.join(folder, "VALIDATION.md")) as file:
            return rows_of_markdown(file.read().splitlines())
    except FileNotFoundError:
        return lambda model: []


def regime_of(model):
    """The judge's regime of a model: noise-70 of noise_70k_pooled, or of a file of another name by its metadata."""
    return "%s-%s" % (model["keys"]["regime"], model["keys"]["k"])


def rows_of_json(table):
    def lines(model):
        found = [row for row in table["rows"] if row["regime"] == regime_of(model) and is_of(row.get("estimator", ""), row, model)]
        if found:
            yield "| family | | " + " | ".join(title for _, title in COLUMNS) + " |"
            yield "| --- | --- |" + " ---: |" * len(COLUMNS)
        for row in found:
            for key, label in (("mean", "mean"), ("median", "median"), ("paper_gnp", "gnp, paper"), ("paper_gmls", "gmls, paper")):
                if key in row:
                    yield "| %s | %s | %s |" % (row["family"], label, " | ".join("%.2e" % row[key][c] for c, _ in COLUMNS))
    return lambda model: list(lines(model))


def is_of(estimator, row, model):
    """A row names its model, or it is the estimator gnp's, whose model is the one of the regime with the head `projection`."""
    if "weights" in row:
        return row["weights"] == model["name"]
    return estimator in ("gnp", model["name"]) and (estimator != "gnp" or model["keys"]["head"] == "projection")


def rows_of_markdown(text):
    def lines(model):
        family, titles = None, None
        for line in text:
            if line.startswith("## "):
                family = line[3:]
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
            if cells and cells[0] == "regime":
                titles = line
            elif len(cells) > 2 and cells[0] == regime_of(model):
                label = cells[1].split(",")[0]
                if cells[1].endswith("paper") or is_of(label, {}, model):
                    yield family, titles, line
    def shown(model):
        found = list(lines(model))
        if all(line.split("|")[2].strip().endswith("paper") for _, _, line in found):
            return []
        output, last = [], None
        for family, titles, line in found:
            if family != last:
                output += ["", family + ":", "", titles, "| " + " | ".join(["---"] * (titles.count("|") - 1)) + " |"]
            output.append(line)
            last = family
        return output[1:]
    return shown


def card(model, folder, rows):
    keys, name = model["keys"], model["name"]
    yield ""
    yield "## %s" % name
    yield ""
    yield "For the regime `%s`, patches of %s. %d parameters; sha256 `%s`." % (keys["regime"], named(keys, PATCHES), model["parameters"], model["sha256"])
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
    lines = rows(model)
    yield "Judged by the paper's Table 1 (`make validate`), regime %s:" % regime_of(model) if lines else "Not among the rows of the judge's table."
    if lines:
        yield ""
        yield from lines


def main(folder):
    models = [load(folder, file) for file in sorted(os.listdir(folder)) if file.endswith(".safetensors")]
    rows = validation(folder)
    print(INTRODUCTION)
    for m in models:
        keys = m["keys"]
        print("| [%s](#%s) | %s | %s | %s | %d | %d | %s |" % (m["name"], m["name"], keys["regime"], keys["head"], keys["k"],
                                                            m["parameters"], m["bytes"], duration(keys)))
    for m in models:
        print("\n".join(card(m, folder, rows)))


main(sys.argv[1])
