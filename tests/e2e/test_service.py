"""The daemon under a service manager: what it hears, the sockets it hands over, and which build it runs."""
import os
import resource
import shutil
import signal
import socket
import subprocess
import time

import credentials
import harness
from harness import SLOW



class Manager:
    """Hears what a daemon says."""

    def __init__(self, address):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address)
        self.heard = []

    def close(self):
        self.socket.close()

    def wait(self, text, seconds=5):
        """The first message with a line that begins with text, of those not heard before."""
        until = time.monotonic() + seconds * SLOW
        while True:
            self.socket.settimeout(max(0.01, until - time.monotonic()))
            try:
                message = self.socket.recv(4096).decode()
            except socket.timeout:
                raise AssertionError("%s was not said, only %s" % (text, self.heard))
            self.heard.append(message)
            lines = message.splitlines()
            if any(line.startswith(text) for line in lines):
                return dict(line.split("=", 1) for line in lines)


def said(address, shown):
    manager = Manager(address)
    try:
        with harness.Server(environment={"NOTIFY_SOCKET": shown, "WATCHDOG_USEC": "200000"}) as server:
            assert "STATUS" in manager.wait("READY=1")
            signs = [time.monotonic() for _ in range(5) if manager.wait("WATCHDOG=1")]
            assert signs[4] - signs[0] < 1 * SLOW, "signs of life are slower than they must be: %s" % signs
            assert manager.wait("STATUS=")["STATUS"] == "ready: 0 running, 0 waiting"
            before = time.clock_gettime(time.CLOCK_MONOTONIC)
            server.signal(signal.SIGHUP)
            reloading = manager.wait("RELOADING=1")
            assert before - 0.001 <= int(reloading["MONOTONIC_USEC"]) / 1e6 <= time.clock_gettime(time.CLOCK_MONOTONIC)
            manager.wait("READY=1")
            server.signal()
            assert int(manager.wait("STOPPING=1")["EXTEND_TIMEOUT_USEC"]) >= 30_000_000
            assert server.wait(5) == 0
    finally:
        manager.close()


def test_service_manager_hears():
    with credentials.Folder() as folder:
        path = folder.name("notify")
        said(path, path)


def test_service_manager_of_an_abstract_name():
    name = "gnpd-test-%d" % os.getpid()
    said("\0" + name, "@" + name)


def test_nobody_hears():
    """A manager that is gone or never was does not keep the daemon from its work."""
    with harness.Server(environment={"NOTIFY_SOCKET": "/nonexistent/notify", "WATCHDOG_USEC": "100000"}) as server:
        time.sleep(0.2)
        assert server.get("/v2/health/ready").status == 200
    done = subprocess.run([harness.BINARY], env={"PATH": "/usr/bin", "NOTIFY_SOCKET": "relative", "GNPD_LISTEN": "127.0.0.1:0"},
                          stderr=subprocess.PIPE, text=True, timeout=20 * SLOW)
    assert done.returncode == 1 and "NOTIFY_SOCKET: got \"relative\", need a path or @name" in done.stderr, done.stderr


def listener(family=socket.AF_INET, address=("127.0.0.1", 0)):
    s = socket.socket(family, socket.SOCK_STREAM)
    s.bind(address)
    s.listen(16)
    return s


def inherit(sockets, names, **flags):
    """A daemon that gets the sockets as descriptors 3, 4, ..."""
    moves = " ".join("%d<&%d" % (3 + i, 20 + i) for i in range(len(sockets)))
    for i, s in enumerate(sockets):
        os.dup2(s.fileno(), 20 + i, inheritable=True)
    wrap = ["bash", "-c", "exec %s; LISTEN_PID=$$ exec \"$@\"" % moves, "bash"]
    environment = {"LISTEN_FDS": str(len(sockets)), "LISTEN_FDNAMES": names}
    try:
        return harness.Server(wrap=wrap, environment=environment, pass_fds=[20 + i for i in range(len(sockets))], **flags)
    finally:
        for i in range(len(sockets)):
            os.close(20 + i)


def ask(address, path, family=socket.AF_INET):
    with socket.socket(family, socket.SOCK_STREAM) as s:
        s.settimeout(20 * SLOW)
        s.connect(address)
        s.sendall(harness.make_request("GET", path))
        return harness.read_response(s)


