"""Finds the files that a URDF names, in ROS package folders, like the crate `server/formats/assets`.

A URDF may be untrusted, so it can only refer to meshes and images below the folder of a package, with symbolic
links resolved. Nothing is fetched and no ROS tool is executed.
"""

from simd_client.assets.locator import Locator, includes
from simd_client.assets.missing import Missing, Why
from simd_client.assets.urdf import find_urdf

__all__ = ["Locator", "Missing", "Why", "find_urdf", "includes"]
