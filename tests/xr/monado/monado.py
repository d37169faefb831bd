# SPDX-License-Identifier: MIT
"""Monado and clothstream-xr in a Debian 13 root (make_root.sh). Both are processes of this machine and its network, with
the files of the root."""

import json
import os
import pathlib
import random
import shutil
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from programs import Program  # noqa: E402

# Mounts what the root lacks in a namespace that ends with the program, which replaces this shell: signals reach it.
# Standard input is a pipe that never ends, because Monado ends without one.
ENTER = """
root=$1 input=$2 shared=$3
shift 3
mount --rbind /proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --rbind /sys "$root/sys"
mount --bind "$shared" "$root/shared"
exec chroot "$root" "$@" 0<>"$input"
"""
LIBRARIES = "/clothstream/lib"


def low_free_port():
    """Free port below 32768: Monado ignores larger ones in its configuration."""
    for port in random.sample(range(20000, 32000), 100):
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError("no port is free")


class Root:
    """A root, and a folder of this test, which is /shared there."""

    def __init__(self, root, program):
        self.root = pathlib.Path(root)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="clothstream-xr-"))
        (self.folder / "run").mkdir(mode=0o700)
        (self.folder / "home/.config/monado").mkdir(parents=True)
        os.mkfifo(self.folder / "input")
        (self.root / "shared").mkdir(exist_ok=True)
        self.port = low_free_port()
        config = {"active": "remote", "remote": {"version": 0, "port": self.port, "view_count": 2}}
        (self.folder / "home/.config/monado/config_v0.json").write_text(json.dumps(config))
        self._install(pathlib.Path(program))

    def remove(self):
        shutil.rmtree(self.folder)

    def _install(self, program):
        """Copies the program, and those of its libraries that the root lacks. Newer ones of the same name serve as well."""
        library = self.root / LIBRARIES.lstrip("/")
        shutil.rmtree(library.parent, ignore_errors=True)
        library.mkdir(parents=True)
        shutil.copy(program, library.parent / "clothstream-xr")
        needed = subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout
        for line in needed.splitlines():
            name, _, path = line.strip().partition(" => ")
            path = path.split(" (")[0]
            if path.startswith("/") and not any((self.root / "usr/lib").glob(f"*-linux-gnu/{name}")):
                shutil.copy(path, library / name)

    def command(self, environment, *command):
        variables = {
            "HOME": "/shared/home",
            "PATH": "/usr/bin:/bin",
            "LC_ALL": "C.UTF-8",
            "XDG_RUNTIME_DIR": "/shared/run",
            "VK_DRIVER_FILES": "/usr/share/vulkan/icd.d/lvp_icd.json",
            **environment,
        }
        settings = [f"{name}={value}" for name, value in variables.items()]
        enter = ["unshare", "--mount", "bash", "-euc", ENTER, "_", self.root, self.folder / "input", self.folder]
        return [*enter, "env", "-i", *settings, *command]

    def monado(self):
        """Monado, which listens."""
        for name in ("monado_comp_ipc", "monado.pid"):  # of one that was killed
            (self.folder / "run" / name).unlink(missing_ok=True)
        service = Program(
            "monado-service",
            self.command({"XRT_COMPOSITOR_NULL": "1"}, "monado-service"),
            self.folder / "monado.log",
        )
        service.wait_for("The Monado service has started")
        service.wait_for(f"Listening on port '{self.port}'")
        return service

    def client(self, *arguments, log="client.log", environment=None, validates=False):
        """clothstream-xr. validates: with the validation layers of OpenXR and Vulkan. Each of their messages is in its log, and
        its exit status is then 1."""
        settings = {"LD_LIBRARY_PATH": LIBRARIES}
        if validates:
            settings |= {"CLOTHSTREAM_VALIDATION": "1", "XR_ENABLE_API_LAYERS": "XR_APILAYER_LUNARG_core_validation"}
            settings["XR_CORE_VALIDATION_EXPORT_TYPE"] = "text"
        command = self.command(settings | (environment or {}), "/clothstream/clothstream-xr", "--verbose", *arguments)
        return Program("clothstream-xr", command, self.folder / log)
