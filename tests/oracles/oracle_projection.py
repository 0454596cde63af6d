#!/usr/bin/python3
"""Models by another hand, in numpy and double: `oracle_projection.py weights` evaluates every weights/*.safetensors with patches, and the three
networks of formula() that no file holds, on four patches, and writes tests/oracles/data/projection.npz, which
test_projection_frozen compares with ours. Run it from the root whenever a file of weights changes.

Everything is by the definition: kernel matrices for every edge or node, least squares by stacking the rows of data and penalties.
The patches are made by the formulas below, in the test too."""
import glob
import hashlib
import json
import os
import sys

import numpy as np

PATCHES, NODES, DEGREE = 4, 48, 7
INDICES = [(d - b, b) for d in range(DEGREE + 1) for b in range(d + 1)]
ORDER = np.array([a + b for a, b in INDICES])
FACTORIAL = np.array([1, 1, 2, 6, 24, 120, 720, 5040.0])
FACTOR = np.array([FACTORIAL[a] * FACTORIAL[b] for a, b in INDICES])


# ---- Patches: (u, v, y) in units of scale_xy, ascending by distance, of density k to the unit disk ----


def uniform(row, count):
    x = (np.uint64(1000003 * row) + np.arange(count, dtype=np.uint64)) & np.uint64(0xFFFFFFFF)
    for _ in range(2):
        x = ((x ^ (x >> np.uint64(16))) * np.uint64(0x45D9F3B)) & np.uint64(0xFFFFFFFF)
    return (x ^ (x >> np.uint64(16))) / 2.0**32


def patch(p, k, count):
    """0: hardly any noise; 1: too few points; 2: on one side of a boundary, with noise; 3: much noise."""
    count = count // 3 if p == 1 else count
    half = np.sqrt(3.0 * count / k) / 2
    u, v = half * (2 * uniform(3 * p, count) - 1), half * (2 * uniform(3 * p + 1, count) - 1)
    u = u + half * 0.7 if p == 2 else u
    noise = (2e-5, 0.002, 0.004, 0.03)[p] * (2 * uniform(3 * p + 2, count) - 1)
    y = 0.08 * u * u - 0.05 * u * v + 0.03 * v * v + 0.01 * u * v * v - 0.002 * u * u * u * v + 0.02 + noise
    nearest = np.argsort(u * u + v * v, kind="stable")
    return u[nearest], v[nearest], y[nearest]


# ---- Networks ----


def apply(t, name, x):
    return x @ t[name + ".weight"].T + t[name + ".bias"]


def relu(x):
    return np.maximum(x, 0)


def farthest(nodes, wanted):
    if wanted >= len(nodes):
        return np.arange(len(nodes))
    chosen, nearest = [0], np.full(len(nodes), np.inf, np.float32)
    while len(chosen) < wanted:
        nearest = np.minimum(nearest, ((nodes[:, :2] - nodes[chosen[-1], :2]) ** 2).sum(1))
        nearest[chosen] = -1
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen)


def multiply(v, kernel, channels):
    """(rows, width) times blocks (rows, channels, in, out)."""
    side = v.shape[1] // channels
    product = np.einsum("nci,ncio->nco", v.reshape(-1, channels, side), kernel.reshape(-1, channels, side, side))
    return product.reshape(len(v), -1)


def edge(t, meta, nodes, inner):
    x, sources = nodes.astype(float), farthest(nodes, int(meta["quadrature"]))
    v = apply(t, "model.lift", x)
    layers, channels = int(meta["layers"]), int(meta["channels"])
    for i in range(layers):
        integral = 0
        for j in sources:
            pairs = np.concatenate([np.broadcast_to(x[j], x.shape), x], 1)
            kernel = apply(t, f"model.convs.{i}.nn.layers.1", relu(apply(t, f"model.convs.{i}.nn.layers.0", pairs)))
            integral = integral + multiply(np.broadcast_to(v[j], v.shape), kernel, channels) / len(sources)
        v = v + apply(t, f"model.mixes.{i}", integral)
        v = relu(v) if i < layers - 1 else v
    return apply(t, "model.proj", v)[:inner].mean(0)


