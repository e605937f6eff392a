"""Install commands for missing packages, for messages. Packages of the index have their own names, wheels of
simd their folder."""

from __future__ import annotations

XACRO = "pip install 'xacro>=2.1,<3'"
PLOT = "pip install 'matplotlib>=3.6'"
NOTEBOOK = "pip install 'anywidget>=0.9'"
GYM = "pip install 'gymnasium>=1.1,<2'"
RAY = "pip install 'ray>=2.40,<3'"
TEST = "pip install 'mcap-ros2-support>=0.5' 'matplotlib>=3.6'"
EMBEDDED = "pip install dist/simd_embedded-*.whl (`make dist` in simd's repository makes the folder dist)"
DAEMON = "pip install dist/simd_daemon-*.whl (`make dist` in simd's repository makes the folder dist)"
