"""The operations filter and flow: files and tensors in and out, masks, snapshots, what they refuse."""
import array
import json
import math
import os
import subprocess
import tempfile

import harness
from harness import expect_error

ON, FAR = 1500, 15
SPHERE = harness.sphere(ON)


def contaminated():
    """The sphere and some points at twice its radius."""
    far = harness.sphere(FAR, radius=2.0)
    return harness.floats(list(SPHERE) + list(far))


def mask(count, fixed):
    return bytes(1 if i < fixed else 0 for i in range(count))


def infer(server, operation, inputs, outputs=None, **parameters):
    headers, body = harness.infer_body(inputs, parameters, outputs)
    return server.post("/v2/models/%s/infer" % operation, body, headers)


def points_input(points):
    return "points", [len(points) // 3, 3], "FP32", points.tobytes()


def radii(points):
    return [math.sqrt(sum(x * x for x in points[i:i + 3])) for i in range(0, len(points), 3)]


def ply_comments(data):
    head = data.split(b"end_header\n", 1)[0].decode()
    return dict(line.split(" ", 2)[1:] for line in head.splitlines() if line.startswith("comment "))


def test_filter_and_flow_are_listed(server):
    names = [model["name"] for model in server.post("/v2/repository/index").json]
    assert names[:5] == ["estimate", "patch", "filter", "flow", "smooth"], names
    text = server.get("/openapi.yaml").text
    for path in ("/v1/filter:", "/v1/flow:", "/v2/models/filter/infer:", "/v2/models/flow/infer:"):
        assert path in text, path
    metrics = server.get("/metrics").text
    for name in ("filter", "flow"):
        assert server.get("/v2/models/%s/ready" % name).json["ready"] is True
        assert 'gnpd_requests_total{operation="%s",code="200"}' % name in metrics
        assert len(server.get("/v2/models/%s" % name).json["weights"]) == 5


def test_filter_and_flow_metadata(server):
    flow = server.get("/v2/models/flow").json
    inputs = {t["name"]: t for t in flow["inputs"]}
    outputs = {t["name"]: t for t in flow["outputs"]}
    parameters = {p["name"]: p for p in flow["parameters"]}
    assert inputs["fixed"]["datatype"] == "BOOL" and inputs["fixed"]["optional"] is True and inputs["fixed"]["shape"] == [-1]
    assert outputs["record"]["datatype"] == "FP64" and outputs["record"]["shape"] == [-1, 10]
    for column in ("step", "time", "points", "area", "volume", "curvature", "resolution", "thinned", "inserted", "seconds"):
        assert column in outputs["record"]["help"], column
    assert parameters["dt"]["type"] == "number_or_auto" and parameters["dt"]["default"] == "auto" and parameters["dt"]["minimum"] > 0
    outputs = {t["name"]: t for t in server.get("/v2/models/filter").json["outputs"]}
    assert outputs["keep"]["datatype"] == "BOOL" and outputs["index"]["datatype"] == "INT64" and outputs["points"]["datatype"] == "FP32"


def test_filter_file_without_outliers(server):
    cloud = contaminated()
    response = server.post("/v1/filter?estimator=adaptive&gross=3", harness.ply(cloud))
    assert response.status == 200, response.text[:300]
    names, rows = harness.parse_ply(response.body)
    assert names[:6] == ["x", "y", "z", "nx", "ny", "nz"] and "scalar_index" in names, names
    assert len(rows) == ON and [row[names.index("scalar_index")] for row in rows] == list(range(ON))
    comments = ply_comments(response.body)
    assert comments["left_out"] == "keep, deviation" and comments["kept"] == str(ON), comments
    dropped = sum(int(comments["dropped_" + rule]) for rule in ("gross", "deviation", "consensus"))
    assert dropped == FAR, comments


def test_filter_outputs_beside_the_cloud(server):
    cloud = contaminated()
    response = server.post("/v1/filter?estimator=adaptive&gross=3&outputs=keep,deviation&format=xyz", harness.ply(cloud))
    assert response.status == 200, response.text[:300]
    lines = response.text.splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    assert [line for line in lines if line.startswith("# x")] == ["# x y z keep deviation"]
    assert len(rows) == ON + FAR and [row[3] for row in rows] == ["1"] * ON + ["0"] * FAR
    expect_error(server.post("/v1/filter?estimator=gmls&outputs=index&format=ply", harness.ply(cloud)), 406, "not_acceptable",
                 "ply: the points have %d rows, and other numbers of rows have index: ask for npz or json" % (ON + FAR))


def test_filter_tensors(server):
    cloud = contaminated()
    head, outputs = harness.parse_infer(infer(server, "filter", [points_input(cloud)], estimator="adaptive", gross=3, project=True))
    assert head["model_name"] == "filter" and head["parameters"]["kept"] == ON and head["parameters"]["stop"]
    assert list(outputs["keep"]) == [1] * ON + [0] * FAR and list(outputs["index"]) == list(range(ON))
    assert len(outputs["points"]) == 3 * ON and len(outputs["deviation"]) == ON + FAR
    assert max(abs(r - 1) for r in radii(outputs["points"])) < 0.01
    assert max(abs(r - 1) for r in radii(outputs["normals"])) < 1e-5


def test_filter_tensors_as_json(server):
    message = {"inputs": [{"name": "points", "shape": [ON, 3], "datatype": "FP64", "data": list(SPHERE)}],
               "parameters": {"estimator": "gmls", "consensus": False}, "outputs": [{"name": "index"}, {"name": "keep"}]}
    response = server.post("/v2/models/filter/infer", json.dumps(message).encode())
    assert response.status == 200, response.text[:300]
    outputs = {o["name"]: o for o in response.json["outputs"]}
    assert list(outputs) == ["index", "keep"] and outputs["keep"]["datatype"] == "BOOL" and outputs["index"]["datatype"] == "INT64"
    assert set(outputs["keep"]["data"]) <= {True, False} and sum(outputs["keep"]["data"]) == len(outputs["index"]["data"])


def test_filter_by_a_model(server):
    """The default judges every point itself. The small models know no geometry, but the way is the same."""
    response = server.post("/v1/filter", harness.ply(contaminated()))
    assert response.status == 200, response.text[:300]
    said = ply_comments(response.body)
    assert said["weights"] == "any" and 0.95 * ON < int(said["kept"]) <= 1.02 * ON, said
    response = server.post("/v1/filter?alpha=1000000&consensus=false&weights=fit_outlier_50k", harness.ply(SPHERE))
    assert response.status == 200, response.text[:300]
    said = ply_comments(response.body)
    assert said["weights"] == "fit_outlier_50k" and int(said["kept"]) == ON, said
    expect_error(server.post("/v1/filter?weights=nonsense", harness.ply(SPHERE)), 400, "invalid_argument", 'weights: got "nonsense"')


def test_smooth_takes_noise_off(server):
    """By /v1, /v2 and as a job: the same points."""
    noisy = harness.floats(x * (1 + 0.02 * math.sin(12.9898 * (i // 3))) for i, x in enumerate(SPHERE))
    response = server.post("/v1/smooth?estimator=gmls&rounds=1&format=json", harness.ply(noisy))
    assert response.status == 200, response.text[:300]
    comments = response.json
    head, outputs = harness.parse_infer(infer(server, "smooth", [points_input(noisy)], estimator="gmls", rounds=1))
    assert sorted(outputs) == ["moved", "normals", "points"] and head["parameters"]["noise"] > 0 and head["parameters"]["radius"] > 0
    before, after = radii(noisy), radii(outputs["points"])
    assert len(after) == len(before) == len(outputs["moved"])
    rough = [math.sqrt(sum((r - sum(of) / len(of)) ** 2 for r in of) / len(of)) for of in (before, after)]
    assert rough[1] < rough[0] / 2, rough
    assert abs(sum(after) / len(after) - sum(before) / len(before)) < 0.003
    assert sum(len(row) for row in comments["points"]) == 3 * ON
    for query, text in (("noise=0", "noise: got 0, need auto or >0"), ("rounds=0", "rounds: got 0, need 1..20"),
                        ("features=sharp", 'features: got "sharp", need one of round, keep')):
        expect_error(server.post("/v1/smooth?" + query, harness.ply(noisy)), 400, "invalid_argument", text)


def test_smooth_holds_points_and_bounds_moves(server):
    head, outputs = harness.parse_infer(infer(server, "smooth", [points_input(SPHERE), ("fixed", [ON], "BOOL", mask(ON, 40))],
                                              estimator="gmls", noise=1e-4))
    assert list(outputs["points"][:120]) == list(SPHERE[:120])
    assert max(abs(x) for x in outputs["moved"]) <= 4.01e-4 and head["parameters"]["noise"] == 1e-4


def test_flow_file(server):
    response = server.post("/v1/flow?estimator=gmls&steps=3", harness.ply(SPHERE))
    assert response.status == 200, response.text[:300]
    names, rows = harness.parse_ply(response.body)
    comments = ply_comments(response.body)
    assert "scalar_mean_curvature" in names and comments["left_out"] == "record" and comments["stop"] == "steps", comments
    radius = sum(math.sqrt(sum(x * x for x in row[:3])) for row in rows) / len(rows)
    time = float(comments["time"])
    assert abs(radius - math.sqrt(1 - 2 * time)) < 0.02 * time, (radius, time)
    assert len(rows) == int(comments["points"])


def test_flow_snapshots_for_numpy(server):
    """Passes unseen where numpy is not installed."""
    response = server.post("/v1/flow?estimator=gmls&steps=5&snapshot_every=2&spacing=0&insertion=0&format=npz", harness.ply(SPHERE))
    assert response.status == 200, response.text[:300]
    oracle = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "oracles", "oracle_snapshots.py")
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        file.write(response.body)
        file.flush()
        done = subprocess.run(["/usr/bin/python3", oracle, file.name, str(ON), "5", "2"], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT)
    assert done.returncode in (0, 77), done.stdout.decode()[-2000:]


def test_flow_tensors_with_a_mask(server):
    kinds = {"BOOL": mask(ON, 100), "UINT8": mask(ON, 100), "FP32": harness.floats(list(mask(ON, 100))).tobytes(),
             "INT64": array.array("q", list(mask(ON, 100))).tobytes()}
    answers = []
    for kind, data in kinds.items():
        response = infer(server, "flow", [points_input(SPHERE), ("fixed", [ON], kind, data)], estimator="gmls", steps=2, spacing=0,
                         insertion="0", dt="auto")
        assert response.status == 200, (kind, response.text[:300])
        head, outputs = harness.parse_infer(response)
        assert sorted(outputs) == ["index", "mean_curvature", "normals", "points", "record"]
        assert outputs["points"][:300] == SPHERE[:300] and outputs["points"][300:330] != SPHERE[300:330]
        answers.append(outputs["points"])
    assert all(answer == answers[0] for answer in answers)


def test_flow_mask_in_a_file(server):
    def xyz(values):
        rows = ("%.9g %.9g %.9g %s" % (*SPHERE[3 * i:3 * i + 3], values(i)) for i in range(ON))
        return ("# x y z fixed\n" + "\n".join(rows)).encode()
    path = "/v1/flow?estimator=gmls&spacing=0&insertion=0&outputs=points&format=json"
    response = server.post(path, xyz(lambda i: int(i < 100)), {"Content-Type": "text/plain"})
    assert response.status == 200, response.text[:300]
    points = [x for point in response.json["points"] for x in point]
    assert all(abs(a - b) < 1e-12 for a, b in zip(points[:300], map(lambda x: float("%.9g" % x), SPHERE[:300])))
    assert max(radii(points[300:])) < 1
    expect_error(server.post(path, xyz(lambda i: 3 if i == 17 else 0), {"Content-Type": "text/plain"}), 400, "invalid_argument",
                 "fixed[17]: got 3, need 0 or 1")


def test_flow_snapshots_as_tensors(server):
    wanted = [{"name": "snapshot_step"}, {"name": "snapshot_time"}, {"name": "snapshot_points"}]
    response = infer(server, "flow", [points_input(SPHERE)], wanted, estimator="gmls", steps=2, snapshot_every=1, spacing=0, insertion=0)
    assert response.status == 200, response.text[:300]
    head, outputs = harness.parse_infer(response)
    assert list(outputs["snapshot_step"]) == [0, 1, 2] and len(outputs["snapshot_points"]) == 9 * ON
    assert outputs["snapshot_points"][:3 * ON] == SPHERE
    response = infer(server, "flow", [points_input(SPHERE)], wanted, estimator="gmls")
    expect_error(response, 400, "invalid_argument", "snapshot_step: needs snapshot_every, got 0, need at least 1")
    everything = [{"name": t["name"]} for t in server.get("/v2/models/flow").json["outputs"]]
    response = infer(server, "flow", [points_input(SPHERE)], everything, estimator="gmls")
    expect_error(response, 400, "invalid_argument", "snapshot_start: needs snapshot_every")


def test_flow_refuses_bad_parameters(server):
    body = harness.ply(SPHERE)
    for query, text in (("dt=0", "dt: got 0, need auto or >0..1e+200"), ("dt=-1", "dt: got -1, need"), ("dt=nan", 'dt: got "nan", need auto or a number'),
                        ("dt=inf", 'dt: got "inf"'), ("dt=", 'dt: got ""'), ("dt=1e9&estimator=gmls", "dt: got 1e+09, need"),
                        ("steps=0", "steps: got 0, need 1..1000000"), ("steps=2.5", "steps: got 2.5, need an integer"),
                        ("scheme=magic", 'scheme: got "magic", need one of explicit, semi_implicit, conformal'),
                        ("volume=twice", "volume: got"), ("smoothing_radius=-1", "smoothing_radius: got -1, need auto or 0..1e+100"),
                        ("spacing=-0.1", "spacing: got -0.1"), ("spacing=1e9&estimator=gmls", "spacing: got 1e+09"),
                        ("insertion=-1", "insertion: got -1"), ("tangential=2", "tangential: got 2, need 0..1"),
                        ("singularity=0", "singularity: got 0, need auto or >0..1000000"), ("snapshot_every=-1", "snapshot_every: got -1"),
                        ("spacing_limit=1&estimator=gmls", "spacing_limit: got 1, need"), ("pace=3", 'unknown parameter "pace", known: steps, dt')):
        expect_error(server.post("/v1/flow?" + query, body), 400, "invalid_argument", text)
    response = infer(server, "flow", [points_input(SPHERE)], dt=True)
    expect_error(response, 400, "invalid_argument", 'dt: got "true", need auto or a number')
    response = infer(server, "flow", [points_input(SPHERE)], dt=-1)
    expect_error(response, 400, "invalid_argument", "dt: got -1, need auto or")


def test_flow_refuses_more_snapshots_than_memory(server):
    query = "estimator=gmls&steps=1000000&snapshot_every=1"
    response = server.post("/v1/flow?" + query, harness.ply(SPHERE))
    expect_error(response, 413, "too_large")


def test_flow_refuses_bad_masks(server):
    for rows, kind, data, text in (
            (ON - 1, "BOOL", mask(ON - 1, 1), 'input "fixed": %d rows, need %d' % (ON - 1, ON)),
            (ON, "UINT8", mask(ON - 1, 0) + b"\7", "fixed[%d]: got 7, need 0 or 1" % (ON - 1)),
            (ON, "BOOL", b"\2" + mask(ON - 1, 0), "fixed[0]: got 2, need 0 or 1"),
            (ON, "FP32", harness.floats([math.nan] + [0] * (ON - 1)).tobytes(), "fixed[0]: got nan, need 0 or 1")):
        response = infer(server, "flow", [points_input(SPHERE), ("fixed", [rows], kind, data)], estimator="gmls")
        expect_error(response, 400, "invalid_argument", text)
    response = infer(server, "flow", [points_input(SPHERE), ("fixed", [ON, 1], "BOOL", mask(ON, 1))], estimator="gmls")
    expect_error(response, 400, "invalid_argument", 'input "fixed": shape [%d,1], need [n]' % ON)
    response = infer(server, "filter", [points_input(SPHERE), ("fixed", [ON], "BOOL", mask(ON, 1))])
    expect_error(response, 400, "invalid_argument", 'unknown input "fixed", known: points, normals')


def test_filter_refuses_bad_parameters(server):
    body = harness.ply(SPHERE)
    for query, text in (("alpha=-1", "alpha: got -1, need 0..1000000"), ("alpha=nan", "alpha: got"), ("gross=0.5&estimator=gmls", "gross: got 0.5, need"),
                        ("cluster=0", "cluster: got 0, need 1..1000000"), ("project", 'query: got "project", need name=value'),
                        ("project=maybe", 'project: got "maybe", need true or false'), ("iterations=0", "iterations: got 0"),
                        ("outputs=points,thing", 'outputs: unknown "thing", known: keep, deviation, points, index, normals')):
        expect_error(server.post("/v1/filter?" + query, body), 400, "invalid_argument", text)
