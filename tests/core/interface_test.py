# SPDX-License-Identifier: MIT
"""Every struct of the C interface can grow: it starts with a version. Usage: interface_test.py"""
import json
import pathlib
import unittest

INTERFACE = pathlib.Path(__file__).resolve().parents[2] / "clients/interface/interface.json"
# Values that never get another member. Only they may be members of other structs.
PLAIN = {"cs_recorded_pose"}


class Structs(unittest.TestCase):
    def setUp(self):
        self.headers = json.loads(INTERFACE.read_text()).values()
        self.structs = {name: struct for header in self.headers for name, struct in header["structs"].items()}

    def test_start_with_a_version(self):
        constants = {name for header in self.headers for name in header["constants"]}
        for name, struct in self.structs.items():
            with self.subTest(name):
                first = struct["fields"][0]
                has_version = (first["name"], first["type"]) == ("version", "uint32_t")
                self.assertEqual(has_version, name not in PLAIN)
                self.assertEqual(f"{name.upper()}_VERSION" in constants, name not in PLAIN)

    def test_contain_only_plain_structs(self):
        for name, struct in self.structs.items():
            contained = {field["type"] for field in struct["fields"]} & self.structs.keys()
            self.assertLessEqual(contained, PLAIN, name)


if __name__ == "__main__":
    unittest.main()
