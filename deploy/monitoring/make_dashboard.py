#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes dashboard.json, the Grafana dashboard of clothstream-server. Import it in Grafana (10 or newer), and choose
the Prometheus that reads the servers."""
import json
import pathlib

RATE = "$__rate_interval"
SERVER = 'instance=~"$instance"'
SCENE = SERVER + ', scene=~"$scene"'


def quantile(q, metric, by="scene"):
    return f"histogram_quantile({q}, sum by (le, {by}) (rate({metric}_bucket{{{SCENE}}}[{RATE}])))"


def rate(metric, labels=SCENE, by="scene"):
    return f"sum by ({by}) (rate({metric}{{{labels}}}[{RATE}]))"


def gauge(metric, labels=SERVER):
    return f"{metric}{{{labels}}}"


# Rows of the dashboard: title, and panels: title, unit, and queries with their legends.
ROWS = [
    ("Server", [
        ("Servers that answer", "short", [('up{job="clothstream", ' + SERVER + "}", "{{instance}}")]),
        ("Participants", "short", [(f"sum by (instance) ({gauge('clothstream_scene_participants')})", "{{instance}}")]),
        ("Load of the device", "percentunit",
         [(f"sum by (instance) (rate(clothstream_scene_device_seconds_sum{{{SERVER}}}[{RATE}]))", "{{instance}}, measured"),
          (gauge("clothstream_budget_used_load"), "{{instance}}, added by clients, by price")]),
        ("Memory", "bytes", [(gauge("clothstream_process_resident_memory_bytes"), "{{instance}}, process"),
                             (gauge("clothstream_device_memory_bytes"), "{{instance}}, device"),
                             (gauge("clothstream_budget_used_memory_bytes"), "{{instance}}, added by clients, by price")]),
        ("Bytes sent a second", "Bps", [(rate("clothstream_sent_bytes_total", SERVER, "instance, endpoint"),
                                         "{{instance}}, {{endpoint}}")]),
        ("Connections", "short", [(gauge("clothstream_open_connections"), "{{instance}}, open"),
                                  (rate("clothstream_connections_total", SERVER, "instance"), "{{instance}}, new a second")]),
        ("Refusals a second", "short", [(rate("clothstream_refusals_total", SERVER, "instance, reason"),
                                         "{{instance}}, {{reason}}")]),
        ("Silence of the device thread", "s", [(gauge("clothstream_device_silence_seconds"), "{{instance}}")]),
    ]),
    ("Simulation", [
        ("Ticks a second", "short", [(rate("clothstream_scene_ticks_total"), "{{scene}}")]),
        ("Time of a tick", "s", [(quantile(0.5, "clothstream_scene_tick_seconds"), "{{scene}}, median"),
                                 (quantile(0.99, "clothstream_scene_tick_seconds"), "{{scene}}, p99")]),
        ("Time of a stage on the device", "s",
         [(f"sum by (scene, stage) (rate(clothstream_scene_device_stage_seconds_sum{{{SCENE}}}[{RATE}]))"
           f" / sum by (scene, stage) (rate(clothstream_scene_device_stage_seconds_count{{{SCENE}}}[{RATE}]))",
           "{{scene}}, {{stage}}")]),
        ("Lateness of ticks, p99", "s", [(quantile(0.99, "clothstream_scene_tick_lateness_seconds"), "{{scene}}")]),
        ("Simulated time lost", "percentunit",
         [(rate("clothstream_scene_slipped_ticks_total") + " / " + rate("clothstream_scene_ticks_total"), "{{scene}}")]),
        ("Substeps, and frames left out", "short", [(gauge("clothstream_scene_substeps", SCENE), "{{scene}}, substeps"),
                                                    (gauge("clothstream_scene_frame_divisor", SCENE), "{{scene}}, one frame of")]),
    ]),
    ("Streams", [
        ("Frames sent a second", "short", [(rate("clothstream_scene_taken_frames_total"), "{{scene}}")]),
        ("Frames that subscribers missed, a second", "short",
         [(rate("clothstream_scene_dropped_frames_total"), "{{scene}}")]),
        ("From a pose to its packet", "s", [(quantile(0.5, "clothstream_scene_input_to_packet_seconds"), "{{scene}}, median"),
                                            (quantile(0.99, "clothstream_scene_input_to_packet_seconds"), "{{scene}}, p99")]),
        ("Encoding a frame, p99", "s", [(quantile(0.99, "clothstream_scene_encode_seconds"), "{{scene}}")]),
        ("Bytes of a packet", "bytes",
         [(rate("clothstream_scene_packet_bytes_total") + " / " + rate("clothstream_scene_frames_total"), "{{scene}}")]),
        ("Participants", "short", [(gauge("clothstream_scene_participants", SCENE), "{{scene}}"),
                                   (gauge("clothstream_scene_away_participants", SCENE), "{{scene}}, away")]),
    ]),
]

SOURCE = {"type": "prometheus", "uid": "${source}"}
WIDTH, HEIGHT = 8, 8  # of a panel; the dashboard is 24 wide


def variable(name, label, query):
    return {"name": name, "label": label, "type": "query", "datasource": SOURCE, "query": query, "refresh": 2,
            "multi": True, "includeAll": True, "allValue": ".*", "current": {"text": "All", "value": "$__all"}}


def dashboard():
    panels, y = [], 0
    for row, content in ROWS:
        panels.append({"id": len(panels) + 1, "type": "row", "title": row, "collapsed": False,
                       "gridPos": {"x": 0, "y": y, "w": 24, "h": 1}, "panels": []})
        y += 1
        for i, (title, unit, queries) in enumerate(content):
            panels.append({
                "id": len(panels) + 1, "type": "timeseries", "title": title, "datasource": SOURCE,
                "gridPos": {"x": i % 3 * WIDTH, "y": y + i // 3 * HEIGHT, "w": WIDTH, "h": HEIGHT},
                "fieldConfig": {"defaults": {"unit": unit, "min": 0}, "overrides": []},
                "options": {"legend": {"displayMode": "list", "placement": "bottom"}, "tooltip": {"mode": "multi"}},
                "targets": [{"refId": chr(ord("A") + k), "datasource": SOURCE, "expr": expression, "legendFormat": legend}
                            for k, (expression, legend) in enumerate(queries)]})
        y += (len(content) + 2) // 3 * HEIGHT
    return {
        "title": "ClothStream", "uid": "clothstream", "tags": ["clothstream"], "schemaVersion": 38, "editable": True,
        "refresh": "10s", "time": {"from": "now-30m", "to": "now"},
        "templating": {"list": [
            {"name": "source", "label": "Prometheus", "type": "datasource", "query": "prometheus"},
            variable("instance", "Server", 'label_values(up{job="clothstream"}, instance)'),
            variable("scene", "Scene", "label_values(clothstream_scene_ticks_total, scene)")]},
        "annotations": {"list": [{
            "name": "Alerts", "enable": True, "iconColor": "red", "datasource": SOURCE,
            "expr": 'ALERTS{alertstate="firing", alertname=~"Cloth.*"}', "titleFormat": "{{alertname}}"}]},
        "panels": panels}


if __name__ == "__main__":
    path = pathlib.Path(__file__).with_name("dashboard.json")
    path.write_text(json.dumps(dashboard(), indent=1) + "\n")