def separable(t, meta, nodes, inner):
    x = nodes.astype(float)
    v = apply(t, "lift", x)
    layers, channels = int(meta["layers"]), int(meta["channels"])

    def kernel(name):
        return apply(t, name + ".layers.2", relu(apply(t, name + ".layers.1", relu(apply(t, name + ".layers.0", x)))))

    for i in range(layers):
        mean = multiply(v, kernel(f"convs.{i}.kernel1"), channels).mean(0)
        v = v + apply(t, f"convs.{i}.linear", multiply(np.broadcast_to(mean, v.shape), kernel(f"convs.{i}.kernel2"), channels))
        v = relu(v) if i < layers - 1 else v
    return v[:inner].mean(0)


def trunk(t, meta, nodes, inner):
    if meta["trunk"] == "none":
        return np.zeros(0)
    return (edge if meta["trunk"] == "edge" else separable)(t, meta, nodes, inner)


# ---- The pooled head ----


def pooled(t, meta, p):
    k = int(meta["k"])
    u, v, y = patch(p, k, int(k * float(meta["buffer"]) ** 2) + 4)
    nodes = np.stack([u, v, 10 * y], 1).astype(np.float32)
    inner = max(int((u * u + v * v <= 1).sum()), 1)
    name = "mlp" if meta["trunk"] == "edge" else "proj"
    return {"coefficients": apply(t, name + ".2", relu(apply(t, name + ".0", trunk(t, meta, nodes, inner))))}


# ---- The projection head ----


def rows(u, v):
    return np.stack([u**a * v**b for a, b in INDICES], 1)


def least(parts, penalty):
    """Minimises the sum of weight |y - c . phi|^2 over (weight, phi, y) and of penalty c^2; c and what was minimised."""
    a = np.concatenate([np.sqrt(w) * phi for w, phi, _ in parts] + [np.diag(np.sqrt(penalty))])
    b = np.concatenate([np.sqrt(w) * y for w, _, y in parts] + [np.zeros(len(penalty))])
    size = np.sqrt((a * a).sum(0))
    c = np.linalg.lstsq(a / size, b, rcond=None)[0] / size
    return c, ((a @ c - b) ** 2).sum()


def first_fit(meta, u, v, y, count, radius):
    power = radius ** (2.0 * ORDER)
    penalty = power * np.where(ORDER < 3, 1e-12, float(meta["ridge"]) * (count + 1) * FACTOR)
    c, left = least([(1.0, rows(u[:count], v[:count]), y[:count])], penalty)
    misfit = max(left, 1e-15 * (y[:count] ** 2).sum()) / (count + 1)
    energy = np.array([(c * c * power * FACTOR)[ORDER == j].sum() for j in range(1, DEGREE + 1)])
    return c, misfit, np.append(0.5 * np.log(misfit + 1e-30), 0.5 * np.log(energy + 1e-16))


