# SPDX-License-Identifier: MIT
pytest_plugins = ["clothstream_pytest"]
