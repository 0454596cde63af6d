#!/usr/bin/python3
"""oracle_snapshots.py RUN.npz POINTS STEPS EVERY: checks with numpy what a flow of POINTS points that keeps them all wrote.
Exits with 77 where there is no numpy."""
import json
import sys

try:
    import numpy
except ImportError:
    sys.exit(77)

run, points, steps, every = numpy.load(sys.argv[1]), *map(int, sys.argv[2:5])
wanted = sorted({*range(0, steps + 1, every), steps})
count = len(wanted)
shapes = {"points": (points, 3), "normals": (points, 3), "mean_curvature": (points,), "index": (points,), "record": (steps + 1, 10),
          "snapshot_start": (count + 1,), "snapshot_step": (count,), "snapshot_time": (count,),
          "snapshot_points": (count * points, 3), "snapshot_normals": (count * points, 3),
          "snapshot_mean_curvature": (count * points,)}
arrays = [name for name in run.files if name != "parameters"]
assert {name: run[name].shape for name in arrays} == shapes, {name: run[name].shape for name in arrays}
assert json.loads(bytes(run["parameters"]))["steps"] == steps
types = {name: run[name].dtype.str for name in arrays}
geometry = types["points"]
assert geometry in ("<f4", "<f8")
for name, kind in types.items():
    assert kind == {"index": "<i8", "record": "<f8", "snapshot_start": "<i8", "snapshot_step": "<i8", "snapshot_time": "<f8"}.get(
        name, geometry), (name, kind)
assert (run["index"] == numpy.arange(points)).all()
assert (run["snapshot_start"] == points * numpy.arange(count + 1)).all()
assert run["snapshot_step"].tolist() == wanted
record = run["record"]
assert (record[:, 0] == numpy.arange(steps + 1)).all() and (record[:, 2] == points).all()
assert (numpy.diff(record[:, 1]) > 0).all() and record[0, 1] == 0
assert numpy.allclose(run["snapshot_time"], record[wanted, 1], rtol=1e-12)
last = run["snapshot_start"][-2]
assert (run["snapshot_points"][last:] == run["points"]).all()
assert numpy.allclose(numpy.linalg.norm(run["snapshot_normals"], axis=1), 1, atol=1e-5)
radius = numpy.linalg.norm(run["snapshot_points"].reshape(count, points, 3), axis=2).mean(axis=1)
assert numpy.allclose(radius ** 2, radius[0] ** 2 - 2 * run["snapshot_time"], atol=1e-3), radius
