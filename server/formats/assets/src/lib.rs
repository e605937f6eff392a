//! Finds the files that a URDF names, in ROS package folders, and replaces files atomically.
//!
//! Clients use it to find the files that they upload, and the daemon uses it below its own asset roots. A
//! URDF may be untrusted. So it can only name meshes and images, below the folder of a package, with symbolic
//! links resolved. Nothing is fetched and no ROS tool is executed.
//!
//! * [`Locator`]: finds the file of a URI.
//! * [`find_urdf`]: finds the URDF of a robot's path.
//! * [`inside`]: follows a path in a folder through symbolic links.
//! * [`files`]: opens only regular files, and puts unusable ones aside.
//! * [`Replacement`], [`replace_file`]: files that are either complete or absent, even if the program is
//!   killed.

mod boundary;
pub mod files;
mod locator;
mod not_found;
mod package;
mod replacement;
mod ros;
mod urdf;
mod uri;

pub use boundary::{Inside, below, inside};
pub use locator::Locator;
pub use not_found::{NotFound, Why};
pub use replacement::{Replacement, replace_file, with_suffix};
pub use urdf::{NoUrdf, find_description, find_urdf, find_urdf_within, has_xacro, is_xacro};
