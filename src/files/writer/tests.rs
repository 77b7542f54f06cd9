//! What a file is after it was written, and what is left beside it.

use super::temporary::{options, remove_listed};
use super::*;

/// The names in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_is_replaced_only_once_it_is_whole_and_nothing_is_left_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("report.json");
    for text in ["first", "second"] {
        write_whole(&file, text.as_bytes()).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), text);
    }
    let mut output = Output::create(&file).unwrap();
    output.write_all(b"half").unwrap();
    assert_eq!(fs::read_to_string(&file).unwrap(), "second");
    drop(output);
    assert_eq!(fs::read_to_string(&file).unwrap(), "second");
    assert_eq!(names(folder.path()), ["report.json"]);
}

#[test]
fn a_folder_and_what_lies_below_a_file_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    write_whole(&file, b"text").unwrap();
    assert_eq!(write_whole(folder.path(), b"").unwrap_err().kind(), ErrorKind::IsADirectory);
    assert_eq!(write_whole(&file.join("below"), b"").unwrap_err().kind(), ErrorKind::NotADirectory);
    assert_eq!(write_whole(&folder.path().join("none/file"), b"").unwrap_err().kind(), ErrorKind::NotFound);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
    use std::process::Command;

    use super::*;

    #[test]
    fn a_pipe_is_written_into_and_stays_a_pipe_also_behind_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        symlink("pipe", &link).unwrap();
        for file in [&pipe, &link] {
            let reader = std::thread::spawn({
                let pipe = pipe.clone();
                move || fs::read_to_string(pipe).unwrap()
            });
            write_whole(file, b"report").unwrap();
            assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo(), "{}", file.display());
            assert_eq!(reader.join().unwrap(), "report");
        }
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn a_device_is_written_into_and_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let device = folder.path().join("null");
        // Only root may make one; a pipe is not a regular file either.
        if Command::new("mknod").arg(&device).args(["c", "1", "3"]).output().is_ok_and(|made| made.status.success()) {
            // A file system may be mounted without devices; there it is not replaced either.
            let written = write_whole(&device, b"report");
            assert!(fs::symlink_metadata(&device).unwrap().file_type().is_char_device());
            assert!(written.is_ok() || written.unwrap_err().kind() == ErrorKind::PermissionDenied);
        }
    }

    #[test]
    fn links_are_followed_also_to_a_file_that_is_not_there_yet() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second, disk] = ["first", "second", "disk"].map(|name| folder.path().join(name));
        fs::create_dir(&disk).unwrap();
        symlink("second", &first).unwrap();
        symlink("disk/report.json", &second).unwrap();
        for text in ["first", "second"] {
            write_whole(&first, text.as_bytes()).unwrap();
            assert!([&first, &second].iter().all(|link| fs::symlink_metadata(link).unwrap().is_symlink()));
            assert_eq!(fs::read_to_string(disk.join("report.json")).unwrap(), text);
        }
        assert_eq!((names(folder.path()).len(), names(&disk).len()), (3, 1));
        // Links in a circle end.
        symlink("circle", folder.path().join("circle")).unwrap();
        assert!(write_whole(&folder.path().join("circle"), b"").is_err());
    }

    #[test]
    fn a_file_keeps_its_mode_and_its_owner_and_a_new_one_has_the_usual_mode() {
        let folder = tempfile::tempdir().unwrap();
        let [file, usual] = ["file", "usual"].map(|name| folder.path().join(name));
        let mode = |file: &Path| fs::metadata(file).unwrap().permissions().mode() & 0o777;
        write_whole(&file, b"").unwrap();
        fs::write(&usual, b"").unwrap();
        assert_eq!(mode(&file), mode(&usual));
        for kept in [0o600, 0o640, 0o666] {
            fs::set_permissions(&file, fs::Permissions::from_mode(kept)).unwrap();
            write_whole(&file, b"private").unwrap();
            assert_eq!(mode(&file), kept);
        }
        // Root alone can give files away.
        if std::os::unix::fs::chown(&file, Some(12345), Some(12345)).is_ok() {
            write_whole(&file, b"of another").unwrap();
            assert_eq!(fs::metadata(&file).unwrap().uid(), 12345);
            assert_eq!(mode(&file), 0o666);
        }
    }

    #[test]
    fn a_file_whose_owner_cannot_be_kept_stays_itself_and_changes_once_all_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "of before, and longer").unwrap();
        let found = fs::metadata(&file).unwrap();
        let begun = || {
            let into = OpenOptions::new().write(true).open(&file).unwrap();
            let temporary = Temporary::create(folder.path(), Some(&found)).unwrap();
            let mut output = Output(Way::Copied { into, temporary });
            output.write_all(b"new").unwrap();
            output
        };
        drop(begun());
        assert_eq!(fs::read_to_string(&file).unwrap(), "of before, and longer");
        begun().finish().unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert_eq!((fs::metadata(&file).unwrap().ino(), names(folder.path())), (found.ino(), vec!["file".to_owned()]));
    }

    #[test]
    fn a_file_that_may_not_be_written_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "kept").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o444)).unwrap();
        // Root may write everything.
        let may = OpenOptions::new().write(true).open(&file).is_ok();
        assert_eq!(write_whole(&file, b"new").is_ok(), may);
        assert_eq!(fs::read_to_string(&file).unwrap(), if may { "new" } else { "kept" });
    }
}

#[test]
fn temporary_files_of_killed_programs_are_removed_and_those_being_written_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let written = Temporary::named(folder.path(), options(None)).unwrap();
    // A killed program has lost its lock.
    for name in [".offtrack-4194999-0.tmp", ".offtrack-1-7.tmp", "offtrack-1-7.tmp", ".offtrack-1-7"] {
        fs::write(place(name), "half").unwrap();
    }
    fs::create_dir(place(".offtrack-2-0.tmp")).unwrap();
    // Another process writes there for the first time.
    let elsewhere = folder.path().join(".");
    write_whole(&elsewhere.join("report.json"), b"{}").unwrap();
    let left = names(folder.path());
    assert_eq!(left.len(), 5, "{left:?}");
    for kept in [".offtrack-1-7", ".offtrack-2-0.tmp", "offtrack-1-7.tmp", "report.json"] {
        assert!(left.iter().any(|name| name == kept), "{kept}: {left:?}");
    }
    written.put(&place("written")).unwrap();
    assert!(place("written").is_file());
    assert_eq!(names(folder.path()).len(), 5);
}

#[test]
fn temporary_files_with_a_name_are_removed_before_the_process_ends() {
    let folder = tempfile::tempdir().unwrap();
    let _written = Temporary::named(folder.path(), options(None)).unwrap();
    assert_eq!(names(folder.path()).len(), 1);
    // Those of other tests, which run beside this one, stay.
    remove_listed(|path| path.starts_with(folder.path()));
    assert_eq!(names(folder.path()).len(), 0);
}

#[test]
#[cfg(target_os = "linux")]
fn a_file_being_written_has_no_name_that_a_kill_could_leave_behind() {
    // A file system of this kind has files without names.
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let file = folder.path().join("report.json");
    for _ in 0..2 {
        let mut output = Output::create(&file).unwrap();
        let before = names(folder.path());
        output.write_all(b"{}").unwrap();
        assert_eq!(names(folder.path()), before);
        output.finish().unwrap();
        assert_eq!(names(folder.path()), ["report.json"]);
    }
}
