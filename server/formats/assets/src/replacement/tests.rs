//! Files that are replaced, and files that are not.

use super::*;

fn count(folder: &tempfile::TempDir) -> usize {
    fs::read_dir(folder.path()).unwrap().count()
}

#[test]
fn a_file_is_as_it_was_until_the_other_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    fs::write(&path, "before").unwrap();
    for begin in [Replacement::begin, Replacement::begin_alone] {
        let mut half = begin(&path).unwrap();
        half.write_all(b"ha").unwrap();
        assert_eq!((fs::read(&path).unwrap(), count(&folder)), (b"before".to_vec(), 2));
        drop(half);
        assert_eq!((fs::read(&path).unwrap(), count(&folder)), (b"before".to_vec(), 1));
    }
    replace_file(&path, b"after").unwrap();
    assert_eq!((fs::read(&path).unwrap(), count(&folder)), (b"after".to_vec(), 1));
    replace_file(&folder.path().join("new"), b"new").unwrap();
    assert_eq!(fs::read(folder.path().join("new")).unwrap(), b"new");
    assert!(replace_file(&folder.path().join("none/file"), b"").is_err());
    assert!(replace_file(folder.path(), b"").is_err(), "a folder is not a file");
    assert_eq!(count(&folder), 2);
}

#[test]
fn files_of_a_killed_program_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    fs::write(folder.path().join("file.new"), "a half that is longer").unwrap();
    let mut file = Replacement::begin_alone(&path).unwrap();
    file.write_all(b"whole").unwrap();
    file.finish().unwrap();
    assert_eq!((fs::read(&path).unwrap(), count(&folder)), (b"whole".to_vec(), 1));
}

#[test]
fn a_new_file_takes_the_place_of_none() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    let file = Replacement::begin_new(&path).unwrap();
    fs::write(&path, "another's").unwrap();
    assert_eq!(file.finish().unwrap_err().kind(), ErrorKind::AlreadyExists);
    assert_eq!(Replacement::begin_new(&path).unwrap_err().kind(), ErrorKind::AlreadyExists);
    assert_eq!((fs::read(&path).unwrap(), count(&folder)), (b"another's".to_vec(), 1));
    fs::remove_file(&path).unwrap();
    Replacement::begin_new(&path).unwrap().finish().unwrap();
    assert_eq!((fs::read(&path).unwrap(), count(&folder)), (Vec::new(), 1));
}

#[cfg(unix)]
#[test]
fn modes_and_links_are_kept() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real"), folder.path().join("link"));
    fs::write(&real, "before").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    for kept in [0o600, 0o664] {
        fs::set_permissions(&real, fs::Permissions::from_mode(kept)).unwrap();
        replace_file(&link, b"after").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!((fs::read(&real).unwrap(), mode(&real)), (b"after".to_vec(), kept));
    }
    // A new file has the permissions of any file that the process makes.
    let (new, written) = (folder.path().join("new"), folder.path().join("written"));
    replace_file(&new, b"").unwrap();
    fs::write(&written, "").unwrap();
    assert_eq!(mode(&new), mode(&written));
}

#[test]
fn a_name_that_is_as_long_as_can_be_is_replaced_whatever_others_have_left() {
    let folder = tempfile::tempdir().unwrap();
    // A program with the same process number was killed: numbers begin at 0 again.
    for number in 0..20 {
        fs::write(folder.path().join(format!(".simd-{}-{number}.new", std::process::id())), "a part")
            .unwrap();
    }
    let path = folder.path().join("n".repeat(255));
    for text in ["first", "second"] {
        replace_file(&path, text.as_bytes()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), text.as_bytes());
    }
    assert_eq!(count(&folder), 21);
}

#[cfg(unix)]
#[test]
fn the_owner_stays_and_a_file_is_written_in_place_where_no_other_can_be_made() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    fs::write(&path, "before").unwrap();
    // Only root may give files away, and only root may make files in any folder.
    let is_root = chown(&path, Some(65_534), Some(65_534)).is_ok();
    if !is_root {
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o555)).unwrap();
    }
    let before = fs::metadata(&path).unwrap();
    replace_file(&path, b"after").unwrap();
    let after = fs::metadata(&path).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"after");
    assert_eq!((after.uid(), after.gid()), (before.uid(), before.gid()));
    assert_eq!(after.ino() == before.ino(), !is_root, "it is another file where there can be one");
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(unix)]
#[test]
fn a_link_without_an_end_gets_one() {
    let folder = tempfile::tempdir().unwrap();
    let (end, link) = (folder.path().join("end"), folder.path().join("link"));
    std::os::unix::fs::symlink(&end, &link).unwrap();
    replace_file(&link, b"text").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!((fs::read(&end).unwrap(), count(&folder)), (b"text".to_vec(), 2));
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_is_written_in_place() {
    let full = replace_file(Path::new("/dev/full"), b"something").unwrap_err();
    assert_eq!(full.kind(), ErrorKind::StorageFull);
    replace_file(Path::new("/dev/null"), b"something").unwrap();
}
