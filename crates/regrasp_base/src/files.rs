//! Files: read with a cap, hashed, written whole or not at all.

use crate::diagnostic::{Diagnostic, InputError, Place};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Largest input file that is read, in bytes.
pub const MAX_FILE_BYTES: u64 = 256 << 20;

/// Reads a whole regular file of at most [`MAX_FILE_BYTES`].
///
/// Errors: not found, a directory, a pipe or device, too large, not readable (`F001`).
pub fn read(path: &Path) -> Result<Vec<u8>, InputError> {
    read_at_most(path, MAX_FILE_BYTES)
}

/// As [`read`], for files of at most `max_bytes`.
pub fn read_at_most(path: &Path, max_bytes: u64) -> Result<Vec<u8>, InputError> {
    let fail = |problem: String| InputError::from(Diagnostic::new("F001", Place::file(path), problem));
    let metadata = fs::metadata(path).map_err(|error| fail(format!("cannot be read: {error}")))?;
    if !metadata.is_file() {
        return Err(fail("is not a regular file".into()));
    }
    if metadata.len() > max_bytes {
        return Err(fail(format!("has {} bytes, more than the limit of {max_bytes}", metadata.len())));
    }
    let file = fs::File::open(path).map_err(|error| fail(format!("cannot be opened: {error}")))?;
    let mut bytes = Vec::new();
    file.take(max_bytes + 1).read_to_end(&mut bytes).map_err(|error| fail(format!("cannot be read: {error}")))?;
    if bytes.len() as u64 > max_bytes {
        return Err(fail(format!("grew past the limit of {max_bytes} bytes while it was read")));
    }
    Ok(bytes)
}

/// Reads a UTF-8 text file; a byte order mark is dropped. Errors: as [`read`], and not UTF-8 (`F002`).
pub fn read_text(path: &Path) -> Result<String, InputError> {
    text_of(path, read(path)?)
}

/// The UTF-8 text of `bytes`, which came from `path`; a byte order mark is dropped.
pub fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String, InputError> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let (guess, encoding) = match bytes {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => ("looks like", "UTF-16"),
            _ => ("may be", "Latin-1"),
        };
        // Of UTF-16 not even the line feeds can be counted.
        let line = bytes[..offset].iter().filter(|&&byte| byte == b'\n').count() as u32 + 1;
        let place = if encoding == "UTF-16" { Place::file(path) } else { Place::line(path, line) };
        Diagnostic::new("F002", place, format!("is not UTF-8 at byte {offset}; it {guess} {encoding}"))
            .expected("UTF-8 text")
            .fix(format!("save it again as UTF-8, e.g. iconv -f {encoding} -t UTF-8"))
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// SHA-256 of `bytes`, as 64 lower-case hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&sha256_bytes(bytes))
}

/// SHA-256 of `bytes`.
pub fn sha256_bytes(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// `bytes` as lower-case hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Refuses a `path` where something stands that is no file, such as a folder, a pipe or a device, or that is read-only:
/// writing by renaming would put another file in its place.
pub fn refuse_other_than_file(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Err(io::Error::from(io::ErrorKind::IsADirectory)),
        Ok(metadata) if !metadata.is_file() => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "it is there and is not a regular file"))
        }
        Ok(metadata) if metadata.permissions().readonly() => Err(io::Error::from(io::ErrorKind::PermissionDenied)),
        Ok(_) => Ok(()),
        // The file that a symbolic link leads to need not exist, but links in a circle lead nowhere.
        Err(_) => target_of(path).map(|_| ()),
    }
}

/// Symbolic links that are followed one after the other, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// The file that writing to `path` writes: where symbolic links lead, whether it exists or not.
///
/// Errors: links that cannot be read, or that lead in a circle.
pub fn target_of(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&target) {
            Ok(metadata) if metadata.is_symlink() => {
                let link = fs::read_link(&target)?;
                // A relative link starts from the folder that it is in; an absolute one replaces the path.
                target = target.parent().unwrap_or(Path::new("")).join(link);
            }
            _ => return Ok(target),
        }
    }
    Err(io::Error::other("symbolic links lead in a circle"))
}

/// True when writing to `a` and to `b` writes one file, whatever the two are spelled like: through symbolic links, through
/// hard links, and where the file does not exist yet.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let (Ok(a), Ok(b)) = (target_of(a), target_of(b)) else { return a == b };
    match (fs::metadata(&a), fs::metadata(&b)) {
        (Ok(first), Ok(second)) => is_one_file(&first, &second) || is_same_path(&a, &b),
        (Err(_), Err(_)) => is_same_path(&a, &b),
        _ => false,
    }
}

