# SPDX-License-Identifier: MIT
"""A stand-in of Agones' sidecar.

It follows the REST interface of Agones' SDK (sdk.proto and beta.proto of Agones 1.4x): states of a GameServer, counters
with a capacity, lists. It refuses what the sidecar refuses.
"""
import http.server
import json
import re
import threading
import time


class Sidecar(http.server.ThreadingHTTPServer):
    """Counters and lists must be in the GameServer's specification."""

    def __init__(self, counters, lists, port=0):
        super().__init__(("127.0.0.1", port), Handler)
        self.state, self.states, self.health = "Scheduled", [], []
        self.counters = {name: {"count": 0, "capacity": 1000} for name in counters}
        self.lists = {name: [] for name in lists}
        self.lock = threading.Lock()
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def port(self):
        return self.server_address[1]

    def close(self):
        self.shutdown()
        self.server_close()

    def become(self, state):
        self.state = state
        self.states.append(state)


class Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def answer(self, status, body):
        data = json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def refuse(self, status, code, text):
        self.answer(status, {"code": code, "message": text, "details": []})

    def body(self):
        return json.loads(self.rfile.read(int(self.headers["Content-Length"])))

    def do_POST(self):
        sidecar, body = self.server, self.body()
        with sidecar.lock:
            if self.path == "/health":
                sidecar.health.append(time.monotonic())
                return self.answer(200, {})
            states = {"/ready": "Ready", "/allocate": "Allocated", "/shutdown": "Shutdown"}
            if self.path in states:
                if sidecar.state == "Shutdown":
                    return self.refuse(400, 9, "cannot leave Shutdown")
                sidecar.become(states[self.path])
                return self.answer(200, {})
            if found := re.fullmatch(r"/v1beta1/lists/([\w-]+):(addValue|removeValue)", self.path):
                values = sidecar.lists.get(found[1])
                if values is None:
                    return self.refuse(404, 5, f"list not found: {found[1]}")
                if found[2] == "addValue":
                    if body["value"] in values:
                        return self.refuse(409, 6, "already in the list")
                    values.append(body["value"])
                else:
                    if body["value"] not in values:
                        return self.refuse(404, 5, "not in the list")
                    values.remove(body["value"])
                return self.answer(200, {"name": found[1], "values": values})
        return self.refuse(404, 5, "Not Found")

    def do_GET(self):
        sidecar = self.server
        with sidecar.lock:
            if self.path == "/gameserver":
                return self.answer(200, {"object_meta": {"name": "server"}, "status": {"state": sidecar.state}})
            if found := re.fullmatch(r"/v1beta1/lists/([\w-]+)", self.path):
                if found[1] not in sidecar.lists:
                    return self.refuse(404, 5, f"list not found: {found[1]}")
                return self.answer(200, {"name": found[1], "capacity": "1000", "values": sidecar.lists[found[1]]})
        return self.refuse(404, 5, "Not Found")

    def do_PATCH(self):
        sidecar, body = self.server, self.body()
        with sidecar.lock:
            found = re.fullmatch(r"/v1beta1/counters/([\w-]+)", self.path)
            if not found or found[1] not in sidecar.counters:
                return self.refuse(404, 5, "counter not found")
            counter = sidecar.counters[found[1]]
            # Int64Value is a string in JSON; the sidecar refuses other members.
            if not set(body) <= {"count", "capacity", "countDiff"} or not all(isinstance(v, str) for v in body.values()):
                return self.refuse(400, 3, "invalid CounterUpdateRequest")
            capacity = int(body.get("capacity", counter["capacity"]))
            count = int(body.get("count", counter["count"]))
            if not 0 <= count <= capacity:
                return self.refuse(400, 11, "out of range")
            counter.update(count=count, capacity=capacity)
            return self.answer(200, {"name": found[1], "count": str(count), "capacity": str(capacity)})
