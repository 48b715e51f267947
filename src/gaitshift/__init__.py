"""Quadruped gaits as reward machines, and the conditions by which a robot shifts them itself."""

import os

__version__ = "0.2.0"

# onnxruntime sends usage data unless it finds this when it loads, which no module does before here.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
