# SPDX-License-Identifier: MIT
"""A real server with --events-url and a stand-in of a backend, which checks signatures as Standard Webhooks defines
them."""
import base64
import contextlib
import datetime
import hashlib
import hmac
import http.server
import json
import os
import pathlib
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from programs import Server, free_port, wait_until  # noqa: E402

SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]
KEY = os.urandom(32)
SECRET = "whsec_" + base64.b64encode(KEY).decode()


class Backend(http.server.ThreadingHTTPServer):
    """Keeps what it gets. `answers`: status of the first requests; later ones get 200. `certificate`: files of a
    certificate and its key, for TLS."""

    def __init__(self, answers=(), port=0, certificate=None):
        super().__init__(("127.0.0.1", port), Handler)
        self.answers, self.requests, self.problems = list(answers), [], []
        self.lock = threading.Lock()
        if certificate:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            self.socket = context.wrap_socket(self.socket, server_side=True)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def handle_error(self, request, address):
        pass  # such as a client that does not trust the certificate

    @property
    def port(self):
        return self.server_address[1]

    def close(self):
        self.shutdown()
        self.server_close()

    def events(self, kind=None, scene=None):
        """Accepted events, in the order of their arrival."""
        with self.lock:
            bodies = [r["body"] for r in self.requests if r["status"] == 200]
        return [b for b in bodies if kind in (None, b["type"]) and scene in (None, b["data"]["scene"])]


class Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def check(self, body):
        """Returns what is wrong with a request."""
        if self.headers["content-type"] != "application/json":
            return f"content-type: {self.headers['content-type']}"
        identity, timestamp = self.headers["webhook-id"], self.headers["webhook-timestamp"]
        if not identity or not re.fullmatch(r"\d+", timestamp) or abs(int(timestamp) - time.time()) > 60:
            return f"webhook-id {identity}, webhook-timestamp {timestamp}"
        mac = hmac.new(KEY, f"{identity}.{timestamp}.".encode() + body, hashlib.sha256).digest()
        if self.headers["webhook-signature"] != "v1," + base64.b64encode(mac).decode():
            return f"webhook-signature: {self.headers['webhook-signature']}"
        return None

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        backend = self.server
        with backend.lock:
            if problem := self.check(body):
                backend.problems.append(problem)
            status = backend.answers.pop(0) if backend.answers else 200
            backend.requests.append({"path": self.path, "id": self.headers["webhook-id"], "status": status,
                                     "body": json.loads(body)})
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()


@contextlib.contextmanager
def temporary_files():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        secret = folder / "events.secret"
        secret.write_text(SECRET + "\n")
        secret.chmod(0o600)
        yield folder, secret


@contextlib.contextmanager
def running_server(url, secret, *more, environment=None):
    options = ["--scene", "small", "--scene-file", ROOT / "tests/e2e/small.json", "--events-url", url, "--events-secret-file",
               secret, *more]
    with tempfile.TemporaryDirectory() as folder:
        with Server(SERVER, options, pathlib.Path(folder) / "log", {**os.environ, **(environment or {})}) as server:
            yield server


def join(server):
    subprocess.run([PROGRAM, "join", server.address, "--seconds", "1"], check=True, stdout=subprocess.DEVNULL)


