"""What answers say of themselves: the headers of every answer, results and records of jobs, and the files themselves."""
import io
import json
import os
import re
import shutil
import tempfile
import zipfile

import harness
from harness import Server, expect_error
from test_jobs import finished, submit

BOTH = harness.sphere(600) + harness.floats(x + 5 * (i % 3 == 0) for i, x in enumerate(harness.sphere(600)))
TWO = harness.ply(BOTH)  # two spheres without normals: each is oriented by itself, which is warned of
ONE = harness.ply(harness.sphere(600))
CALL = "estimate?quantities=mean_curvature&weights=fit_clean_30k"
REAL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "weights", "fit_clean_30k.safetensors")
FORMATS = ("ply", "npy", "npz", "xyz", "csv", "vtk", "json")
WARNING = "components: normals were estimated and each of 2 separate components is oriented by itself"


def trained(**flags):
    """A daemon with a model whose answers warn of nothing but what they should."""
    with open(REAL, "rb") as file:
        return Server(weights={"fit_clean_30k.safetensors": file.read()}, **flags)


def of_array(data):
    """The bytes of a file NPY of uint8, as numpy.load gives them."""
    length = int.from_bytes(data[8:10], "little")
    head = data[10:10 + length].decode()
    assert "'|u1'" in head, head
    return data[10 + length:]


def of_comments(text, mark):
    """Name and rest of every line of comment, as lists: of some there are several."""
    found = {}
    for line in re.findall(mark + r" (\w+) (.*)", text):
        found.setdefault(line[0], []).append(line[1].rstrip("\r"))
    return found


def said_in(kind, body):
    """(weights_sha256, warnings) by the body alone; None where the format has no place for them."""
    if kind in ("npy", "csv"):
        return None
    if kind in ("ply", "xyz"):
        lines = of_comments(body.decode("latin-1"), "comment" if kind == "ply" else "#")
        return lines["weights_sha256"][0], lines.get("warnings", [])
    if kind == "npz":
        said = json.loads(of_array(zipfile.ZipFile(io.BytesIO(body)).read("parameters.npy")))
    elif kind == "vtk":
        at = re.search(rb"\nFIELD FieldData 1\nparameters 1 (\d+) unsigned_char\n", body)
        said = json.loads(body[at.end():at.end() + int(at.group(1))])
        assert body[at.end() + int(at.group(1)):].startswith(b"\nPOINTS ")
    else:
        said = json.loads(body)["parameters"]
    return said["weights_sha256"], [w for w in said.get("warnings", "").split("; ") if w]


def check(response, kind, warnings):
    assert response.status == 200, response.text
    assert response.headers["x-gnpd-warnings"] == str(len(warnings)), response.headers
    said = json.loads(response.headers["x-gnpd-parameters"])
    assert said["estimator"] == "gnp" and said["weights"] == "fit_clean_30k" and len(said["weights_sha256"]) == 64, said
    assert said.get("warnings", "") == "; ".join(warnings), said
    assert said_in(kind, response.body) in (None, (said["weights_sha256"], warnings)), said_in(kind, response.body)


def test_files_come_with_what_they_say():
    with trained() as server:
        for kind in FORMATS:
            check(server.post("/v1/%s&format=%s" % (CALL, kind), TWO), kind, [WARNING])
            check(server.post("/v1/%s&format=%s" % (CALL, kind), ONE), kind, [])
        matrix = server.post("/v1/laplacian?format=mtx&weights=fit_clean_30k", ONE)
        assert matrix.status == 200 and matrix.headers["x-gnpd-warnings"].isdigit(), matrix.headers
        digest = json.loads(matrix.headers["x-gnpd-parameters"])["weights_sha256"]
        assert of_comments(matrix.text, "%")["weights_sha256"] == [digest]


def test_tensors_come_with_their_count():
    with trained() as server:
        for cloud, count in ((BOTH, 1), (harness.sphere(600), 0)):
            headers, body = harness.points_body(cloud, weights="fit_clean_30k")
            response = server.post("/v2/models/estimate/infer", body, headers)
            assert response.status == 200 and response.headers["x-gnpd-warnings"] == str(count), response.headers
            said = harness.parse_infer(response)[0]["parameters"]
            assert len(said["weights_sha256"]) == 64 and said.get("warnings", "") == WARNING * count, said


def test_every_operation_names_the_weights_it_chose(server):
    sides = {"poisson": ["source"], "heat": ["initial"]}
    points = BOTH[:1800]
    for operation in (model["name"] for model in server.post("/v2/repository/index").json):
        inputs = [("points", [600, 3], "FP32", points.tobytes())]
        inputs += [(name, [600, 1], "FP32", points[2::3].tobytes()) for name in sides.get(operation, [])]
        headers, body = harness.infer_body(inputs, {"steps": 1} if operation == "flow" else {})
        response = server.post("/v2/models/%s/infer" % operation, body, headers)
        assert response.status == 200, (operation, response.text)
        said = harness.parse_infer(response)[0]["parameters"]
        assert said["estimator"] == "gnp" and said["weights"] and len(said["weights_sha256"]) == 64, (operation, said)


def test_errors_have_no_count(server):
    response = server.post("/v1/estimate?k=1", ONE)
    expect_error(response, 400, "invalid_argument", "k:")
    assert "x-gnpd-warnings" not in response.headers and "x-gnpd-parameters" not in response.headers


def test_jobs_say_it_too():
    with trained() as server:
        for kind in FORMATS:
            for cloud, warnings in ((TWO, [WARNING]), (ONE, [])):
                job = submit(server, "%s&format=%s" % (CALL, kind), cloud)
                record = finished(server, job)
                assert record["state"] == "succeeded" and record["warnings"] == warnings, record
                check(server.get("/v1/jobs/%s/result" % job), kind, warnings)
        part = server.get("/v1/jobs/%s/result" % job, headers={"Range": "bytes=0-9"})
        assert part.status == 206 and part.headers["x-gnpd-warnings"] == "0" and "x-gnpd-parameters" in part.headers, part.headers
        beyond = server.get("/v1/jobs/%s/result" % job, headers={"Range": "bytes=99999999-"})
        assert beyond.status == 416 and "x-gnpd-warnings" not in beyond.headers, beyond.headers


def test_a_job_that_is_not_over_warns_of_nothing(server):
    job = submit(server, "flow?estimator=gmls&steps=1000000&dt=1e-9&scheme=explicit")
    assert "warnings" not in server.get("/v1/jobs/" + job).json
    server.request("DELETE", "/v1/jobs/" + job)
    assert "warnings" not in finished(server, job)


def test_what_jobs_say_outlives_the_process():
    folder = tempfile.mkdtemp(prefix="gnpd-report-test.")
    try:
        with trained(jobs_dir=folder) as server:
            job = submit(server, CALL + "&format=npy", TWO, {"Idempotency-Key": "one"})
            finished(server, job)
            before = server.get("/v1/jobs/%s/result" % job)
        with trained(jobs_dir=folder) as server:
            again = server.post("/v1/jobs/%s&format=npy" % CALL, TWO, {"Idempotency-Key": "one"})
            assert again.status == 200 and again.json["id"] == job and again.json["warnings"] == [WARNING], again.text
            assert server.get("/v1/jobs").json["jobs"][0]["warnings"] == [WARNING]
            after = server.get("/v1/jobs/%s/result" % job)
            check(after, "npy", [WARNING])
            assert after.headers["x-gnpd-parameters"] == before.headers["x-gnpd-parameters"]
    finally:
        shutil.rmtree(folder, ignore_errors=True)
