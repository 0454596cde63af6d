"""Clouds as people have them, on which answers are to be warned of: rows, edges, random points, sheets, coarse numbers. Flat arrays of doubles."""
import array
import math
import random

GOLDEN = 2.39996323


def sphere(count, radius=1.0):
    points = array.array("d")
    for i in range(count):
        z = 1 - (2 * i + 1) / count
        r = math.sqrt(1 - z * z)
        points.extend((radius * r * math.cos(GOLDEN * i), radius * r * math.sin(GOLDEN * i), radius * z))
    return points


def open_sphere(count=4000):
    """Without its cap."""
    points, whole = array.array("d"), sphere(count)
    for i in range(count):
        if whole[3 * i + 2] < 0.95:
            points.extend(whole[3 * i:3 * i + 3])
    return points


def torus(count):
    """Of about that many points."""
    points = array.array("d")
    side = round(math.sqrt(count / 2.5))
    rings = count // side
    for i in range(rings * side):
        u, v = 2 * math.pi * (i // side + 0.5 * (i % side % 2)) / rings, 2 * math.pi * (i % side) / side
        points.extend(((1 + 0.4 * math.cos(v)) * math.cos(u), (1 + 0.4 * math.cos(v)) * math.sin(u), 0.4 * math.sin(v)))
    return points


def random_sphere(count=2000, seed=3):
    source, points = random.Random(seed), array.array("d")
    for _ in range(count):
        p = [source.gauss(0, 1) for _ in range(3)]
        length = math.sqrt(sum(x * x for x in p))
        points.extend(x / length for x in p)
    return points


def grid_crossings():
    """What marching cubes makes of a sphere."""
    points = array.array("d")
    axis = [-1.2 + 2.4 * i / 26 + 0.013 for i in range(27)]
    for u in axis:
        for v in axis:
            if u * u + v * v < 1:
                w = math.sqrt(1 - u * u - v * v)
                for a, b, c in ((u, v, w), (u, v, -w)):
                    points.extend((a, b, c, c, a, b, b, c, a))
    return points


def latitudes():
    points = array.array("d")
    for i in range(60):
        t = math.pi * (i + 0.5) / 60
        for j in range(120):
            p = 2 * math.pi * j / 120
            points.extend((math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)))
    return points


def square(side, jitter=0.0, seed=2):
    source, points = random.Random(seed), array.array("d")
    for i in range(side):
        for j in range(side):
            points.extend(((i + jitter * source.uniform(-1, 1)) / (side - 1), (j + jitter * source.uniform(-1, 1)) / (side - 1), 0))
    return points


def square_edge(side):
    """1 at its points on the edge."""
    return [int(i // side in (0, side - 1) or i % side in (0, side - 1)) for i in range(side * side)]


def scan_lines(noise=0.1, along=60, lines=12, seed=0):
    """A plane in rows eight times as far apart as the points in a row."""
    source, points = random.Random(seed), array.array("d")
    for row in range(lines):
        shift = source.uniform(-0.5, 0.5)
        for i in range(along):
            points.extend((i + shift, 8.0 * row, noise * source.gauss(0, 1)))
    return points


def roll(gap, spacing=0.05, turns=3):
    """A spiral sheet whose turns lie `gap` spacings apart."""
    source, points = random.Random(1), array.array("d")
    growth, turn = gap * spacing / (2 * math.pi), 0.0
    while turn < 2 * math.pi * turns:
        radius = 1 + growth * turn
        for k in range(int(1 / spacing)):
            t, h = turn + source.uniform(-0.3, 0.3) * spacing / radius, (k + 0.5 + source.uniform(-0.3, 0.3)) * spacing
            points.extend(((1 + growth * t) * math.cos(t), (1 + growth * t) * math.sin(t), h))
        turn += spacing / radius
    return points


def nested(gap, count=10000):
    return sphere(count) + sphere(int(0.82 * count), 1 - gap * math.sqrt(4 * math.pi / count))


def noisy_sphere(count=10000, share=0.3):
    source, size = random.Random(4), share * math.sqrt(4 * math.pi / count)
    return array.array("d", (x + size * source.gauss(0, 1) for x in sphere(count)))


def national_grid(count=4000):
    """A sphere of 1 m in metres from far away, in single precision."""
    return array.array("f", (x + (512345.0, 4651234.0, 321.0)[i % 3] for i, x in enumerate(sphere(count))))