def projection(t, meta, p):
    shells, k = [int(s) for s in meta["shells"].split(",")], int(meta["k"])
    u, v, y = patch(p, k, shells[-1])
    ends = [min(s, len(u)) for s in shells]
    fits = [first_fit(meta, u, v, y, e, np.sqrt(s / k)) for e, s in zip(ends, shells)]
    summary = np.concatenate([f[2] for f in fits]).astype(np.float32)
    c, misfit = fits[len(shells) // 2][:2]
    spread, radius = np.arange(NODES) * (len(u) - 1) // (NODES - 1), np.sqrt(shells[-1] / k)
    residual = (y - rows(u, v) @ c) / (np.sqrt(misfit) + 1e-15)
    nodes = np.zeros((NODES, max(int(meta.get("features", 0)), 4)), np.float32)
    nodes[:, :4] = np.stack([u / radius, v / radius, y / radius, residual.clip(-8, 8)], 1)[spread]
    mean = trunk(t, meta, nodes, NODES)
    x = np.append(mean, (summary.astype(float) - t["head.mean"]) / t["head.deviation"])
    outputs = apply(t, "head.4", relu(apply(t, "head.2", relu(apply(t, "head.0", x)))))
    ridge = np.exp(np.clip(4 * outputs[:DEGREE + 1], -60, 60))
    share = np.exp(-np.cumsum(np.log1p(np.exp(2 * outputs[DEGREE + 1:]))))
    parts = [(a, rows(u[s:e], v[s:e]), y[s:e]) for a, s, e in zip(share, [0] + ends, ends)]
    found = {"coefficients": least(parts, ridge[ORDER] * FACTOR)[0], "outputs": outputs, "summary": summary.astype(float)}
    return {**found, "mean": mean} if len(mean) else found


# ---- Which networks ----


def read(path):
    content = open(path, "rb").read()
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8:8 + length])
    meta, data, tensors = header.pop("__metadata__"), content[8 + length:], {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        tensors[name] = np.frombuffer(data[begin:end], "<f4").astype(float).reshape(entry["shape"])
    return hashlib.sha256(content).hexdigest(), meta, tensors


def table(meta):
    features, width, neurons, head = (int(meta.get(key, 0)) for key in ("features", "width", "neurons", "head_width"))
    block, shells = width * width // int(meta.get("channels", 1)), len(meta["shells"].split(","))
    layers = [("lift", width, features)] if width else []
    for i in range(int(meta.get("layers", 0))):
        if meta["trunk"] == "edge":
            layers += [(f"convs.{i}.nn.layers.0", neurons, 2 * features), (f"convs.{i}.nn.layers.1", block, neurons),
                       (f"mixes.{i}", width, width)]
            continue
        for kernel in ("kernel1", "kernel2"):
            sizes = [features, neurons, neurons, block]
            layers += [(f"convs.{i}.{kernel}.layers.{j}", sizes[j + 1], sizes[j]) for j in range(3)]
        layers += [(f"convs.{i}.linear", width, width)]
    if meta["trunk"] == "edge":
        layers = [("model." + name, out, inputs) for name, out, inputs in layers + [("proj", width, width)]]
    summary = 8 * shells
    found = [entry for name, out, inputs in layers for entry in ((name + ".weight", (out, inputs)), (name + ".bias", (out,)))]
    found += [("head.mean", (summary,)), ("head.deviation", (summary,))]
    for name, out, inputs in (("head.0", head, width + summary), ("head.2", head, head), ("head.4", 8 + shells, head)):
        found += [(name + ".weight", (out, inputs)), (name + ".bias", (out,))]
    return found


def formula(kind):
    """Value i of tensor r is bound * (2 u - 1), u = uniform(r)[i], bound 1.7 / sqrt(inputs) or 0.3, rounded to float;
    head.mean -4, head.deviation 3, head.4.bias -1."""
    sizes = dict(features="5", width="12", channels="3", neurons="10", layers="3", quadrature="9") if kind != "none" else {}
    meta = dict(sizes, trunk=kind, head="projection", head_width="14", shells="60,120,240", ridge="2e-5", k="30")
    tensors = {}
    for row, (name, shape) in enumerate(table(meta)):
        bound = 1.7 / np.sqrt(shape[1]) if len(shape) == 2 else 0.3
        tensors[name] = (bound * (2 * uniform(row, int(np.prod(shape))) - 1)).astype(np.float32).astype(float).reshape(shape)
    for name, value in (("head.mean", -4.0), ("head.deviation", 3.0), ("head.4.bias", -1.0)):
        tensors[name] = np.full(tensors[name].shape, value)
    return "", meta, tensors


def main(folder):
    networks = {"formula_" + kind: formula(kind) for kind in ("edge", "separable", "none")}
    for path in sorted(glob.glob(os.path.join(folder, "*.safetensors"))):
        network = read(path)
        if network[1]["head"] != "weighted":
            networks[os.path.basename(path)[:-len(".safetensors")]] = network
    arrays = {}
    for name, (digest, meta, tensors) in networks.items():
        head = projection if meta["head"] == "projection" else pooled
        found = [head(tensors, meta, p) for p in range(PATCHES)]
        for key in found[0]:
            arrays[f"{name}.{key}"] = np.array([f[key] for f in found])
        arrays[name + ".sha256"] = np.frombuffer(bytes.fromhex(digest), np.uint8).astype(float)
        print(name, digest[:12], found[0]["coefficients"][:4])
    np.savez_compressed("tests/oracles/data/projection.npz", **arrays)


if __name__ == "__main__":
    main(sys.argv[1])
