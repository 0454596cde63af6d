"""The weights a daemon has: loaded or refused at the start, in the metadata, loaded again under load, named by requests."""
import hashlib
import os
import shutil
import signal
import subprocess
import tempfile
import threading

import harness
from harness import expect_error

CLOUD = harness.sphere(300)
SMOOTH = harness.sphere(2000)
ESTIMATE = "/v2/models/estimate/infer"
ONE, OTHER = harness.edge_weights(), harness.edge_weights(scale=0.02)
RELOADS = "gnpd_weights_reloads_total{result=\"%s\"}"


def digests(server):
    return {w["name"]: w["sha256"] for w in server.get("/v2/models/estimate").json["weights"]}


def digest(content):
    return hashlib.sha256(content).hexdigest()


def start_with(name, content):
    """Standard error of a daemon that has to refuse a file."""
    folder = tempfile.mkdtemp(prefix="gnpd-e2e.")
    try:
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)
        done = subprocess.run([harness.BINARY, "--listen", "127.0.0.1:0", "--weights-dir", folder], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, timeout=20 * harness.SLOW)
        assert done.returncode == 1, (done.returncode, done.stderr)
        assert "Sanitizer" not in done.stderr and "ready on port" not in done.stderr, done.stderr
        checked = subprocess.run([harness.BINARY, "--check-config", "--weights-dir", folder], stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True, timeout=20 * harness.SLOW)
        assert checked.returncode == 1 and checked.stderr == done.stderr, (checked, done.stderr)
        return done.stderr
    finally:
        shutil.rmtree(folder)


def test_weights_in_the_metadata():
    with harness.Server(weights={"small.safetensors": ONE, "another.safetensors": OTHER, "README.md": b"no weights"}) as server:
        entries = server.get("/v2/models/estimate").json["weights"]
        assert [w["name"] for w in entries] == ["another", "small"]
        count = (len(ONE) - 8 - int.from_bytes(ONE[:8], "little")) // 4
        assert entries[1] == {"name": "small", "sha256": digest(ONE), "parameter_count": count, "regime": "clean", "k": 30}, entries
        assert server.metric("gnpd_weights_models") == 2
        harness.eventually(lambda: "2 models from" in server.log(), what="the log line")


def test_a_bad_file_stops_the_start():
    header = (10 ** 12).to_bytes(8, "little")
    swapped = ONE.replace(b'"data_offsets": [96, 128]', b'"data_offsets": [92, 124]')
    nan = ONE[:-4] + b"\0\0\xc0\x7f"
    assert swapped != ONE
    for content, *texts in (
            (ONE[:-1], 'tensor "mlp.2.bias": data_offsets: got [3408,3472], need'), (ONE + b"\0\0\0\0", "bytes of data, need the"), (b"", "got 0 bytes, need 10"),
            (header + b"{}", "header length: got 1000000000000 in a file of 10 bytes"),
            (swapped, 'tensor "model.lift.bias"', "overlaps"),
            (nan, 'tensor "mlp.2.bias": value 15: got nan, need a finite number'),
            (ONE.replace(b"model.proj.bias", b"model.proj.bios"), 'tensor "model.proj.bias": missing, need shape [8]'),
            (harness.edge_weights(width="16"), 'tensor "model.lift.weight": shape: got [8,3], need [16,3]'),
            (harness.edge_weights(trunk="wide"), 'metadata "trunk": got "wide", need edge or separable'),
            (harness.edge_weights(head="deep"), 'metadata "head": got "deep", need pooled or projection'),
            (harness.safetensors(harness.edge_tensors(), {}), 'metadata "gnp_format": got none, need 1')):
        error = start_with("wrong.safetensors", content)
        for text in ("gnpd: ", "wrong.safetensors: ", *texts):
            assert text in error, (text, error)


