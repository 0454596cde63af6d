#!/usr/bin/python3
"""The two published networks and their derivatives by automatic differentiation (PyTorch, double): writes tests/oracles/data/network.npz,
which test_network compares with ours. Run it by hand from the root when the definition changes.

Everything is by the definition: a kernel matrix for every edge or node. Parameters are not stored: value i of row r of the table is
bound * (2 u - 1), u = hash(1000003 r + i) / 2^32, bound 1.7 / sqrt(inputs) for weights and 0.3 for biases, rounded to float."""
import numpy as np
import torch

torch.set_default_dtype(torch.float64)
WIDTH, CHANNELS, NEURONS, LAYERS, QUADRATURE, HEAD, OUTPUTS = 64, 4, 256, 5, 32, 128, 16
SIDE = WIDTH // CHANNELS
SAMPLES = 12  # entries of each tensor's gradient that are kept


def linear_rows(name, outputs, inputs):
    return [(name + ".weight", (outputs, inputs)), (name + ".bias", (outputs,))]


def edge_table():
    rows = linear_rows("model.lift", WIDTH, 3)
    for i in range(LAYERS):
        rows += linear_rows(f"model.convs.{i}.nn.layers.0", NEURONS, 6)
        rows += linear_rows(f"model.convs.{i}.nn.layers.1", WIDTH * SIDE, NEURONS)
        rows += linear_rows(f"model.mixes.{i}", WIDTH, WIDTH)
    return rows + linear_rows("model.proj", WIDTH, WIDTH) + linear_rows("mlp.0", HEAD, WIDTH) + linear_rows("mlp.2", OUTPUTS, HEAD)


def separable_table():
    rows = linear_rows("lift", WIDTH, 3)
    for i in range(LAYERS):
        for k in (1, 2):
            rows += linear_rows(f"convs.{i}.kernel{k}.layers.0", NEURONS, 3)
            rows += linear_rows(f"convs.{i}.kernel{k}.layers.1", NEURONS, NEURONS)
            rows += linear_rows(f"convs.{i}.kernel{k}.layers.2", WIDTH * SIDE, NEURONS)
        rows += linear_rows(f"convs.{i}.linear", WIDTH, WIDTH)
    return rows + linear_rows("proj.0", HEAD, WIDTH) + linear_rows("proj.2", OUTPUTS, HEAD)


def uniform(row, count):
    x = (np.uint64(1000003 * row) + np.arange(count, dtype=np.uint64)) & np.uint64(0xFFFFFFFF)
    for _ in range(2):
        x = ((x ^ (x >> np.uint64(16))) * np.uint64(0x45D9F3B)) & np.uint64(0xFFFFFFFF)
    return (x ^ (x >> np.uint64(16))) / 2.0**32


def parameters(table):
    values = {}
    for row, (name, shape) in enumerate(table):
        bound = 1.7 / np.sqrt(shape[1]) if len(shape) == 2 else 0.3
        value = (bound * (2 * uniform(row, int(np.prod(shape))) - 1)).astype(np.float32)
        values[name] = torch.tensor(value.reshape(shape).astype(float), requires_grad=True)
    return values


def apply(p, name, x):
    return x @ p[name + ".weight"].T + p[name + ".bias"]


def farthest(nodes, wanted):
    if wanted >= len(nodes):
        return np.arange(len(nodes))
    chosen, nearest = [0], np.full(len(nodes), np.inf, np.float32)
    while len(chosen) < wanted:
        nearest = np.minimum(nearest, ((nodes[:, :2] - nodes[chosen[-1], :2]) ** 2).sum(1))
        nearest[chosen] = -1
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen)


def multiply(v, kernel):  # rows of values times blocks (channels, in, out)
    return torch.einsum("...ci,...cio->...co", v.unflatten(-1, (CHANNELS, SIDE)), kernel.unflatten(-1, (CHANNELS, SIDE, SIDE))).flatten(-2)


def edge(p, nodes, inner):
    x, sources = torch.tensor(nodes.astype(float)), farthest(nodes, QUADRATURE)
    v = apply(p, "model.lift", x)
    pairs = torch.cat([x[sources][None].expand(len(x), -1, -1), x[:, None].expand(-1, len(sources), -1)], -1)
    for i in range(LAYERS):
        kernel = apply(p, f"model.convs.{i}.nn.layers.1", torch.relu(apply(p, f"model.convs.{i}.nn.layers.0", pairs)))
        v = v + apply(p, f"model.mixes.{i}", multiply(v[sources][None].expand(len(x), -1, -1), kernel).mean(1))
        v = torch.relu(v) if i < LAYERS - 1 else v
    mean = apply(p, "model.proj", v)[:inner].mean(0)
    return apply(p, "mlp.2", torch.relu(apply(p, "mlp.0", mean)))


def separable(p, nodes, inner):
    x = torch.tensor(nodes.astype(float))
    v = apply(p, "lift", x)

    def kernel(name):
        h = torch.relu(apply(p, name + ".layers.1", torch.relu(apply(p, name + ".layers.0", x))))
        return apply(p, name + ".layers.2", h)

    for i in range(LAYERS):
        pooled = multiply(v, kernel(f"convs.{i}.kernel1")).mean(0)
        v = v + apply(p, f"convs.{i}.linear", multiply(pooled.expand(len(x), -1), kernel(f"convs.{i}.kernel2")))
        v = torch.relu(v) if i < LAYERS - 1 else v
    return apply(p, "proj.2", torch.relu(apply(p, "proj.0", v[:inner].mean(0))))


def main():
    rng = np.random.default_rng(11)
    sizes, inner = np.array([20, 70]), np.array([14, 44])
    plane = rng.uniform(-1.2, 1.2, (sizes.sum(), 2))
    heights = plane[:, :1] * plane[:, 1:] - 0.6 * plane[:, 1:] ** 2 + 0.05 * rng.standard_normal((len(plane), 1))
    nodes = np.concatenate([plane, heights], 1).astype(np.float32)
    start = np.concatenate([[0], np.cumsum(sizes)])
    arrays = dict(nodes=nodes.astype(float), start=start.astype(float), inner=inner.astype(float))
    factors = torch.cos(3.0 * torch.arange(2 * OUTPUTS).reshape(2, OUTPUTS))
    for name, table, network in (("edge", edge_table(), edge), ("separable", separable_table(), separable)):
        p = parameters(table)
        out = torch.stack([network(p, nodes[start[i]:start[i + 1]], inner[i]) for i in range(2)])
        (factors * out).sum().backward()
        arrays[name] = out.detach().numpy()
        gradient = []
        for row, _ in table:
            flat = p[row].grad.numpy().ravel()
            gradient.append(np.append(flat[len(flat) * np.arange(SAMPLES) // SAMPLES], np.abs(flat).max()))
        arrays[name + "_gradient"] = np.array(gradient)
        print(name, sum(v.numel() for v in p.values()), out[1, :4].detach().numpy())
    np.savez_compressed("tests/oracles/data/network.npz", **arrays)


main()