class Events(unittest.TestCase):
    def test_joins_leaves_and_usage(self):
        with temporary_files() as (folder, secret):
            keys = folder / "keys"
            keys.mkdir()
            key, token = str(keys / "a.secret"), folder / "token"
            subprocess.run([SERVER, "token", "--new-key", key], check=True, stdout=subprocess.DEVNULL)
            token.write_text(subprocess.run(
                [SERVER, "token", "--key", key, "--role", "owner", "--subject", "ada", "--tenant", "acme"], check=True,
                capture_output=True, text=True).stdout)
            backend = Backend()
            with running_server(f"http://127.0.0.1:{backend.port}/in?x=1", secret, "--token-keys", str(keys),
                                "--hold", "1") as server:
                def clothstream(command, *more):
                    subprocess.run([PROGRAM, command, "--token", str(token), *more], check=True,
                                   stdout=subprocess.DEVNULL)

                clothstream("join", server.address, "--seconds", "2")
                wait_until(lambda: len(backend.events("participant.left")) == 1)
                joined, left = backend.events("participant.joined")[0], backend.events("participant.left")[0]
                self.assertEqual(joined["data"], {"server": socket.gethostname(), "scene": "small", "participant": 1,
                                                  "role": "owner", "subject": "ada", "tenant": ""})
                seconds = left["data"].pop("connectedSeconds")
                self.assertEqual(left["data"], joined["data"])
                self.assertTrue(1.5 < seconds < 30, seconds)
                for event in (joined, left):
                    self.assertTrue(event["timestamp"].endswith("Z"))
                    then = datetime.datetime.fromisoformat(event["timestamp"].replace("Z", "+00:00"))
                    age = datetime.datetime.now(datetime.timezone.utc) - then
                    self.assertTrue(0 <= age.total_seconds() < 60, event)

                # A client that is killed has its grace period.
                with subprocess.Popen([PROGRAM, "join", server.address, "--token", str(token), "--role", "viewer", "--seconds",
                                       "600"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as viewer:
                    wait_until(lambda: len(backend.events("participant.joined")) == 2)
                    viewer.kill()
                wait_until(lambda: len(backend.events("participant.left")) == 2)
                self.assertEqual(backend.events("participant.left")[1]["data"]["role"], "viewer")

                clothstream("create", "--server", server.address, "--named", "small", "--name", "mine")
                clothstream("join", server.address, "--scene", "mine", "--seconds", "2")
                clothstream("delete", "--server", server.address, "mine")
                wait_until(lambda: backend.events("scene.usage", "mine"))
                kinds = [e["type"] for e in backend.events(scene="mine")]
                self.assertEqual(kinds, ["participant.joined", "participant.left", "scene.usage"])
                for event in backend.events(scene="mine"):
                    self.assertEqual(event["data"]["tenant"], "acme")
                usage = backend.events("scene.usage", "mine")[0]["data"]
                self.assertEqual(set(usage), {"server", "scene", "tenant", "deviceSeconds", "sentBytes"})
                self.assertGreater(usage["deviceSeconds"], 0)
                self.assertGreater(usage["sentBytes"], 10_000)

                self.assertEqual(backend.events("scene.usage", "small"), [])  # not yet, after less than a minute
                server.end()
            # The end of the server reports the rest, and scenes that nobody used are left out.
            self.assertEqual([e["data"]["scene"] for e in backend.events("scene.usage")], ["mine", "small"])
            self.assertEqual(backend.problems, [])
            self.assertEqual({r["path"] for r in backend.requests}, {"/in?x=1"})
            self.assertEqual(len({r["id"] for r in backend.requests}), len(backend.requests))
            backend.close()

    def test_a_participant_at_the_end_leaves(self):
        with temporary_files() as (_, secret):
            backend = Backend()
            with running_server(f"http://127.0.0.1:{backend.port}/", secret) as server:
                with subprocess.Popen([PROGRAM, "join", server.address, "--no-reconnect"], stdout=subprocess.DEVNULL,
                                      stderr=subprocess.DEVNULL):
                    wait_until(lambda: backend.events("participant.joined"))
                    server.end()
            self.assertEqual([e["type"] for e in backend.events()],
                             ["participant.joined", "participant.left", "scene.usage"])
            backend.close()

    def test_a_participant_of_a_kept_scene_does_not_leave_at_the_end(self):
        with temporary_files() as (folder, secret):
            backend = Backend()
            state = ("--state-dir", str(folder / "state"), "--hold", "2")
            url = f"http://127.0.0.1:{backend.port}/"
            with running_server(url, secret, *state) as server:
                with subprocess.Popen([PROGRAM, "join", server.address, "--no-reconnect"], stdout=subprocess.DEVNULL,
                                      stderr=subprocess.DEVNULL):
                    wait_until(lambda: backend.events("participant.joined"))
                    server.end()
            self.assertEqual(backend.events("participant.left"), [])
            with running_server(url, secret, *state):
                wait_until(lambda: backend.events("participant.left"))  # its grace period ends in the next run
            self.assertEqual(len(backend.events("participant.joined")), 1)
            backend.close()

    def test_retries_keep_id_and_order(self):
        with temporary_files() as (_, secret):
            backend = Backend(answers=[500, 429, 400])
            with running_server(f"http://127.0.0.1:{backend.port}/", secret, "--metrics-port", "0") as server:
                join(server)
                wait_until(lambda: backend.events("participant.left"))
                self.assertEqual(len({r["id"] for r in backend.requests[:3]}), 1)
                self.assertEqual({json.dumps(r["body"]) for r in backend.requests[:3]},
                                 {json.dumps(backend.requests[0]["body"])})
                # The third answer refused the event, so it was dropped.
                self.assertEqual(backend.requests[0]["body"]["type"], "participant.joined")
                self.assertEqual(backend.events("participant.joined"), [])
                wait_until(lambda: "answers with status 400; the event is dropped" in server.said())
                metrics = server.wait_for(r"^metrics (\S+)")[1]
                with urllib.request.urlopen(metrics, timeout=10) as answer:
                    shown = answer.read().decode()
                for line in ('{result="delivered"} 1', '{result="retried"} 2', '{result="dropped"} 1'):
                    self.assertIn("clothstream_events_total" + line, shown)
            self.assertEqual(backend.problems, [])
            backend.close()

    def test_a_backend_that_starts_later_gets_all(self):
        with temporary_files() as (_, secret):
            port = free_port()
            with running_server(f"http://localhost:{port}/", secret) as server:
                join(server)
                join(server)
                wait_until(lambda: "trying again" in server.said())
                backend = Backend(port=port)
                wait_until(lambda: len(backend.events()) >= 4)
                self.assertEqual([(e["type"].split(".")[1], e["data"]["participant"]) for e in backend.events()],
                                 [("joined", 1), ("left", 1), ("joined", 2), ("left", 2)])
                server.end()
            self.assertEqual(backend.problems, [])
            backend.close()

    def test_a_backend_that_is_down_does_not_delay_the_end(self):
        with temporary_files() as (_, secret):
            with running_server(f"http://127.0.0.1:{free_port()}/", secret, "--drain", "6") as server:
                join(server)
                begin = time.monotonic()
                server.end()
                self.assertLess(time.monotonic() - begin, 6)
                self.assertIn("were not delivered before the end", server.said())

    def test_https_needs_a_trusted_certificate(self):
        with temporary_files() as (folder, secret):
            key, certificate = str(folder / "key.pem"), str(folder / "certificate.pem")
            made = subprocess.run(
                ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost",
                 "-addext", "subjectAltName=DNS:localhost", "-keyout", key, "-out", certificate], capture_output=True)
            self.assertEqual(made.returncode, 0, made.stderr)
            backend = Backend(certificate=(certificate, key))
            url = f"https://localhost:{backend.port}/in"
            trust = {"SSL_CERT_FILE": certificate}
            with running_server(url, secret, environment=trust) as server:
                join(server)
                wait_until(lambda: backend.events("participant.left"))
            self.assertEqual(backend.problems, [])
            before = len(backend.requests)
            for wrong in (url, url.replace("localhost", "127.0.0.1")):  # an unknown authority; another name
                with running_server(wrong, secret, environment={} if wrong == url else trust) as server:
                    join(server)
                    wait_until(lambda: "TLS: certificate verify failed" in server.said())
            self.assertEqual(len(backend.requests), before)
            backend.close()

    def test_wrong_options_are_explained(self):
        def refused(*options):
            ended = subprocess.run([SERVER, *options], capture_output=True, text=True, timeout=60)
            self.assertEqual(ended.returncode, 1, ended.stdout)
            return ended.stderr

        with temporary_files() as (folder, secret):
            good = ("--events-url", "http://127.0.0.1:9/")
            self.assertIn("--events-url needs a secret that signs the events: add --events-secret-file FILE",
                          refused(*good))
            self.assertIn("--events-secret-file has no effect without --events-url",
                          refused("--events-secret-file", str(secret)))
            self.assertIn("--events-url: 'ftp://x/' begins with neither http:// nor https://; use http://HOST:PORT/",
                          refused("--events-url", "ftp://x/", "--events-secret-file", str(secret)))
            self.assertIn("none.secret cannot be read: No such file or directory",
                          refused(*good, "--events-secret-file", str(folder / "none.secret")))
            for text, problem in (("", "is empty"), ("x", "does not begin with whsec_"),
                                  ("whsec_x", "has no base64 after whsec_"), ("whsec_AAAA", "has a key of 3 bytes")):
                secret.write_text(text)
                error = refused(*good, "--events-secret-file", str(secret))
                self.assertIn(f"--events-secret-file: {secret} {problem}; use whsec_ and the base64 of 24 to 64", error)


if __name__ == "__main__":
    unittest.main(verbosity=2)