def test_reload_takes_good_weights_and_keeps_old_ones():
    with harness.Server(weights={"small.safetensors": ONE}) as server:
        assert digests(server) == {"small": digest(ONE)}
        server.put_weights("small.safetensors", OTHER)
        server.put_weights("more.safetensors", ONE)
        assert digests(server) == {"small": digest(ONE)}
        server.signal(signal.SIGHUP)
        server.wait_metric(RELOADS % "ok", 1)
        assert digests(server) == {"small": digest(OTHER), "more": digest(ONE)}
        server.put_weights("small.safetensors", ONE[:-1])
        server.signal(signal.SIGHUP)
        server.wait_metric(RELOADS % "failed", 1)
        assert digests(server) == {"small": digest(OTHER), "more": digest(ONE)}
        harness.eventually(lambda: "weights: what is in use stays: " in server.log() and "small.safetensors: tensor" in server.log())
        for name in os.listdir(server.weights_folder):
            os.unlink(os.path.join(server.weights_folder, name))
        server.signal(signal.SIGHUP)
        server.wait_metric(RELOADS % "failed", 2)
        assert len(digests(server)) == 2 and server.metric(RELOADS % "ok") == 1


def test_reload_under_load():
    with harness.Server(weights={"small.safetensors": ONE}) as server:
        headers, body = harness.points_body(CLOUD, weights="small")
        faults, stop = [], threading.Event()

        def work():
            with server.connect() as s:
                while not stop.is_set():
                    response = server.post(ESTIMATE, body, headers, connection=s)
                    if response.status != 200:
                        faults.append(response.text[:200])
        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads:
            thread.start()
        try:
            for turn in range(6):
                good, bad = turn // 2 + 1, (turn + 1) // 2
                server.put_weights("small.safetensors", (ONE, OTHER)[turn // 2 % 2] if turn % 2 == 0 else ONE[:100])
                server.signal(signal.SIGHUP)
                server.wait_metric(RELOADS % "ok", good)
                server.wait_metric(RELOADS % "failed", bad)
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        assert not faults, faults[0]


def test_requests_name_weights():
    with harness.Server(weights={"small.safetensors": ONE, "wide.safetensors": OTHER}) as server:
        for name in ("small", "wide"):
            headers, body = harness.points_body(SMOOTH, weights=name)
            head, _ = harness.parse_infer(server.post(ESTIMATE, body, headers))
            assert {k: head["parameters"][k] for k in ("estimator", "weights", "weights_sha256", "k")} == {
                "estimator": "gnp", "weights": name, "weights_sha256": digest(OTHER if name == "wide" else ONE), "k": 30}, head
            assert "degree" not in head["parameters"]
        for estimator in ("gmls", "adaptive"):  # need none
            headers, body = harness.points_body(SMOOTH, estimator=estimator, k=20)
            head, _ = harness.parse_infer(server.post(ESTIMATE, body, headers))
            assert head["parameters"]["estimator"] == estimator and head["parameters"]["k"] == 20, head
            assert "weights" not in head["parameters"] and "weights_sha256" not in head["parameters"]
        headers, body = harness.points_body(SMOOTH, weights="clean_99k")
        expect_error(server.post(ESTIMATE, body, headers), 400, "invalid_argument", 'weights: got "clean_99k", known: small, wide')
        expect_error(server.post("/v1/estimate?weights=clean_99k", harness.ply(SMOOTH)), 400, "invalid_argument",
                     'weights: got "clean_99k", known: small, wide')
        for bad in ("../../etc/passwd", "", "a b", "x" * 64, ".hidden"):
            headers, body = harness.points_body(SMOOTH, weights=bad)
            expect_error(server.post(ESTIMATE, body, headers), 400, "invalid_argument", "weights: got", "name of a model")


def used(server, **parameters):
    """Name, digest and k of the model that an estimate used; k is None for one without a patch size."""
    headers, body = harness.points_body(SMOOTH, **parameters)
    head, _ = harness.parse_infer(server.post(ESTIMATE, body, headers))
    assert head["parameters"]["estimator"] == "gnp", head
    return tuple(head["parameters"].get(k) for k in ("weights", "weights_sha256", "k"))


def test_the_default_estimator_names_its_weights():
    files = harness.small_weights()
    with harness.Server(weights=files) as server:
        every, clean, noise = (digest(files[name + ".safetensors"]) for name in ("any", "fit_clean_30k", "fit_noise_70k"))
        assert used(server) == used(server, weights="auto") == used(server, weights="any", k=31) == ("any", every, None)
        assert used(server, weights="fit_noise_70k") == used(server, weights="fit_noise_70k", k=31) == ("fit_noise_70k", noise, 70)
        names, _ = harness.parse_ply(server.post("/v1/estimate", harness.ply(SMOOTH)).body)
        assert "quality" in names
        comments = server.post("/v1/estimate", harness.ply(SMOOTH)).body.split(b"end_header")[0]
        assert b"comment weights_sha256 " + every.encode() in comments, comments
        other = harness.edge_weights(scale=0.02, k="40")
        server.put_weights("fit_clean_30k.safetensors", other)
        assert used(server, weights="fit_clean_30k") == ("fit_clean_30k", clean, 30)
        server.signal(signal.SIGHUP)
        server.wait_metric(RELOADS % "ok", 1)
        assert used(server, weights="fit_clean_30k") == ("fit_clean_30k", digest(other), 40)
        assert used(server) == ("any", every, None)


def test_the_default_judges_every_point():
    """Standard errors, outliers and creases come from the model for any cloud, and from no other."""
    doubts = {"normals_stderr": 1, "mean_curvature_stderr": 1, "principal_curvatures_stderr": 2, "outlier": 1, "crease": 1}
    with harness.Server() as server:
        headers, body = harness.points_body(SMOOTH, quantities=",".join(doubts))
        _, outputs = harness.parse_infer(server.post(ESTIMATE, body, headers))
        assert {name: len(outputs[name]) for name in doubts} == {name: 2000 * width for name, width in doubts.items()}
        assert all(x > 0 for x in outputs["normals_stderr"]) and set(outputs["crease"]) <= {0, 1}
        for name in doubts:
            headers, body = harness.points_body(SMOOTH, weights="fit_clean_30k", quantities=name)
            expect_error(server.post(ESTIMATE, body, headers), 400, "invalid_argument", name)


def test_weights_auto_needs_the_model_for_any_cloud():
    with harness.Server(weights={"fit_noise_70k.safetensors": harness.edge_weights(k="70", regime="noise")}) as server:
        headers, body = harness.points_body(SMOOTH)
        expect_error(server.post(ESTIMATE, body, headers), 400, "invalid_argument",
                     "weights: got auto, none of the 1 models is for any cloud (head weighted); name one of them")


def test_the_models_of_the_tree_know_a_sphere():
    """Each shipped file of the folder weights on a sphere of radius 2: H = -1/2."""
    folder = os.path.join(os.path.dirname(harness.__file__), "..", "..", "weights")
    files = {}
    for name in os.listdir(folder):
        if name.endswith(".safetensors"):
            with open(os.path.join(folder, name), "rb") as file:
                files[name] = file.read()
    assert files
    cloud = harness.sphere(4000, 2.0)
    with harness.Server(weights=files) as server:
        for name, content in sorted(files.items()):
            headers, body = harness.points_body(cloud, weights=name.split(".")[0], quantities="mean_curvature")
            head, outputs = harness.parse_infer(server.post(ESTIMATE, body, headers))
            assert head["parameters"]["weights_sha256"] == digest(content)
            worst = max(abs(2 * h + 1) for h in outputs["mean_curvature"])
            assert worst < 0.1, (name, worst)


def test_no_weights_are_no_fault_of_clients():
    """It was 400 invalid_argument, and without weights-dir nothing was said at the start."""
    with harness.Server(weights={}) as server:
        assert server.get("/v2/models/estimate").json["weights"] == []
        assert " warning: weights: got no *.safetensors in %s: " % server.weights_folder in server.log()
        assert server.get("/v2/models/estimate/ready").json == {"name": "estimate", "ready": True}
        headers, body = harness.points_body(CLOUD, weights="fit_clean_50k")
        expect_error(server.post(ESTIMATE, body, headers), 503, "unavailable", 'weights: got "fit_clean_50k", known: none are loaded')
        headers, body = harness.points_body(CLOUD)
        expect_error(server.post(ESTIMATE, body, headers), 503, "unavailable", "weights: none are loaded, the estimator gnp needs some; estimator=gmls")
        headers, body = harness.points_body(CLOUD, estimator="gmls")
        assert server.post(ESTIMATE, body, headers).status == 200
