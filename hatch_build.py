"""Build hook: the wheel carries what npm builds, or the build fails and says why."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class DashboardBuildHook(BuildHookInterface):  # type: ignore[misc]  # hatchling ships no types
    """Runs ``npm ci && npm run build`` unless a finished dashboard is already there."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the dashboard before the wheel is packed; leave editable installs alone."""
        if version == "editable":
            return
        page = Path(self.root, "server", "transientcam_server", "static", "index.html")
        player = Path(self.root, "client", "transientcam", "static", "player.js")
        dashboard = Path(self.root, "client", "dashboard")
        if page.exists() and player.exists():
            return
        if shutil.which("npm") is None:
            raise RuntimeError(
                "The dashboard is not built and npm was not found. Install Node.js 20 or newer, "
                "or put a finished build into server/transientcam_server/static and "
                "client/transientcam/static."
            )
        subprocess.run(["npm", "ci"], cwd=dashboard, check=True)
        subprocess.run(["npm", "run", "build"], cwd=dashboard, check=True)
        for built in (page, player):
            if not built.exists():
                raise RuntimeError(f"npm run build finished without writing {built}")
