#!/usr/bin/python3
"""The training loss and its gradient by automatic differentiation (PyTorch): writes tests/oracles/data/loss.npz, which test_loss compares
with ours. Run it by hand from the root when the definition changes.

Random patches: jets of a fit, jets and places of the truth, typical sizes, and what the loss makes of them. Formulas are
written from the definitions (first and second fundamental forms as matrices), not from those of weights/train/loss.c."""
import numpy as np
import torch

torch.set_default_dtype(torch.float64)
TERMS = ["height", "normal", "inverse_metric", "second_form", "gaussian_curvature", "mean_curvature", "angle"]
TINY = 1e-8


def geometry(jets):
    f, u, v, uu, uv, vv = jets.unbind(-1)
    one, zero = torch.ones_like(u), torch.zeros_like(u)
    tangent_u, tangent_v = torch.stack([one, zero, u], -1), torch.stack([zero, one, v], -1)
    cross = torch.linalg.cross(tangent_u, tangent_v)
    normal = cross / cross.norm(dim=-1, keepdim=True)
    tangents = torch.stack([tangent_u, tangent_v], -2)
    first = tangents @ tangents.transpose(-1, -2)
    second = torch.stack([torch.stack([uu, uv], -1), torch.stack([uv, vv], -1)], -2) * normal[..., 2, None, None]
    inverse = torch.linalg.inv(first)
    weingarten = inverse @ second
    return dict(height=f, normal=normal, inverse_metric=inverse, second_form=second,
                gaussian_curvature=torch.linalg.det(weingarten), mean_curvature=weingarten.diagonal(dim1=-2, dim2=-1).sum(-1) / 2)


def judge(jets, truth, weights, lam, typical, floor, most):
    fit, true = geometry(jets), geometry(truth)
    total, values = 0, []
    for t, name in enumerate(TERMS):
        if name == "normal":
            value = (weights * (1 - (fit["normal"] * true["normal"]).sum(-1))).sum()
        elif name == "angle":
            value = (weights * ((fit["normal"] - true["normal"]) ** 2).sum(-1)).sum().sqrt() / (typical[t] + TINY)
        else:
            d = (fit[name] - true[name]).reshape(len(jets), -1)
            g = true[name].reshape(len(jets), -1)
            error = (weights * (d ** 2).sum(-1)).sum().sqrt()
            value = error / (((weights * (g ** 2).sum(-1)).sum() + (floor * typical[t]) ** 2).sqrt() + TINY)
            if "curvature" in name or name == "second_form":
                value = value.clamp(max=most)
        values.append(value)
        total = total + lam[t] * value
    return total, torch.stack(values)


def main():
    rng = np.random.default_rng(1)
    count, points = 4, 9
    truth = rng.normal(size=(count, points, 6)) * [0.01, 0.3, 0.3, 4, 3, 4]
    jets = truth + rng.normal(size=truth.shape) * [0.002, 0.1, 0.1, 1, 1, 1]
    jets[3, :, 3:] *= 20  # beyond the largest value that counts
    place = rng.uniform(-1, 1, size=(count, points, 2))
    typical = np.array([0.02, 0, 2 ** 0.5, 5, 8, 2, 0.2])
    lam = rng.uniform(0.1, 1, size=(2, len(TERMS)))
    floor, focus, most = np.array([0, 1.0]), 0.4, 5.0
    losses, values, gradients = [], [], []
    for p in range(count):
        x = torch.tensor(jets[p], requires_grad=True)
        t = torch.tensor(truth[p])
        w = torch.exp(-((torch.tensor(place[p]) - torch.tensor(place[p, 0])) ** 2).sum(-1) / (2 * focus ** 2))
        whole = judge(x, t, w / w.sum(), lam[0], typical, floor[0], most)
        centre = judge(x[:1], t[:1], torch.ones(1), lam[1], typical, floor[1], most)
        loss = whole[0] + centre[0]
        loss.backward()
        losses.append(loss.item())
        values.append(torch.stack([whole[1], centre[1]]).detach().numpy())
        gradients.append(x.grad.numpy())
    np.savez("tests/oracles/data/loss.npz", truth=truth, place=place, jets=jets, typical=typical, lam=lam, floor=floor,
             focus=np.array([focus]), most=np.array([most]), loss=np.array(losses), terms=np.array(values),
             gradient=np.array(gradients))


main()
