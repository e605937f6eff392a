//! Why a URI leads to no file.

use std::path::PathBuf;

/// Why there is no file for a URI.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}", self.reason(), Searched(places))]
pub struct NotFound {
    /// As the URDF writes it.
    pub uri: String,
    /// In one word for programs, in a phrase for people.
    pub why: Why,
    /// The files that would have been it, in the order in which they were looked for.
    pub places: Vec<PathBuf>,
}

impl NotFound {
    /// The URI means nothing here, or what it means may not be given away: the
    /// reason says so. Else there simply is no such file.
    pub fn is_refused(&self) -> bool {
        self.why != Why::Missing
    }

    /// A sentence that names the URI, without the places.
    pub fn reason(&self) -> String {
        match self.why {
            Why::Missing => format!("no file for `{}`", self.uri),
            why => format!("`{}` {why}", self.uri),
        }
    }
}

/// What is the matter with a URI, as a phrase that follows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Why {
    /// Nowhere on this disk.
    #[error("names no file that is there")]
    Missing,
    /// Nothing but blanks.
    #[error("is empty")]
    Empty,
    /// `$(...)` or `${...}`.
    #[error("is an unexpanded xacro expression: load the .xacro file itself")]
    Xacro,
    /// A character that no path holds.
    #[error("holds a null character")]
    Null,
    /// `http://` and its like.
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
    #[error("is a path of a Windows disk, which means nothing to others")]
    Windows,
    /// By `..`.
    #[error("climbs out of the robot's package with `..`")]
    ClimbsOut,
    /// Outside of every package that is known.
    #[error("is an absolute path outside of the robot's package")]
    AbsoluteOutside,
    /// By a symbolic link, whether or not there is anything at its end.
    #[error("leads out of the robot's package through a symbolic link")]
    LinkLeadsOut,
    /// Not by its extension.
    #[error("is not a mesh or an image by its name")]
    NotAMesh,
    /// The same of what a xacro file names.
    #[error("is not a xacro or YAML file by its name")]
    NotASource,
    /// Only by letters' case, and more than one.
    #[error("fits several files that differ in capital letters alone")]
    Ambiguous,
}

impl Why {
    /// The word that test vectors and other clients know it by.
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

/// The end of the sentence, where there were any places.
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
