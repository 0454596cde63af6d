"""Formats of /v1: which one an answer gets, what is refused before anything is computed, and that no body becomes more than the limits say."""
import gzip
import io
import json
import struct
import zipfile

import harness
from harness import expect_error

CLOUD = harness.sphere(600)
FAST = "estimator=gmls"


def npy(points, shape=None):
    header = "{'descr': '<f4', 'fortran_order': False, 'shape': %s, }" % (shape or "(%d, 3)" % (len(points) // 3))
    header += " " * (-(len(header) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + points.tobytes()


def xyz(points):
    return "".join("%r %r %r\n" % tuple(points[i:i + 3]) for i in range(0, len(points), 3)).encode()


def arrays(response):
    """The names in an archive, but for what it says of itself."""
    assert response.status == 200, response.text
    assert response.headers["content-type"] == "application/x-npz", response.headers
    names = sorted(name[:-4] for name in zipfile.ZipFile(io.BytesIO(response.body)).namelist())
    names.remove("parameters")
    return names


def content_type(response):
    assert response.status == 200, response.text
    return response.headers["content-type"]


def peak_kib(server):
    with open("/proc/%d/status" % server.process.pid) as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))


# ---- The answer's format ----

def test_a_default_gives_way_to_one_that_holds_the_answer(server):
    """NPY in, and every default answer was a 406 after all the work."""
    assert "normals" in arrays(server.post("/v1/estimate?" + FAST, npy(CLOUD)))
    assert content_type(server.post("/v1/estimate?quantities=normals&" + FAST, npy(CLOUD))) == "application/x-npy"
    operator = ["columns", "kept", "points", "row_offsets", "values"]
    for body in (npy(CLOUD), harness.ply(CLOUD), xyz(CLOUD)):
        assert arrays(server.post("/v1/laplacian?" + FAST, body)) == operator
        assert arrays(server.post("/v1/laplacian?" + FAST, body, {"Accept": "*/*"})) == operator
    assert content_type(server.post("/v1/laplacian?format=ply&" + FAST, harness.ply(CLOUD))) == "application/ply"
    assert content_type(server.post("/v1/filter?" + FAST, harness.ply(CLOUD))) == "application/ply"
    assert "keep" in arrays(server.post("/v1/filter?outputs=keep,points&" + FAST, harness.ply(CLOUD)))
    assert content_type(server.post("/v1/estimate?" + FAST, xyz(CLOUD))) == "text/plain"


def test_what_cannot_hold_the_answer_is_refused_at_once(server):
    before = server.metric("gnpd_jobs_submitted_total")
    for path in ("/v1/", "/v1/jobs/"):
        expect_error(server.post(path + "estimate?format=npy&" + FAST, npy(CLOUD)), 406, "not_acceptable", "npy", "has 3", "npz")
        expect_error(server.post(path + "estimate?" + FAST, npy(CLOUD), {"Accept": "application/x-npy"}), 406, "not_acceptable", "npy")
        expect_error(server.post(path + "estimate?format=mtx&" + FAST, npy(CLOUD)), 406, "not_acceptable", "mtx", "estimate")
        expect_error(server.post(path + "spectrum?format=ply&outputs=eigenvalues&" + FAST, npy(CLOUD)), 406, "not_acceptable", "ply", "npz")
    assert server.metric("gnpd_jobs_submitted_total") == before


def test_numbers_are_checked_before_a_job_is_taken(server):
    few = harness.ply(harness.sphere(300))
    before = server.metric("gnpd_jobs_submitted_total")
    expect_error(server.post("/v1/jobs/estimate?" + FAST, harness.ply(harness.sphere(20))), 400, "invalid_argument", "points: got 20", "30")
    expect_error(server.post("/v1/jobs/estimate?k=400&" + FAST, few), 400, "invalid_argument", "points: got 300", "400")
    many = server.post("/v1/jobs/spectrum?system=square&count=100&" + FAST, few)
    expect_error(many, 400, "invalid_argument", "points: got 300", "496")
    expect_error(server.post("/v1/jobs/flow?outputs=snapshot_points&" + FAST, few), 400, "invalid_argument", "snapshot_every")
    assert server.metric("gnpd_jobs_submitted_total") == before


def test_accept_is_answered_in_its_own_words(server):
    def answered(accept, body=harness.ply(CLOUD), query=""):
        return content_type(server.post("/v1/estimate?" + FAST + query, body, {"Accept": accept}))
    assert answered("text/*") == "text/plain"
    assert answered("application/*") == "application/ply"
    assert answered("application/*", xyz(CLOUD)) == "application/ply"
    assert answered("text/csv") == "text/csv" and answered("*/*", xyz(CLOUD)) == "text/plain"
    table = server.post("/v1/estimate?quantities=normals&" + FAST, xyz(CLOUD).replace(b" ", b","), {"Content-Type": "text/csv"})
    assert content_type(table) == "text/csv" and table.text.startswith("x,y,z,nx,ny,nz\n"), table.text[:100]
    assert all(line.count(",") == 5 for line in table.text.splitlines())
    assert answered("application/octet-stream") == "application/octet-stream"
    assert answered("application/octet-stream", npy(CLOUD)) == "application/octet-stream"
    assert answered("application/json;q=2, */*;q=0.1") == "application/ply"
    for accept in ("image/*", "text/html", "application/json;q=2", "application/json;q=0"):
        expect_error(server.post("/v1/estimate?" + FAST, harness.ply(CLOUD), {"Accept": accept}), 406, "not_acceptable", accept)


# ---- Bodies ----

def test_members_of_json_without_effect(server):
    points = [list(CLOUD[i:i + 3]) for i in range(0, len(CLOUD), 3)]
    def post(**members):
        return server.post("/v1/estimate?" + FAST, json.dumps(dict(members, points=points)).encode())
    expect_error(post(k=30), 400, "invalid_argument", '"k" is a parameter', "?k=30")
    expect_error(post(quantities=["normals"]), 400, "invalid_argument", "?quantities=")
    expect_error(post(format="ply"), 400, "invalid_argument", "?format=ply")
    expect_error(post(parameters={"k": 30}), 400, "invalid_argument", '"parameters"', "?k=30")
    expect_error(post(title="cloud"), 400, "invalid_argument", '"title"', "points, normals", "query")
    assert post(intensity=[0] * 600, normals=None).status == 200
    body = json.dumps({"points": points, "fixed": [False] * 600}).encode()
    assert server.post("/v1/flow?" + FAST, body).status == 200


def test_json_answers_go_back_in(server):
    """gnpd refused its own answers for the member "parameters", and would have for every output."""
    for operation, query in (("estimate", ""), ("filter", ""), ("flow", "&steps=2"), ("laplacian", "")):
        answer = server.post("/v1/%s?format=json&%s%s" % (operation, FAST, query), harness.ply(CLOUD))
        assert content_type(answer) == "application/json"
        assert answer.json["parameters"]["estimator"] == "gmls"
        for headers in ({}, {"Content-Type": "application/json"}):
            again = server.post("/v1/estimate?" + FAST, answer.body, headers)
            assert content_type(again) == "application/json" and "gaussian_curvature" in again.json, operation


def test_jobs_tell_requests_of_the_protocol_from_clouds(server):
    """curl calls every body application/x-www-form-urlencoded, and others call it nothing."""
    message = {"inputs": [{"name": "points", "shape": [600, 3], "datatype": "FP32", "data": list(CLOUD)}], "parameters": {"estimator": "gmls"}}
    for headers in ({}, {"Content-Type": "application/x-www-form-urlencoded"}, {"Content-Type": "application/octet-stream"},
                    {"Content-Type": "application/json"}):
        response = server.post("/v1/jobs/estimate", json.dumps(message).encode(), headers)
        assert response.status == 202, response.text
        job = response.json["id"]
        assert server.get("/v1/jobs/%s?wait=20s" % job).json["state"] == "succeeded"
        assert server.get("/v1/jobs/%s/result" % job).json["outputs"]
        assert server.request("DELETE", "/v1/jobs/" + job).status == 204
    expect_error(server.post("/v1/jobs/estimate", json.dumps(message).encode(), {"Content-Type": "text/plain"}), 400, "invalid_argument")
    expect_error(server.post("/v1/estimate", json.dumps(message).encode()), 400, "invalid_argument", "inputs", "points, normals")


def test_tables_with_a_heading_need_no_name(server):
    """A CSV answer was a 415 without a Content-Type."""
    answer = server.post("/v1/estimate?format=csv&" + FAST, harness.ply(CLOUD))
    assert answer.text.startswith("x,y,z,nx,ny,nz"), answer.text[:100]
    for headers in ({}, {"Content-Type": "application/x-www-form-urlencoded"}):
        assert content_type(server.post("/v1/estimate?" + FAST, answer.body, headers)) == "text/csv"
    assert content_type(server.post("/v1/estimate?" + FAST, b"X Y Z\r\n" + xyz(CLOUD))) == "text/plain"
    expect_error(server.post("/v1/estimate", b"xyz\n" + xyz(CLOUD)), 415, "unsupported_media")


def test_rows_that_begin_with_nan(server):
    expect_error(server.post("/v1/estimate", b"nan 0 0\n" + xyz(CLOUD)), 400, "invalid_argument", "point 0")


def test_texts_of_too_many_points():
    with harness.Server(max_points=500) as server:
        expect_error(server.post("/v1/estimate", xyz(CLOUD)), 413, "too_large", "points: got more than 500, need at most 500")
        assert server.metric("gnpd_rejected_total{reason=\"points\"}") == 1


# ---- Memory ----

def archive(columns, rows=10):
    """An array (rows, columns) of zeros: a thousandth of its size when deflated."""
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d), }" % (rows, columns)
    header += " " * (-(len(header) + 11) % 64) + "\n"
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as z, z.open("points.npy", "w", force_zip64=True) as array:
        array.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode())
        for _ in range(rows * columns // 1000000):
            array.write(bytes(8000000))
    return file.getvalue()


def test_archives_become_no_more_than_the_limits():
    """3,482 bytes made the daemon 1.97 GB big."""
    wide, long = archive(5000000), archive(3, 5000000)
    with harness.Server(max_body_bytes="16M", request_memory_bytes="64M", queue_bytes="128M") as server:
        for encode, headers in ((bytes, {}), (gzip.compress, {"Content-Encoding": "gzip"})):
            expect_error(server.post("/v1/estimate", encode(wide), headers), 400, "invalid_argument", "5000000 columns", "(n,3)")
            expect_error(server.post("/v1/estimate", encode(long), headers), 413, "too_large", "120000000 more", "request-memory-bytes")
        assert server.metric("gnpd_rejected_total{reason=\"request_memory\"}") == 2
        assert server.metric("gnpd_rejected_total{reason=\"points\"}") == 0
        server.wait_metric("gnpd_queue_bytes", 0)
        assert harness.SLOW > 1 or peak_kib(server) < 100_000, peak_kib(server)
    with harness.Server(max_body_bytes="16M", queue_bytes="64M") as server:
        expect_error(server.post("/v1/estimate", long), 413, "too_large", "queue-bytes")


def test_texts_become_no_more_than_the_limits():
    """Two characters of a table are a number of eight bytes."""
    row = b"x y z " + b" ".join(b"c%d" % i for i in range(97)) + b"\n"
    table = row + (b"1 " * 99 + b"1\n") * 100000
    message = b'{"inputs":[{"name":"points","datatype":"FP64","shape":[2000000,3],"data":[0' + b",0" * 5999999 + b"]}]}"
    with harness.Server(max_body_bytes="32M", request_memory_bytes="48M", queue_bytes="128M") as server:
        expect_error(server.post("/v1/estimate?format=xyz", table), 413, "too_large", "request-memory-bytes")
        expect_error(server.post("/v2/models/estimate/infer", message), 413, "too_large", "48000000 more", "request-memory-bytes")
        server.wait_metric("gnpd_queue_bytes", 0)
        assert harness.SLOW > 1 or peak_kib(server) < 130_000, peak_kib(server)


def test_columns_become_no_more_than_the_limits():
    """A right-hand side of one byte a point takes forty at work."""
    points, sides = harness.sphere(500), 30000
    headers, body = harness.infer_body([("points", [500, 3], "FP32", points.tobytes()),
                                        ("source", [500, sides], "UINT8", bytes(500 * sides))], {"estimator": "gmls", "screening": 1.0},
                                       [{"name": "residual"}])
    with harness.Server(max_body_bytes="64M", request_memory_bytes="96M", queue_bytes="128M") as server:
        expect_error(server.post("/v2/models/poisson/infer", body, headers), 413, "too_large", "request-memory-bytes")
        server.wait_metric("gnpd_queue_bytes", 0)
