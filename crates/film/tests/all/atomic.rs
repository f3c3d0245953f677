//! Tests of the atomic writing of files: symbolic links, read-only files, and temporary files of
//! killed processes.
#![cfg(unix)]

use std::fs::{self, File};
use std::os::unix::fs::{PermissionsExt as _, symlink};

use linelit_film::{check_writable, write_atomically};
use linelit_testkit::folder::Folder;

/// More than the largest number that Linux gives a process, 2²².
const NO_PROCESS: u32 = (1 << 22) + 7;

#[test]
fn a_link_stays_and_its_file_is_replaced() {
    let folder = Folder::new("atomic-link");
    fs::create_dir(folder.join("far")).unwrap();
    fs::write(folder.join("far/picture"), "old").unwrap();
    symlink("far/picture", folder.join("one")).unwrap();
    symlink(folder.join("one"), folder.join("two")).unwrap();
    write_atomically(&folder.join("two"), b"new").unwrap();
    assert!(folder.join("one").is_symlink() && folder.join("two").is_symlink());
    assert!(!folder.join("far/picture").is_symlink());
    assert_eq!(fs::read(folder.join("far/picture")).unwrap(), b"new");

    // A link to a file that does not exist yet: writing creates that file and keeps the link.
    symlink("far/none", folder.join("three")).unwrap();
    check_writable(&folder.join("three")).unwrap();
    assert!(!folder.join("far/none").exists());
    write_atomically(&folder.join("three"), b"first").unwrap();
    assert_eq!(fs::read(folder.join("far/none")).unwrap(), b"first");

    symlink("circle", folder.join("circle")).unwrap();
    let error = write_atomically(&folder.join("circle"), b"x").unwrap_err();
    assert!(error.to_string().contains("symbolic links"), "{error}");
    assert_eq!(folder.names(), ["circle", "far", "one", "three", "two"]);
}

#[test]
fn a_read_only_file_is_refused_and_permissions_stay() {
    let folder = Folder::new("atomic-permissions");
    let path = folder.join("x");
    fs::write(&path, "kept").unwrap();
    for (mode, writable) in [(0o600, true), (0o444, false), (0o400, false), (0o640, true)] {
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        let tried = check_writable(&path);
        let before = fs::read(&path).unwrap();
        let written = write_atomically(&path, format!("{mode:o}").as_bytes());
        assert_eq!((tried.is_ok(), written.is_ok()), (writable, writable));
        let now = fs::read(&path).unwrap();
        if let Err(error) = written {
            assert!(error.to_string().contains("read-only"), "{error}");
            assert_eq!(now, before);
        } else {
            assert_eq!(now, format!("{mode:o}").as_bytes());
        }
        let kept = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(kept & 0o777, mode);
    }
    assert_eq!(folder.names(), ["x"]);
}

#[test]
fn what_is_no_regular_file_is_refused() {
    let folder = Folder::new("atomic-special");
    symlink("/dev/full", folder.join("device")).unwrap();
    fs::create_dir(folder.join("folder")).unwrap();
    for name in ["device", "folder", "device/below"] {
        assert!(check_writable(&folder.join(name)).is_err(), "{name}");
        assert!(
            write_atomically(&folder.join(name), b"x").is_err(),
            "{name}"
        );
    }
    assert_eq!(folder.names(), ["device", "folder"]);
}

#[test]
fn what_killed_writers_left_is_removed() {
    let folder = Folder::new("atomic-swept");
    let own = std::process::id();
    let stale = format!(".a.exr.{NO_PROCESS}-0.tmp");
    let kept = [
        // In this order: a temporary file of another picture, one of a living process, a file with
        // a name that linelit never gives, and one that its writer has locked.
        format!(".b.exr.{NO_PROCESS}-0.tmp"),
        format!(".a.exr.{own}-999.tmp"),
        ".a.exr.notes.tmp".to_owned(),
        format!(".a.exr.{NO_PROCESS}-1.tmp"),
    ];
    fs::write(folder.join(&stale), "half").unwrap();
    for name in &kept {
        fs::write(folder.join(name), "half").unwrap();
    }
    let locked = File::open(folder.join(&kept[3])).unwrap();
    locked.try_lock().unwrap();
    write_atomically(&folder.join("a.exr"), b"whole").unwrap();
    let mut expected = kept.to_vec();
    expected.push("a.exr".to_owned());
    expected.sort();
    assert_eq!(folder.names(), expected);
    drop(locked);
    check_writable(&folder.join("a.exr")).unwrap();
    assert!(!folder.join(&kept[3]).exists());
}
