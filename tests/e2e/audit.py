"""Kills a daemon again and again while clients submit jobs, and audits: every job that was acknowledged is there afterwards, ends with
the right result or with a reason, and is no second one to who asks again. tests/soak/kill_audit.py runs it for as long as one likes."""
import random
import threading
import time

import harness
from test_jobs import FINAL, without_seconds

CLOUDS = [harness.ply(harness.sphere(count)) for count in (300, 700, 1500)]
CALLS = ["estimate?estimator=gmls", "filter?estimator=adaptive", "flow?estimator=gmls&steps=12", "flow?estimator=gmls&steps=25&snapshot_every=5"]
FLAGS = {"jobs_checkpoint_seconds": 0, "jobs_attempts": 1000, "job_runners": 2, "access_log": "false", "jobs_queue_count": 100000,
         "jobs_count": 100000}


def clean(data):
    """An answer without its seconds: PLY's comments name them, and the record of a flow is left out of PLY."""
    return without_seconds(data)


def reference():
    with harness.Server() as server:
        return {(call, i): clean(server.post("/v1/" + call, cloud).body) for call in CALLS for i, cloud in enumerate(CLOUDS)}


class Load:
    """Clients that submit, and sometimes cancel, until they are told to stop or the daemon is gone."""

    def __init__(self, server, known, number, chance):
        self.server, self.known, self.number, self.chance, self.over = server, known, number, chance, False
        self.threads = [threading.Thread(target=self.submit, args=(random.Random(chance.random()), i)) for i in range(3)]
        for thread in self.threads:
            thread.start()

    def submit(self, chance, client):
        sent = 0
        while not self.over:
            call, i = chance.choice(CALLS), chance.randrange(len(CLOUDS))
            key = "%d-%d-%d" % (self.number, client, sent)
            sent += 1
            self.known["asked"][key] = (call, i, None)
            try:
                response = self.server.post("/v1/jobs/" + call, CLOUDS[i], {"Idempotency-Key": key})
                if response.status == 202:
                    self.known["jobs"][response.json["id"]] = (call, i)
                    self.known["asked"][key] = (call, i, response.json["id"])
                    if chance.random() < 0.1:
                        self.known["cancelled"].add(response.json["id"])
                        self.server.request("DELETE", "/v1/jobs/" + response.json["id"])
            except (OSError, ConnectionError, ValueError):
                return  # killed
            time.sleep(chance.random() * 0.05)

    def stop(self):
        self.over = True
        for thread in self.threads:
            thread.join()


def settle(server, known, wanted, report, patience):
    """Waits for the end of every job and compares."""
    until = time.monotonic() + patience * harness.SLOW
    for job, which in known["jobs"].items():
        while True:
            response = server.get("/v1/jobs/%s?wait=5s" % job)
            if response.status != 200 or response.json["state"] in FINAL:
                break
            assert time.monotonic() < until, response.text
        if response.status != 200:
            if job not in known["cancelled"]:
                report["lost"].append(job)
            continue
        record = response.json
        report["ends"][record["state"]] = report["ends"].get(record["state"], 0) + 1
        if record["state"] == "succeeded":
            if clean(server.get(record["result"]["href"]).body) != wanted[which]:
                report["wrong"].append((job, which))
        elif record["state"] == "failed" and not record["error"]["text"]:
            report["wrong"].append((job, record))
        elif record["state"] == "cancelled" and job not in known["cancelled"]:
            report["wrong"].append((job, record))


def ask_again(server, known, report, most=40):
    """Whoever got no answer asks again with the same key, and whoever got one gets the same: no job is made twice."""
    for key, (call, i, job) in list(known["asked"].items())[-most:]:
        response = server.post("/v1/jobs/" + call, CLOUDS[i], {"Idempotency-Key": key})
        if response.status not in (200, 202):
            report["wrong"].append((key, response.text))
        elif job and job not in known["cancelled"] and (response.status, response.json["id"]) != (200, job):
            report["wrong"].append((key, job, response.text))
        else:
            known["jobs"][response.json["id"]] = (call, i)


def run(path, kills, seconds, seed, progress=None):
    """seconds: most between two kills. Returns what was found."""
    chance = random.Random(seed)
    wanted = reference()
    known = {"jobs": {}, "asked": {}, "cancelled": set()}
    report = {"seed": seed, "kills": 0, "acknowledged": 0, "lost": [], "wrong": [], "ends": {}}
    for number in range(kills):
        server = harness.Server(jobs_dir=path, **FLAGS)
        load = Load(server, known, number, chance)
        time.sleep(chance.random() * seconds)
        server.process.kill()
        server.process.wait()
        load.stop()
        server.kill()
        report["kills"] += 1
        if progress:
            progress(report, known)
    with harness.Server(jobs_dir=path, **FLAGS) as server:
        ask_again(server, known, report)
        settle(server, known, wanted, report, 30 + 2 * len(known["jobs"]))
        report["damaged"] = server.metric("gnpd_jobs_damaged_total")
        report["resumed"] = server.metric("gnpd_jobs_resumed_total")
    if report["damaged"]:
        report["wrong"].append("damaged records")
    report["acknowledged"] = len(known["jobs"])
    return report
