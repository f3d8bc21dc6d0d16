"""Builds wheels that bring compiled functions along, so that nothing compiles at first use.

Where that fails, a wheel without them is built, which compiles what it needs when it needs it
and says why.  Editable installs never have them: they follow the sources.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HERE = Path(__file__).resolve().parent
LIMIT = 1200.0  # seconds; some 100 on two cores
START = b"amontons kernels"  # as in amontons.core.shipped, which needs numba


def finished(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
    """What a command says within a limit in seconds, else no process of it goes on.

    Raises TimeoutExpired; processes that it has started would compile on for minutes.
    """
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, stdout=pipe, stderr=pipe, text=True, start_new_session=True
    ) as process:
        try:
            out, err = process.communicate(timeout=limit)
        except BaseException:  # Ctrl-C too
            if sys.platform == "win32":
                process.kill()
            else:
                os.killpg(process.pid, signal.SIGKILL)
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


class CompiledFunctions(BuildHookInterface):
    """Puts `kernels.bin` into a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, unless the wheel is an editable one or AMONTONS_KERNELS is "none"."""
        if version == "editable" or os.environ.get("AMONTONS_KERNELS") == "none":
            return
        self.folder = tempfile.TemporaryDirectory()
        path = Path(self.folder.name) / "kernels.bin"
        reason = self._compiled(path)
        build_data["force_include"][str(path)] = "amontons/kernels.bin"
        if reason:
            self.app.display_warning(f"no compiled functions in this wheel: {reason}")
            head = json.dumps({"why_not": f"building failed: {reason}"}).encode()
            path.write_bytes(START + len(head).to_bytes(8, "little") + head)
            return
        build_data["pure_python"] = False
        platform = os.environ.get("AUDITWHEEL_PLAT", "")  # of the manylinux images
        if platform:
            tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
            build_data["tag"] = f"{tag}-{tag}-{platform}"
        else:
            build_data["infer_tag"] = True

    def _compiled(self, path: Path) -> str:
        """Make the file; why that failed, empty where it did not."""
        sources = str(HERE.parent / "src")
        command = [sys.executable, str(HERE / "compile.py"), str(path), sources]
        try:
            done = finished(command, LIMIT)
        except (OSError, subprocess.SubprocessError) as error:
            return f"{type(error).__name__}: {error}"
        for line in (done.stdout + done.stderr).splitlines():
            self.app.display_info(line)
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        return "" if done.returncode == 0 else last

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was made."""
        if hasattr(self, "folder"):
            self.folder.cleanup()
