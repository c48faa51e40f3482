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

/// Refuses a `path` where something stands that is no file, such as a folder, a pipe or a device: writing by renaming would
/// put a file in its place.
pub fn refuse_other_than_file(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Err(io::Error::from(io::ErrorKind::IsADirectory)),
        Ok(metadata) if !metadata.is_file() => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "it is there and is not a regular file"))
        }
        _ => Ok(()),
    }
}

/// Writes `bytes` to `path` through a temporary file beside it, synced and renamed: the file is whole or unchanged.
///
/// Errors: what the system says, and what stands at `path` is not a regular file.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    refuse_other_than_file(path)?;
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "path has no file name"))?;
    let mut temporary_name = name.to_owned();
    temporary_name.push(format!(".{}.tmp", std::process::id()));
    let temporary: PathBuf = path.with_file_name(temporary_name);
    let result = (|| {
        let mut file = fs::File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    })();
    if result.is_err() {
        // Best effort: the error that matters is the first one.
        let _ = fs::remove_file(&temporary);
    }
    result
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
}
