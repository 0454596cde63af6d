#!/usr/bin/env python3
"""kill_audit.py [KILLS [SEED]]: kills the daemon named by $GNPD (default build/gnpd) so many times (default 100) at random instants under
load, then audits that every acknowledged job is there and ended with the right result or a stated reason. Exit status 1 when not."""
import json
import os
import shutil
import sys
import tempfile
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "e2e"))
import audit


def main():
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int(time.time())
    path = tempfile.mkdtemp(prefix="gnpd-kill-audit.")
    print("seed %d, jobs in %s" % (seed, path))
    report = audit.run(path, kills, 1.5, seed, lambda report, known: print("%d kills, %d jobs acknowledged" % (
        report["kills"], len(known["jobs"])), flush=True))
    print(json.dumps(report, indent=1))
    if report["lost"] or report["wrong"]:
        return 1
    shutil.rmtree(path)
    return 0


sys.exit(main())