def test_sockets_are_handed_over():
    main, admin = listener(), listener()
    with inherit([admin, main], "admin:gnpd") as server:
        assert server.port == main.getsockname()[1]
        assert server.get("/v2").status == 200
        assert ask(admin.getsockname(), "/admin/config").status == 200
        assert ask(main.getsockname(), "/admin/config").status == 404
        main.close()
        admin.close()


def test_local_socket_is_handed_over():
    with credentials.Folder() as folder:
        path = folder.name("socket")
        with listener(socket.AF_UNIX, path) as main, inherit([main], "gnpd"):
            assert ask(path, "/v2", socket.AF_UNIX).status == 200


def test_sockets_that_cannot_be_used():
    def fault(sockets, names, *flags):
        try:
            with inherit(sockets, names):
                return ""
        except AssertionError as text:
            return str(text)
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    bound.bind(("127.0.0.1", 0))
    datagram = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with listener() as one, listener() as other, listener(address=("0.0.0.0", 0)) as everywhere:
        assert "got two sockets for the main listener, need at most 1" in fault([one, other], "a:b")
        assert "got two sockets for the admin listener" in fault([one, other], "admin:admin")
        assert "not a listening stream socket" in fault([bound], "a")
        assert "not a listening stream socket" in fault([datagram], "a")
        assert "need a loopback address" in fault([everywhere], "a")
    bound.close()
    datagram.close()


def test_sockets_meant_for_others():
    with harness.Server(environment={"LISTEN_PID": "1", "LISTEN_FDS": "1"}) as server:
        assert server.get("/v2").status == 200


def test_build_is_told(server):
    text = subprocess.run([harness.BINARY, "--version"], stdout=subprocess.PIPE, text=True, timeout=20 * SLOW).stdout
    version = text.split()[1]
    build = text.split("(")[1].rstrip(")\n") if "(" in text else ""
    assert server.get("/v2").json["version"] == version + ("+" + build if build else "")
    assert "gnpd_build_info{version=\"%s\",build=\"%s\"} 1\n" % (version, build) in server.get("/metrics").text


