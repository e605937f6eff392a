//! Xacro files of clients, and their expansion to URDFs.

use std::collections::BTreeMap;
use std::path::Path;

use bytes::Bytes;
use simd_assets::Locator;
use simd_model::LoadReport;

use super::Loader;
use crate::account::Account;
use crate::call_error::CallError;

/// A xacro file and the files that it may include.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct XacroFiles {
    /// Files by their paths from one folder. Steps are divided by `/`, and none of them is empty, `.` or
    /// `..`. No file is the folder of another.
    pub files: BTreeMap<String, Bytes>,
    /// Path of the file to expand.
    pub path: String,
    /// Values of `$(arg NAME)` by name.
    pub arguments: BTreeMap<String, String>,
}

/// Result of an expansion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpandedXacro {
    /// URDF. An absolute path in it is the path of a sent file, with a `/` before it.
    pub urdf: String,
    /// Messages of the files by `xacro.message` and `xacro.warning`.
    pub messages: Vec<String>,
}

impl Loader {
    /// Expands a xacro file to a URDF.
    ///
    /// # Errors
    /// Returns an error if the files are too large in total, or the xacro is invalid.
    pub(crate) async fn expand_xacro(
        &self,
        account: &Account,
        files: XacroFiles,
    ) -> Result<ExpandedXacro, CallError> {
        self.check_description(files.files.values().map(Bytes::len).sum())?;
        self.off_thread(account, move || expand(&files)).await?
    }
}

/// Expands in a temporary folder. Packages are found by their folders, as on the disk of a client that
/// expands locally. So the files are written into a separate folder, which is deleted afterwards, and nothing
/// is found outside of it.
fn expand(files: &XacroFiles) -> Result<ExpandedXacro, CallError> {
    let unwritten = |error: std::io::Error| CallError::Internal {
        message: format!(
            "the xacro files could not be written to the daemon's folder for temporary files: {error}"
        ),
    };
    let folder = tempfile::TempDir::with_prefix("simd-xacro-").map_err(unwritten)?;
    // The expansion follows links, and the folder for temporary files may be one.
    let root = folder.path().canonicalize().map_err(unwritten)?;
    for (path, bytes) in &files.files {
        let path = root.join(path);
        if let Some(above) = path.parent() {
            std::fs::create_dir_all(above).map_err(unwritten)?;
        }
        std::fs::write(&path, bytes).map_err(unwritten)?;
    }
    let main = root.join(&files.path);
    let locator = Locator::new(&main).within(&root);
    match simd_xacro::expand(&main, &files.arguments, &locator) {
        Ok(expanded) => Ok(ExpandedXacro {
            urdf: as_sent(&expanded.urdf, &root),
            messages: expanded.messages.iter().map(|message| as_sent(message, &root)).collect(),
        }),
        Err(error) => {
            let message = as_sent(&error.to_string(), &root);
            Err(CallError::InvalidDescription { message, report: Box::new(LoadReport::default()) })
        }
    }
}

/// Restores the paths that the client knows, so that no client sees the folder.
fn as_sent(text: &str, root: &Path) -> String {
    text.replace(&*root.to_string_lossy(), "")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "<robot name='$(arg name)' xmlns:xacro='http://ros.org/wiki/xacro'>\n<xacro:arg name='name' default='arm'/>\n\
        <xacro:include filename='$(find my_arm)/urdf/parts/hand.xacro'/>\n<xacro:hand/>\n\
        <xacro:property name='sizes' value=\"${xacro.load_yaml('../config/sizes.yaml')}\"/>\n\
        <link name='base'><visual><geometry><mesh filename='file://$(dirname)/../meshes/base.stl' scale=\"${sizes['base']} 1 1\"/>\
        </geometry></visual></link></robot>";
    const HAND: &str = "<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:macro name='hand'><link name='hand'/></xacro:macro></robot>";

    fn arm(text: &str) -> XacroFiles {
        let files = [
            ("dropped/arm-main/package.xml", "<package><name>my_arm</name></package>"),
            ("dropped/arm-main/urdf/arm.urdf.xacro", text),
            ("dropped/arm-main/urdf/parts/hand.xacro", HAND),
            ("dropped/arm-main/config/sizes.yaml", "base: 2.5\n"),
        ];
        XacroFiles {
            files: files
                .into_iter()
                .map(|(path, text)| (path.to_owned(), Bytes::from(text.to_owned())))
                .collect(),
            path: "dropped/arm-main/urdf/arm.urdf.xacro".into(),
            arguments: BTreeMap::new(),
        }
    }

    #[test]
    fn a_package_is_expanded_with_what_it_includes_and_absolute_paths_are_those_that_were_sent() {
        let mut files = arm(ARM);
        let ExpandedXacro { urdf, .. } = expand(&files).unwrap();
        assert!(urdf.contains("<robot name=\"arm\"") && urdf.contains("<link name=\"hand\"/>"), "{urdf}");
        assert!(
            urdf.contains("file:///dropped/arm-main/urdf/../meshes/base.stl")
                && urdf.contains("scale=\"2.5 1 1\""),
            "{urdf}"
        );
        assert!(!urdf.contains("simd-xacro-"), "{urdf}");
        files.arguments.insert("name".into(), "left".into());
        assert!(expand(&files).unwrap().urdf.contains("<robot name=\"left\""));
    }

    #[test]
    fn faults_have_their_file_and_line_and_name_no_folder_of_the_daemon() {
        for (text, said) in [
            ("<robot>\n<link name='${unknown}'/></robot>", "/dropped/arm-main/urdf/arm.urdf.xacro:2: "),
            (
                "<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:include filename='lost.xacro'/></robot>",
                "lost.xacro",
            ),
        ] {
            let refused = expand(&arm(text)).unwrap_err();
            let CallError::InvalidDescription { message, .. } = refused else { panic!("{refused}") };
            assert!(message.contains(said) && !message.contains("simd-xacro-"), "{message}");
        }
    }

    #[test]
    fn nothing_of_the_daemons_own_disk_is_read() {
        let outside = tempfile::TempDir::new().unwrap();
        let secret = outside.path().join("secret.xacro");
        std::fs::write(&secret, "<robot><link name='secret'/></robot>").unwrap();
        let up = "../".repeat(20);
        for name in [
            secret.display().to_string(),
            format!("{up}{}", secret.display()),
            format!("file://{}", secret.display()),
        ] {
            let text = format!(
                "<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:include filename='{name}'/></robot>"
            );
            let refused = expand(&arm(&text)).unwrap_err();
            assert!(matches!(refused, CallError::InvalidDescription { .. }), "{name}: {refused}");
        }
    }
}
