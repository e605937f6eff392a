//! Finds the files that a URDF names, in ROS package folders.
//!
//! One function for paths: clients call it for what they upload, the daemon
//! calls it below its own asset roots. A URDF may come from a stranger, so what
//! it names is only ever a mesh or an image, below the folder of a package, with
//! symbolic links resolved. Nothing is fetched and no ROS tool is executed.
//!
//! * [`Locator`]: from a URI to a file.
//! * [`find_urdf`]: from the path of a robot to its URDF.
//! * [`below`]: whether a path lies in a folder once symbolic links are resolved.

mod boundary;
mod locator;
mod package;
mod urdf;
mod uri;

pub use boundary::below;
pub use locator::{Locator, NotFound};
pub use urdf::{NoUrdf, find_urdf};
