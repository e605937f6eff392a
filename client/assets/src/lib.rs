//! Finds the files that a URDF names, in ROS package folders, and writes files that take the place of others.
//!
//! One function for paths: clients call it for what they upload, the daemon
//! calls it below its own asset roots. A URDF may be untrusted, so what
//! it names is only ever a mesh or an image, below the folder of a package, with
//! symbolic links resolved. Nothing is fetched and no ROS tool is executed.
//!
//! * [`Locator`]: from a URI to a file.
//! * [`find_urdf`]: from the path of a robot to its URDF.
//! * [`inside`]: what a path in a folder turns out to be once symbolic links are followed.
//! * [`Replacement`], [`replace_file`]: a file that is whole or not there, however its program ends.

mod boundary;
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
