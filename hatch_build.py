"""Adds to the wheel what lies outside the package: Xacro models and stored policies.

An editable install reads both from the checkout instead, so nothing is copied for it.
"""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class WheelData(BuildHookInterface):  # type: ignore[type-arg]
    """Places `models/xacro`, `reports/S05/baseline` and `reports/general` under `gaitval/`
    (`baselines/S05`, `baselines/general`).
    """

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Register the folders that exist; a checkout without baselines builds as well."""
        if version == "editable":
            return
        root = Path(self.root)
        included = build_data["force_include"]
        included[str(root / "models" / "xacro")] = "gaitval/models/xacro"
        for baseline in sorted(root.glob("reports/S*/baseline")):
            included[str(baseline)] = f"gaitval/baselines/{baseline.parent.name}"
        included[str(root / "reports" / "general")] = "gaitval/baselines/general"