#[cfg(unix)]
fn is_one_file(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_one_file(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    false
}

/// True when two paths without symbolic links at their ends name the same place.
fn is_same_path(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| -> Option<PathBuf> {
        let folder = match path.parent()? {
            folder if folder.as_os_str().is_empty() => Path::new("."),
            folder => folder,
        };
        Some(real_folder(folder)?.join(path.file_name()?))
    };
    a == b || real(a).is_some_and(|real_a| Some(real_a) == real(b))
}

/// The folder as the system spells it; of one that does not exist yet, its nearest ancestor that does, and the rest.
fn real_folder(folder: &Path) -> Option<PathBuf> {
    if let Ok(real) = folder.canonicalize() {
        return Some(real);
    }
    let above = match folder.parent()? {
        above if above.as_os_str().is_empty() => Path::new("."),
        above => above,
    };
    Some(real_folder(above)?.join(folder.file_name()?))
}

/// Writes `bytes` to `path` through a temporary file beside it, synced and renamed: the file is whole or unchanged.
///
/// Symbolic links stay, and the file that they lead to is written. A file that exists keeps its permissions.
///
/// Errors: what the system says, and what stands at `path` is not a regular file, or is read-only.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    refuse_other_than_file(path)?;
    let path = target_of(path)?;
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "path has no file name"))?;
    let mut temporary_name = name.to_owned();
    temporary_name.push(format!(".{}.tmp", std::process::id()));
    let temporary: PathBuf = path.with_file_name(temporary_name);
    let result = (|| {
        let mut file = create_like(&temporary, &path)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, &path)
    })();
    if result.is_err() {
        // Best effort: the error that matters is the first one.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Creates a file with the permissions of `existing`, where that is there. Nobody who may not read that can read this, at no
/// moment.
fn create_like(path: &Path, existing: &Path) -> io::Result<fs::File> {
    let Ok(metadata) = fs::metadata(existing) else { return fs::File::create(path) };
    let mut options = fs::File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    file.set_permissions(metadata.permissions())?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sha256_of_the_standard_example() {
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn the_line_that_is_not_utf_8_is_named() {
        let of = |bytes: &[u8]| text_of(Path::new("a"), bytes.to_vec()).unwrap_err().to_string();
        assert!(of(b"x\n\xe9").starts_with("F002 a:2: is not UTF-8 at byte 2; it may be Latin-1"));
        assert!(of(b"\xff\xfex\0").starts_with("F002 a: is not UTF-8 at byte 0; it looks like UTF-16"));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_not_replaced() {
        assert!(write_atomic(Path::new("/dev/null"), b"x").is_err());
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let missing = std::env::temp_dir().join("regrasp_no_such_dir").join("plan.json");
        assert!(write_atomic(&missing, b"x").is_err());
        assert!(!missing.exists());
    }

    /// A folder that is removed at the end of the test.
    #[cfg(unix)]
    struct Folder(PathBuf);

    #[cfg(unix)]
    impl Folder {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("regrasp_files_{name}_{}", std::process::id()));
            fs::create_dir_all(&folder).unwrap();
            Folder(folder)
        }
    }

    #[cfg(unix)]
    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_what_they_lead_to_is_written() {
        let folder = Folder::new("links");
        let [file, link, dangling, new] = ["file", "link", "dangling", "new"].map(|name| folder.0.join(name));
        fs::write(&file, b"old").unwrap();
        std::os::unix::fs::symlink("file", &link).unwrap();
        std::os::unix::fs::symlink(&new, &dangling).unwrap();
        for (path, target) in [(&link, &file), (&dangling, &new)] {
            write_atomic(path, b"written").unwrap();
            assert!(fs::symlink_metadata(path).unwrap().is_symlink());
            assert_eq!(fs::read(target).unwrap(), b"written");
        }
        let circle = folder.0.join("circle");
        std::os::unix::fs::symlink("circle", &circle).unwrap();
        assert!(write_atomic(&circle, b"x").is_err());
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 5, "nothing else is left behind");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_stay_and_read_only_files_are_refused() {
        use std::os::unix::fs::PermissionsExt;
        let folder = Folder::new("modes");
        let file = folder.0.join("file");
        for mode in [0o600, 0o640, 0o666] {
            fs::write(&file, b"old").unwrap();
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
            write_atomic(&file, b"new").unwrap();
            assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, mode);
        }
        fs::set_permissions(&file, fs::Permissions::from_mode(0o444)).unwrap();
        let refused = write_atomic(&file, b"over").unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::PermissionDenied);
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn one_file_under_two_names_is_one_file() {
        let folder = Folder::new("same");
        let at = |name: &str| folder.0.join(name);
        fs::write(at("file"), b"x").unwrap();
        fs::write(at("other"), b"x").unwrap();
        fs::create_dir(at("sub")).unwrap();
        fs::hard_link(at("file"), at("hard")).unwrap();
        std::os::unix::fs::symlink("file", at("soft")).unwrap();
        std::os::unix::fs::symlink("missing", at("dangling")).unwrap();
        std::os::unix::fs::symlink(".", at("here")).unwrap();
        let same = [
            ["file", "file"],
            ["file", "./file"],
            ["file", "sub/../file"],
            ["file", "hard"],
            ["file", "soft"],
            ["hard", "here/soft"],
            ["missing", "sub/../missing"],
            ["missing", "dangling"],
            ["missing", "here/missing"],
            ["new/missing", "here/new/missing"],
        ];
        for [a, b] in same {
            assert!(is_same_file(&at(a), &at(b)) && is_same_file(&at(b), &at(a)), "{a} and {b}");
        }
        for [a, b] in [["file", "other"], ["file", "missing"], ["missing", "sub/missing"], ["soft", "dangling"]] {
            assert!(!is_same_file(&at(a), &at(b)), "{a} and {b}");
        }
    }
}
