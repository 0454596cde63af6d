"""The metrics as Prometheus reads them: by a strict reader of our own, and by promtool where it is installed (Debian's package with it
takes 96 MB, so nothing here installs it)."""
import os
import re
import shutil
import subprocess

import credentials
import exposition
import harness
from credentials import bearer
from harness import SLOW

ESTIMATE = "/v2/models/estimate/infer"


DOCUMENTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "server")


def document(name):
    with open(os.path.join(DOCUMENTS, name)) as file:
        return file.read()


def rows(text):
    """The cells of a document's tables, of rows that begin with something in code."""
    found = [[cell.strip() for cell in line[1:-1].split("|")] for line in text.splitlines() if line.startswith("| `")]
    return {cells[0].strip("`"): cells[1:] for cells in found}


def check(text):
    promtool = shutil.which("promtool")
    if promtool:
        done = subprocess.run([promtool, "check", "metrics"], input=text, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=20 * SLOW)
        assert done.returncode == 0, done.stdout
    return exposition.parse(text)


def test_metrics_of_a_daemon_with_everything():
    boss = credentials.new_key()
    with credentials.Folder() as folder:
        keys = folder.put("keys", credentials.line("boss", boss, "admin,infer", "rate=100/s") + credentials.line("b-2.x", credentials.new_key(), "jobs"))
        with harness.Server(keys_file=keys) as server:
            headers, body = harness.points_body(harness.sphere(600))
            assert server.post(ESTIMATE, body, dict(headers, **bearer(boss))).status == 200
            server.get("/nothing")
            server.post(ESTIMATE, b"x", bearer(boss))
            families = check(server.get("/metrics", headers=bearer(boss)).text)
    for name in ("requests_total", "request_duration_seconds", "rejected_total", "cancelled_total", "stage_seconds_total", "limit", "build_info",
                 "keys_reloads_total", "principal_requests_total", "principal_active_requests", "queue_requests", "connections"):
        assert "gnpd_" + name in families, name
    principals = {labels["principal"] for _, labels, _ in families["gnpd_principal_requests_total"].samples}
    assert principals == {"boss", "b-2.x"}


def test_every_metric_is_in_the_document():
    """Its type, its labels and, where they are listed, their values; and nothing is there that is not exposed."""
    text = document("METRICS.md")
    with credentials.Folder() as folder:
        pem, key = credentials.certificate(folder, "server")
        keys = folder.put("keys", credentials.line("boss", credentials.new_key(), "admin"))
        with harness.Server(keys_file=keys, tls_certificate=pem, tls_key=key, admin_listen="127.0.0.1:0", admin_port_file=folder.name("port")) as server:
            server.port = int(folder.read("port"))
            families = check(server.get("/metrics").text)
    described = {name: cells for name, cells in rows(text).items() if name.startswith("gnpd_")}
    assert set(described) == set(families), set(described) ^ set(families)
    for name, (kind, labels, _, _) in described.items():
        family = families[name]
        assert kind == family.type, name
        exposed = {}
        for _, pairs, _ in family.samples:
            for label, value in pairs.items():
                exposed.setdefault(label, set()).add(value)
        exposed.pop("le", None)
        listed = dict(re.findall(r"`(\w+)`(?:: ([^`]*?))?(?:, (?=`)|$)", labels))
        assert set(listed) == set(exposed), (name, listed, exposed)
        for label, values in listed.items():
            assert not values or set(values.split(", ")) == exposed[label], (name, label, values, exposed[label])
    reasons = {labels["reason"] for _, labels, _ in families["gnpd_rejected_total"].samples}
    section = text.split("## Reasons of", 1)[1].split("\n## ", 1)[0]
    assert set(rows(section)) == reasons, set(rows(section)) ^ reasons
    known = set(families) | {name + suffix for name, family in families.items() if family.type == "histogram" for suffix in ("_bucket", "_sum", "_count")}
    assert set(re.findall(r"\bgnpd_[a-z_]*[a-z]", text)) <= known, "queries name what is not there"


def test_every_key_is_in_the_document():
    """With its default and its range, which the error of a value out of it gives."""
    described = rows(document("CONFIGURATION.md"))

    def run(*flags):
        return subprocess.run([harness.BINARY, *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=20 * SLOW)
    defaults = dict(re.findall(r"^  --(\S+) .*\[(.*)\]$", run("--help").stdout, re.M))
    keys = [line.split(" = ")[0] for line in run("--print-config").stdout.splitlines()]
    assert list(defaults) == keys and set(described) == set(keys), set(described) ^ set(keys)
    for key in keys:
        default, limits, meaning = described[key]
        assert default.strip("`") == (defaults[key] or "none") and meaning, (key, default)
        fault = run("--print-config", "--" + key, "?").stderr
        needed = re.search(r"\?\", need (\S+\.\.[^:\s]+|[a-z, ]+)(?::|$)", fault, re.M)
        want = re.sub(r" or ", ", ", needed.group(1)) if needed else None
        assert limits in ("a path", "a folder", "ADDRESS:PORT", "names, separated by commas") if want is None else limits == want, (key, limits, want)


def test_every_limit_is_a_metric():
    with harness.Server() as server:
        limits = {labels["key"] for _, labels, _ in check(server.get("/metrics").text)["gnpd_limit"].samples}
        text = subprocess.run([harness.BINARY, "--print-config"], stdout=subprocess.PIPE, text=True, timeout=20 * SLOW).stdout
        pairs = dict(line.split(" = ", 1) for line in text.splitlines())
        numeric = {key for key, value in pairs.items() if value.replace(".", "", 1).isdigit()}
        numeric.add("operator-cache-bytes")  # prepared-cache-bytes by its old name, for one version
        assert limits == numeric, limits ^ numeric
        help_text = subprocess.run([harness.BINARY, "--help"], stdout=subprocess.PIPE, text=True, timeout=20 * SLOW).stdout
        assert all("--%s " % key in help_text for key in pairs)


def test_clients_add_no_series(server):
    def series():
        return {(name, tuple(labels.items())) for family in check(server.get("/metrics").text).values() for name, labels, _ in family.samples}
    before = series()
    for path in ("/one", "/v1/two", "/v2/models/three", "/v2?four=4", "/%22%0a"):
        server.get(path)
        server.request("BREW", path)
    assert series() == before


def test_the_reader_is_strict():
    good = "# HELP gnpd_a_total A.\n# TYPE gnpd_a_total counter\ngnpd_a_total{x=\"1\"} 1\n"
    exposition.parse(good)
    for bad in (good[:-1], good + good, good + "gnpd_a_total{x=\"1\"} 2\n", good + "gnpd_b 1\n", good.replace("counter", "gauge"), good.replace("x=\"1\"", "x=1"),
                good.replace(" 1\n", " one\n"), good.replace("gnpd_a", "a"), good.replace("_total", ""), good.replace("# TYPE", "# KIND"),
                good.replace(" A.", " "), good + "gnpd_a_total{y=\"1\"} 2\n", good.replace("_a_", "_milliseconds_"), good.replace("} 1", "} -1")):
        try:
            exposition.parse(bad)
        except (AssertionError, ValueError):
            continue
        raise AssertionError("accepted: " + bad)
