# SPDX-License-Identifier: MIT
"""The files of deploy/monitoring with a real Prometheus, which reads a server that clients use."""
import contextlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
MONITORING = ROOT / "deploy" / "monitoring"
sys.path[:0] = [str(MONITORING), str(ROOT / "tests/support")]
import make_dashboard  # noqa: E402
from programs import Program, Server, free_port  # noqa: E402

SERVER, PROGRAM = os.environ["CLOTHSTREAM_SERVER"], os.environ["CLOTHSTREAM_PROGRAM"]
# Counters of what does not happen to a healthy server under this load. Their queries have no series.
WITHOUT_SERIES = set()


def tool(name):
    path = shutil.which(name)
    if path is None:
        raise unittest.SkipTest(f"{name} is not installed: ./dev test installs Debian's package prometheus")
    return path


def queries():
    """Each query of the dashboard and of the alerts, with a name."""
    for row, panels in make_dashboard.ROWS:
        for title, _, expressions in panels:
            for expression, _ in expressions:
                for name, value in {"$instance": ".*", "$scene": ".*", "$__rate_interval": "5s"}.items():
                    expression = expression.replace(name, value)
                yield f"{row}: {title}", expression


class Prometheus:
    def __init__(self, port):
        self.base = f"http://127.0.0.1:{port}/api/v1/"

    def get(self, path, **arguments):
        with urllib.request.urlopen(self.base + path + "?" + urllib.parse.urlencode(arguments), timeout=10) as answer:
            return json.load(answer)["data"]

    def value(self, expression):
        return self.get("query", query=expression)["result"]

    def wait_for(self, expression, seconds=60):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            with contextlib.suppress(urllib.error.URLError, ConnectionError):
                if self.value(expression):
                    return
            time.sleep(0.1)
        raise AssertionError(f"after {seconds} s there is no {expression}")


class Files(unittest.TestCase):
    def test_dashboard_is_what_its_program_writes(self):
        self.assertEqual(json.loads((MONITORING / "dashboard.json").read_text()), make_dashboard.dashboard(),
                         "run deploy/monitoring/make_dashboard.py")

    def test_panels_do_not_overlap(self):
        places = [(panel["gridPos"], panel["title"]) for panel in make_dashboard.dashboard()["panels"]]
        for i, (a, title) in enumerate(places):
            self.assertLessEqual(a["x"] + a["w"], 24, title)
            for b, other in places[:i]:
                apart = (a["x"] >= b["x"] + b["w"] or b["x"] >= a["x"] + a["w"] or a["y"] >= b["y"] + b["h"]
                         or b["y"] >= a["y"] + a["h"])
                self.assertTrue(apart, f"{title} and {other}")

    def test_rules_and_their_tests_pass(self):
        for command in (["check", "config", "prometheus.yml"], ["test", "rules", "alerts_test.yml"]):
            done = subprocess.run([tool("promtool"), *command], cwd=MONITORING, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_every_alert_has_a_test_and_a_section_of_the_handbook(self):
        alerts = re.findall(r"alert: (\w+)", (MONITORING / "alerts.yml").read_text())
        tested = (MONITORING / "alerts_test.yml").read_text()
        handbook = (ROOT / "docs" / "operations.md").read_text()
        self.assertGreater(len(alerts), 5)
        for alert in alerts:
            self.assertIn(alert, tested)
            self.assertIn(f"`{alert}`", handbook)


class WithAServer(unittest.TestCase):
    def test_every_query_has_an_answer(self):
        program = tool("prometheus")
        with contextlib.ExitStack() as stack:
            folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
            options = ["--metrics-port", 0, "--scene", "small", "--scene-file", ROOT / "tests/e2e/small.json"]
            server = stack.enter_context(Server(SERVER, options, folder / "server.log"))
            metrics = server.wait_for(r"^metrics +http://([^/\s]+)/")[1]
            shutil.copy(MONITORING / "alerts.yml", folder)
            config = (MONITORING / "prometheus.yml").read_text()
            for before, now in {"127.0.0.1:9464": metrics, "scrape_interval: 5s": "scrape_interval: 500ms",
                                "evaluation_interval: 15s": "evaluation_interval: 1s"}.items():
                self.assertIn(before, config)
                config = config.replace(before, now)
            (folder / "prometheus.yml").write_text(config)
            port = free_port()
            command = [program, f"--config.file={folder}/prometheus.yml", f"--storage.tsdb.path={folder}/data",
                       f"--web.listen-address=127.0.0.1:{port}"]
            stack.enter_context(Program("prometheus", command, folder / "prometheus.log"))
            load = [PROGRAM, "load", "--web", server.url.split("/")[2], "--participants", 2, "--seconds", 600]
            stack.enter_context(Program("the load", load, folder / "load.log"))
            prometheus = Prometheus(port)
            prometheus.wait_for("sum(rate(clothstream_scene_input_to_packet_seconds_count[5s])) > 0")
            for name, expression in queries():
                result = prometheus.value(expression)
                if not any(metric in expression for metric in WITHOUT_SERIES):
                    self.assertTrue(result, f"{name}: no series for {expression}")
            rules = [rule for group in prometheus.get("rules")["groups"] for rule in group["rules"]]
            self.assertGreater(len(rules), 5)
            for rule in rules:
                self.assertIn(rule["health"], ("ok", "unknown"), rule.get("lastError"))
                for metric in re.findall(r"clothstream_\w+", rule["query"]):
                    if metric not in WITHOUT_SERIES:
                        self.assertTrue(prometheus.value(f"{metric}"), f"{rule['name']}: no series of {metric}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