def gnpd(*flags, **arguments):
    """A run that ends by itself."""
    return subprocess.run([harness.BINARY, *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=20 * SLOW, **arguments)


def test_check_and_print_of_the_configuration():
    """Of --check-config and --print-config the last won."""
    both = gnpd("--check-config", "--print-config", "--queue-count", "7")
    assert both.returncode == 0 and both.stdout.startswith("# the configuration is good\nlisten = ") and "\nqueue-count = 7\n" in both.stdout, both
    with credentials.Folder() as folder:
        assert gnpd("--print-config", "--config", folder.put("conf", both.stdout)).stdout == both.stdout.split("\n", 1)[1]
        keys = folder.put("keys", "nonsense\n")
        bad = gnpd("--print-config", "--check-config", "--keys-file", keys)
        assert bad.returncode == 1 and bad.stdout == "" and "keys-file: " in bad.stderr, bad
        nowhere = gnpd("--check-config", "--port-file", folder.name("none/port"))
        assert nowhere.returncode == 1 and "port-file: %s: its folder cannot be written to" % folder.name("none/port") in nowhere.stderr, nowhere
    assert gnpd("--make-key").stderr == "gnpd: --make-key: need a name and nothing else: gnpd --make-key NAME\n"


def test_want_of_weights_is_warned_of():
    """A start in a folder without ./weights, and a check, said nothing of it."""
    with credentials.Folder() as folder:
        done = gnpd("--check-config", cwd=folder.path)
        assert done.returncode == 0 and done.stdout == "the configuration is good\n", done
        assert " warning: weights: got no *.safetensors in ../share/gnpd/weights beside the program and in ./weights of %s " % folder.path in done.stderr, done
        done = gnpd("--check-config", "--weights-dir", folder.path)
        assert " warning: weights: got no *.safetensors in %s: the estimator gnp, the default, answers 503" % folder.path in done.stderr, done


def test_certificates_out_of_their_time_are_warned_of():
    with credentials.Folder() as folder:
        old = credentials.certificate_between(folder, "old", "20200101000000Z", "20210203040506Z")
        new = credentials.certificate_between(folder, "new", "20980101000000Z", "20990101000000Z")
        for pair, text in ((old, "expired at 2021-02-03T04:05:06Z"), (new, "is not valid before 2098-01-01T00:00:00Z")):
            done = gnpd("--check-config", "--tls-certificate", pair[0], "--tls-key", pair[1])
            assert done.returncode == 0 and " warning: tls-certificate: %s: %s, clients will refuse it\n" % (pair[0], text) in done.stderr, done
        with harness.Server(environment={"GNPD_TLS_CERTIFICATE": old[0], "GNPD_TLS_KEY": old[1]}) as server:
            assert server.log().count(": expired at 2021-02-03T04:05:06Z") == 1
            server.signal(signal.SIGHUP)
            harness.eventually(lambda: server.log().count(": expired at 2021-02-03T04:05:06Z") == 2)
        good = credentials.certificate(folder, "good")
        assert "tls-certificate" not in gnpd("--check-config", "--tls-certificate", good[0], "--tls-key", good[1]).stderr


def test_files_of_threads_are_counted():
    """64 threads at sockets take 192 files; 64 were counted for all that are no connections."""
    def limited(most, *flags):
        return gnpd("--check-config", "--max-connections", "100", "--admin-connections", "10", "--job-runners", "2", *flags,
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (most, most)))
    done = limited(300, "--http-threads", "64")
    assert done.returncode == 1 and "open files: the process may have 300 (ulimit -n), need 371: 110 for connections" in done.stderr, done
    for most, threads in ((371, "64"), (300, "2")):
        assert limited(most, "--http-threads", threads).returncode == 0, (most, threads)
    limits = {resource.RLIMIT_NOFILE: (371, 371)}
    with harness.Server(limits=limits, max_connections=100, admin_connections=10, http_threads=64, admin_listen="127.0.0.1:0") as server:
        others = len(os.listdir("/proc/%d/fd" % server.process.pid))
        assert 3 * 64 < others <= 371 - 110, others


def test_units_and_configuration_that_are_shipped():
    """The configuration is read by the daemon; the units by systemd, where it is installed."""
    here = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "deploy")
    with open(os.path.join(here, "gnpd.conf")) as file, credentials.Folder() as folder:
        shipped = file.read()
        assert "\njobs-dir = /var/lib/gnpd/jobs\n" in shipped, "the unit makes this one"
        for place, code in ((folder.path, 0), (folder.name("missing"), 1)):
            here_too = folder.put("here.conf", shipped.replace("/var/lib/gnpd/jobs", place))
            done = subprocess.run([harness.BINARY, "--config", here_too, "--check-config"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                  text=True, timeout=20 * SLOW)
            assert done.returncode == code and ("jobs-dir: " + place in done.stderr) == (code != 0), done
        beyond = folder.put("beyond.conf", shipped.replace("/var/lib/gnpd/jobs", folder.path).replace("\nlisten = ", "\n#").replace("#listen", "listen").replace("#keys-file", "keys-file"))
        done = subprocess.run([harness.BINARY, "--config", beyond, "--check-config"], stderr=subprocess.PIPE, text=True, timeout=20 * SLOW)
        assert "keys-file: /etc/gnpd/keys: " in done.stderr, done.stderr
        with open(os.path.join(here, "gnpd.service")) as file:
            unit = file.read()
        assert "Type=notify\n" in unit and unit.count("@PREFIX@/bin/gnpd") == 2
        if not shutil.which("systemd-analyze"):
            return
        os.mkdir(folder.name("bin"))
        os.symlink(harness.BINARY, folder.name("bin/gnpd"))
        paths = [folder.put("gnpd.service", unit.replace("@PREFIX@", folder.path).replace("User=gnpd", "User=root").replace("Group=gnpd", "Group=root")),
                 folder.put("gnpd.socket", open(os.path.join(here, "gnpd.socket")).read())]
        done = subprocess.run(["systemd-analyze", "verify", "--man=no", *paths], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=60 * SLOW)
        assert done.returncode == 0 and "gnpd" not in done.stdout, done.stdout
