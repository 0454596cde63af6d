"""Keys and certificates for the tests, made afresh each time: nothing secret is kept."""
import contextlib
import hashlib
import os
import secrets
import shutil
import ssl
import subprocess
import tempfile


class Folder:
    """Files that only this user reads, gone at the end."""

    def __enter__(self):
        self.path = tempfile.mkdtemp(prefix="gnpd-secret.")
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)

    def name(self, name):
        return os.path.join(self.path, name)

    def put(self, name, content, mode=0o600):
        """As an editor does: beside, then renamed. The path."""
        beside = self.name(name + ".new")
        with open(beside, "w") as file:
            file.write(content)
        os.chmod(beside, mode)
        os.rename(beside, self.name(name))
        return self.name(name)

    def read(self, name):
        with open(self.name(name)) as file:
            return file.read()


def new_key():
    return "gnpd_" + secrets.token_hex(32)


def hash_of(key):
    return "sha256:" + hashlib.sha256(key.encode()).hexdigest()


def line(name, key, scopes, limits=""):
    return "%s %s %s %s\n" % (name, hash_of(key), scopes, limits)


def bearer(key):
    return {"Authorization": "Bearer " + key}


def certificate(folder, name, subject="localhost"):
    """Paths of a self-signed certificate and its key."""
    pem, key = folder.name(name + ".pem"), folder.name(name + ".key")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", key,
                    "-out", pem, "-days", "30", "-subj", "/CN=" + subject, "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.chmod(key, 0o600)
    return pem, key


AUTHORITY = """[ca]
default_ca = any
[any]
database = {0}/index
new_certs_dir = {0}
default_md = sha256
serial = {0}/serial
policy = all
[all]
commonName = supplied
"""


def certificate_between(folder, name, begin, end):
    """The same, valid between two times (YYYYMMDDhhmmssZ), which `openssl req` cannot say."""
    _, key = certificate(folder, name)
    pem, request = folder.name(name + ".pem"), folder.name(name + ".request")
    folder.put("index", "")
    for command in (["req", "-new", "-key", key, "-out", request, "-subj", "/CN=localhost"],
                    ["ca", "-config", folder.put("authority", AUTHORITY.format(folder.path)), "-batch", "-notext", "-selfsign", "-create_serial",
                     "-keyfile", key, "-in", request, "-out", pem, "-startdate", begin, "-enddate", end]):
        subprocess.run(["openssl", *command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return pem, key


def connect(server, *authorities, versions=None):
    """A TLS connection that trusts the authorities' certificates and no others."""
    context = ssl.create_default_context()
    for path in authorities:
        context.load_verify_locations(path)
    if versions:
        context.minimum_version, context.maximum_version = versions
    plain = server.connect()
    try:
        return context.wrap_socket(plain, server_hostname="localhost")
    except Exception:
        plain.close()
        raise


@contextlib.contextmanager
def admin_port(flags):
    """Adds flags for an admin listener; yields a function that tells its port once there is one."""
    with Folder() as folder:
        path = folder.name("admin-port")
        flags.update(admin_listen="127.0.0.1:0", admin_port_file=path)
        yield lambda: int(folder.read("admin-port"))
