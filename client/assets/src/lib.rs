//! Finds the files that a URDF names.
