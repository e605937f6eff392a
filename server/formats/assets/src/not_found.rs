//! Reasons why a URI leads to no file.

use std::path::PathBuf;

/// Reason why there is no file for a URI, with the searched places.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}", self.reason(), Searched(places))]
pub struct NotFound {
    /// URI as the URDF writes it.
    pub uri: String,
    /// Reason: a word for programs, a phrase for people.
    pub why: Why,
    /// Candidates, in the order of the search.
    pub places: Vec<PathBuf>,
}

impl NotFound {
    /// Returns whether the URI is invalid or its file may not be sent; the reason says so. Otherwise the file
    /// is missing.
    pub fn is_refused(&self) -> bool {
        self.why != Why::Missing
    }

    /// Returns a sentence that names the URI, without the places.
    pub fn reason(&self) -> String {
        match self.why {
            Why::Missing => format!("no file for `{}`", self.uri),
            why => format!("`{}` {why}", self.uri),
        }
    }
}

/// Fault of a URI, as a phrase that follows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Why {
    /// No such file on this disk.
    #[error("names a file that does not exist")]
    Missing,
    /// Only blanks.
    #[error("is empty")]
    Empty,
    /// `$(...)` or `${...}`.
    #[error("is an unexpanded xacro expression: load the .xacro file itself")]
    Xacro,
    /// A character that no path may have.
    #[error("holds a null character")]
    Null,
    /// `http://` and similar.
    #[error("is a network address, and nothing is fetched from the network")]
    Network,
    /// Any other scheme.
    #[error("has a scheme other than package, model and file")]
    Scheme,
    /// `package://arm`.
    #[error("names a package and no file in it")]
    NoFile,
    /// `package://../a.stl`.
    #[error("names no package")]
    NoPackage,
    /// `C:\a.stl`.
    #[error("is a path on a Windows disk, which other machines do not have")]
    Windows,
    /// Through `..`.
    #[error("climbs out of the robot's package with `..`")]
    ClimbsOut,
    /// Outside of every known package.
    #[error("is an absolute path outside of the robot's package")]
    AbsoluteOutside,
    /// Through a symbolic link, whether or not its target exists.
    #[error("leads out of the robot's package through a symbolic link")]
    LinkLeadsOut,
    /// Judged by its extension.
    #[error("is not a mesh or an image by its name")]
    NotAMesh,
    /// A file that a xacro file names, judged by its extension.
    #[error("is not a xacro or YAML file by its name")]
    NotASource,
    /// Several files, which differ only in capital letters.
    #[error("fits several files that differ only in capital letters")]
    Ambiguous,
}

impl Why {
    /// Returns its word in test vectors and other clients.
    pub fn word(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Empty => "empty",
            Self::Xacro => "xacro",
            Self::Null => "null",
            Self::Network => "network",
            Self::Scheme => "scheme",
            Self::NoFile => "no_file",
            Self::NoPackage => "no_package",
            Self::Windows => "windows",
            Self::ClimbsOut => "climbs_out",
            Self::AbsoluteOutside => "absolute_outside",
            Self::LinkLeadsOut => "link_leads_out",
            Self::NotAMesh => "not_a_mesh",
            Self::NotASource => "not_a_source",
            Self::Ambiguous => "ambiguous",
        }
    }
}

/// End of the sentence: the searched places, if any.
struct Searched<'a>(&'a [PathBuf]);

impl std::fmt::Display for Searched<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, place) in self.0.iter().enumerate() {
            let before = if index == 0 { "; searched " } else { ", " };
            write!(f, "{before}{}", place.display())?;
        }
        Ok(())
    }
}
